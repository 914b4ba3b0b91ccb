//! Images of all methods in turn, each for the same time, and their errors.

use crate::Error;
use crate::args::Args;
use crate::clock::thread_seconds;
use crate::cost;
use crate::error::Reference;
use crate::file::write_png;
use crate::film::Film;
use crate::methods::Method;
use crate::random::Pcg32;
use crate::report::Row;
use crate::statistics::{geometric_mean, ratio};
use crate::world::World;

/// Scenes in which fanlight also learns what walls hide, whether or not it is asked to; the last one has no walls.
const LEARNED: [&str; 4] = ["two-rooms", "building", "building-windows", "cornell"];
/// Rays that it learns by, for each second of an image. They take about a twentieth of an image's time, and count as
/// part of it.
const LEARNING_RAYS: f64 = 10_000.0;
/// Share of the time from which on errors are noted.
const CURVE: f64 = 1.0 / 16.0;

/// The image that a method is working on.
struct Progress {
    film: Film,
    random: Pcg32,
    /// CPU time that was spent on it.
    seconds: f64,
    /// Seconds, and the error by then.
    curve: Vec<[f64; 2]>,
}

/// What the images of a method came to, one entry a seed.
#[derive(Default)]
struct Outcome {
    samples: Vec<f64>,
    seconds: Vec<f64>,
    errors: Vec<f64>,
    curves: Vec<Vec<[f64; 2]>>,
}

/// Renders a scene with all methods and all seeds. Returns one row a method.
pub(crate) fn measure(
    scene: &str,
    world: &World,
    bounces: u32,
    reference: &Reference,
    args: &Args,
) -> Result<Vec<Row>, Error> {
    let is_learned = args.visibility || LEARNED.contains(&scene);
    let rays = if is_learned { (LEARNING_RAYS * args.seconds) as u64 } else { 0 };
    let methods = Method::all(world, bounces, rays)?;
    let costs = cost::measure(world, &methods, bounces);
    let mut outcomes: Vec<Outcome> = methods.iter().map(|_| Outcome::default()).collect();
    for seed in 0..args.seeds {
        let images = images(world, &methods, bounces, u64::from(seed), reference, args);
        for ((method, outcome), image) in methods.iter().zip(&mut outcomes).zip(&images) {
            if args.by_variance && image.film.samples() < 2 {
                return Err("an image of one sample a pixel has no variance: it needs more --seconds".into());
            }
            outcome.samples.push(f64::from(image.film.samples()));
            outcome.seconds.push(image.seconds);
            outcome.errors.push(error(&image.film, reference, args));
            outcome.curves.push(image.curve.clone());
            if let Some(folder) = args.picture.as_ref().filter(|_| seed == 0) {
                std::fs::create_dir_all(folder)?;
                let path = folder.join(format!("{scene}_{bounces}_{}.png", method.name));
                write_png(&path, &image.film.image(), reference.image())?;
            }
        }
    }
    if let Some(folder) = &args.picture {
        let path = folder.join(format!("{scene}_{bounces}_reference.png"));
        write_png(&path, reference.image(), reference.image())?;
    }

    let products: Vec<Vec<f64>> = outcomes.iter().map(Outcome::products).collect();
    let competitors = (0..methods.len()).filter(|&i| methods[i].is_competitor());
    let best = competitors.min_by(|&i, &j| geometric_mean(&products[i]).total_cmp(&geometric_mean(&products[j])));
    let best = best.ok_or("there is no competitor")?;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let row = |(i, method): (usize, &Method)| Row {
        scene: scene.to_owned(),
        bounces,
        method: method.name,
        is_best: i == best,
        samples: mean(&outcomes[i].samples),
        seconds: mean(&outcomes[i].seconds),
        rel_mse: geometric_mean(&outcomes[i].errors),
        product: geometric_mean(&products[i]),
        over_best: ratio(&products[best], &products[i]),
        cost: costs.methods[i],
        ray_ns: costs.ray_ns,
        reference_noise: reference.noise(),
        curve: outcomes[i].curve(),
    };
    Ok(methods.iter().enumerate().map(row).collect())
}

impl Outcome {
    /// Returns error times seconds of each image.
    fn products(&self) -> Vec<f64> {
        self.errors.iter().zip(&self.seconds).map(|(error, seconds)| error * seconds).collect()
    }

    /// Returns the geometric means of the curves, as far as all images have them.
    fn curve(&self) -> Vec<[f64; 2]> {
        let count = self.curves.iter().map(Vec::len).min().unwrap_or(0);
        let point = |i: usize| {
            // Curves end at the same time; some begin later.
            let points = self.curves.iter().map(|curve| curve[curve.len() - count + i]);
            let of = |axis: usize| geometric_mean(&points.clone().map(|point| point[axis]).collect::<Vec<_>>());
            [of(0), of(1)]
        };
        (0..count).map(point).collect()
    }
}

/// Renders one image with each method. The method that has had the least time has its turn next, so that a machine
/// whose speed changes treats all alike.
fn images(
    world: &World,
    methods: &[Method],
    bounces: u32,
    seed: u64,
    reference: &Reference,
    args: &Args,
) -> Vec<Progress> {
    let seconds = args.seconds;
    let start = |i: usize| Progress {
        film: Film::new(),
        random: Pcg32::new(seed, i as u64),
        seconds: methods[i].preparation,
        curve: Vec::new(),
    };
    let mut images: Vec<Progress> = (0..methods.len()).map(start).collect();
    loop {
        let turn = (0..methods.len()).min_by(|&i, &j| images[i].seconds.total_cmp(&images[j].seconds)).unwrap_or(0);
        let image = &mut images[turn];
        if image.seconds >= seconds {
            return images;
        }
        let before = thread_seconds();
        methods[turn].render_pass(world, bounces, &mut image.random, &mut image.film);
        image.seconds += thread_seconds() - before;
        // Once for each halving of the time.
        let is_later = image.curve.last().is_none_or(|[last, _]| image.seconds >= 1.9 * last);
        let has_error = !args.by_variance || image.film.samples() > 1;
        if has_error && (image.seconds >= seconds || image.seconds >= CURVE * seconds && is_later) {
            image.curve.push([image.seconds, error(&image.film, reference, args)]);
        }
    }
}

/// Returns the error of an image.
fn error(film: &Film, reference: &Reference, args: &Args) -> f64 {
    if args.by_variance { reference.predicted(film) } else { reference.rel_mse(&film.image()) }
}
