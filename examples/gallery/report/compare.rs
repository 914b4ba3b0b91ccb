//! Renders a scene by several sets of techniques in the same time.

use super::clock;
use super::statistics::{Logarithms, geometric_mean};
use super::with_progress_bar;
use crate::render::{Budget, Camera, Error, Film, Image, PathTracer, Progressive, Reference, Techniques, World};

/// Samples a pixel for what is seen without being scattered.
const SEEN: Budget = Budget::Samples(16);
/// How many times as long as all images of a contestant their reference is rendered. *Chosen.*
const REFERENCE_FACTOR: u32 = 4;

/// How much is rendered.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// Budget of each image.
    pub(crate) budget: Budget,
    pub(crate) seed: u32,
    /// How many images of each contestant are rendered, with other random numbers each.
    pub(crate) images: u32,
}

/// What a set of techniques is compared as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Role {
    /// Without `fanlight`: the best of these is what others are measured by.
    Competitor,
    /// With `fanlight`: the last of these is what the scene's figure is about.
    Fanlight,
    /// More than a plain path tracer does.
    Extra,
}

/// One of the sets of techniques that are compared.
pub(crate) struct Contestant {
    pub(crate) name: String,
    pub(crate) role: Role,
    pub(crate) techniques: Techniques,
    /// What it took to learn something before the first sample: it is part of the time of each image.
    pub(crate) seconds: f64,
}

/// What came out.
pub(crate) struct Comparison {
    /// One of each contestant.
    pub(crate) images: Vec<Image>,
    /// The best competitor, and the last one with `fanlight`.
    pub(crate) shown: [usize; 2],
    pub(crate) reference: Reference,
    /// Lights and sky as the camera sees them. No technique has to do with these, so that they are in no error.
    pub(crate) seen: Image,
}

/// Renders with each set of techniques, and the reference with the last one and other random numbers. Prints the
/// errors.
pub(crate) fn compare(
    title: &str,
    world: &World,
    camera: Camera,
    bounces: u32,
    contestants: &[Contestant],
    effort: Effort,
) -> Result<Comparison, Error> {
    let best = contestants.last().ok_or("nothing to compare")?;
    let runs: Vec<Vec<Run>> = (0..effort.images)
        .map(|i| {
            let seed = effort.seed.wrapping_add(i);
            let tracers: Vec<_> = (contestants.iter())
                .map(|Contestant { techniques, .. }| PathTracer::new(world, techniques, bounces))
                .map(|tracer| Progressive { tracer, camera, seed })
                .collect();
            let learning: Vec<_> = contestants.iter().map(|contestant| contestant.seconds).collect();
            with_progress_bar(title, |progress| take_turns(&tracers, &learning, effort.budget, progress))
        })
        .collect();
    let budget = effort.budget.times(REFERENCE_FACTOR * effort.images);
    let tracer = PathTracer::new(world, &best.techniques, bounces);
    let progressive = [Progressive { tracer, camera, seed: !effort.seed }];
    let reference = with_progress_bar("reference", |progress| take_turns(&progressive, &[0.0], budget, progress));
    let reference = Reference::from_film(&reference.first().ok_or("nothing to compare")?.film);
    let tracer = PathTracer::new(world, &best.techniques, 0);
    let seen = Progressive { tracer, camera, seed: effort.seed }.render(SEEN, drop).0.image();

    println!("\n{title}");
    let shown = print(contestants, &runs, &reference);
    let images = runs.first().map_or_else(Vec::new, |runs| runs.iter().map(|run| run.film.image()).collect());
    Ok(Comparison { images, shown, reference, seen })
}

/// One image, and the seconds that it took.
struct Run {
    film: Film,
    seconds: f64,
}

impl Run {
    /// Relative mean squared error. What is left of it after the reference's own noise is subtracted may be less than
    /// nothing: then it is known to be small, and no more.
    fn error(&self, reference: &Reference) -> f64 {
        const LEAST: f64 = 0.05;
        reference.rel_mse(&self.film.image()).max(LEAST * reference.noise()).max(f64::MIN_POSITIVE)
    }
}

/// Renders all images at the same time, a sample a pixel of each in turn, so that a machine whose speed changes treats
/// all alike. `learning` is what each took before.
fn take_turns(tracers: &[Progressive<'_>], learning: &[f64], budget: Budget, progress: &dyn Fn(f64)) -> Vec<Run> {
    let empty = |(tracer, &seconds): (&Progressive<'_>, &f64)| Run {
        film: Film::new(tracer.camera.width(), tracer.camera.height()),
        seconds,
    };
    let mut runs: Vec<_> = tracers.iter().zip(learning).map(empty).collect();
    loop {
        let spent = |run: &Run| budget.spent(run.seconds, run.film.samples()).min(1.0);
        progress(runs.iter().map(spent).sum::<f64>() / runs.len().max(1) as f64);
        let mut is_done = true;
        for (tracer, run) in tracers.iter().zip(&mut runs) {
            if spent(run) < 1.0 {
                let start = clock::seconds();
                tracer.add_pass(&mut run.film);
                run.seconds += clock::seconds() - start;
                is_done = false;
            }
        }
        if is_done {
            return runs;
        }
    }
}

/// Prints the errors, and what each contestant gains over the best competitor. Returns that competitor and the last
/// contestant with `fanlight`.
fn print(contestants: &[Contestant], runs: &[Vec<Run>], reference: &Reference) -> [usize; 2] {
    let costs = |i: usize| runs.iter().map(move |runs| runs[i].error(reference) * runs[i].seconds);
    let competitors = (0..contestants.len()).filter(|&i| contestants[i].role == Role::Competitor);
    let best = competitors.min_by(|&a, &b| geometric_mean(costs(a)).total_cmp(&geometric_mean(costs(b)))).unwrap_or(0);
    let last = contestants.iter().rposition(|contestant| contestant.role == Role::Fanlight).unwrap_or(best);
    let gain = |i: usize| Logarithms::new(costs(best).zip(costs(i)).map(|(best, cost)| best / cost));
    println!(
        "{:36} {:>8} {:>8} {:>10} {:>12} {:>8} {:>16}",
        "", "spp", "seconds", "relMSE", "relMSE x s", "gain", "95 %"
    );
    for (i, Contestant { name, .. }) in contestants.iter().enumerate() {
        let mean = |of: fn(&Run) -> f64| runs.iter().map(|runs| of(&runs[i])).sum::<f64>() / runs.len() as f64;
        let (samples, seconds) = (mean(|run| f64::from(run.film.samples())), mean(|run| run.seconds));
        let error = geometric_mean(runs.iter().map(|runs| runs[i].error(reference)));
        let (cost, gain) = (geometric_mean(costs(i)), gain(i));
        let interval = gain.interval().map_or_else(String::new, |[low, high]| format!("{low:.2} to {high:.2}"));
        println!(
            "{name:36} {samples:>8.0} {seconds:>8.2} {error:>10.3e} {cost:>12.3e} {:>8.2} {interval:>16}",
            gain.mean()
        );
    }
    if reference.noise() > 0.0 {
        println!("The reference's own noise, relMSE {:.1e}, is subtracted.", reference.noise());
    }
    if contestants.iter().any(|contestant| contestant.role == Role::Fanlight) {
        let [name, over] = [last, best].map(|i| &contestants[i].name);
        println!("Efficiency of `{name}` over the best without fanlight, `{over}`: {:.2}", gain(last).mean());
    }
    [best, last]
}
