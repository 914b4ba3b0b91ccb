//! Renders a scene by several sets of techniques in the same time.

use super::table::{self, Row};
use super::with_progress_bar;
use crate::render::{Budget, Camera, Error, Film, Image, PathTracer, Progressive, Reference, Techniques, World};

/// Samples a pixel for what is seen without being scattered.
const SEEN: Budget = Budget::Samples(16);
/// How many times as long as an image its reference is rendered.
const REFERENCE_FACTOR: u32 = 4;

/// How much is rendered.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// Of each image.
    pub(crate) budget: Budget,
    pub(crate) seed: u32,
}

/// One of the sets of techniques that are compared.
pub(crate) struct Contestant {
    pub(crate) name: String,
    pub(crate) techniques: Techniques,
}

/// What came out.
pub(crate) struct Comparison {
    /// One of each contestant.
    pub(crate) images: Vec<Image>,
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
    let render = |Contestant { name, techniques }: &Contestant, seed: u32, budget: Budget| {
        let tracer = PathTracer::new(world, techniques, bounces);
        let progressive = Progressive { tracer, camera, seed };
        with_progress_bar(name, |progress| progressive.render(budget, progress))
    };
    let films: Vec<(Film, f64)> = contestants.iter().map(|c| render(c, effort.seed, effort.budget)).collect();
    let best = contestants.last().ok_or("nothing to compare")?;
    let reference = Reference::from_film(&render(best, !effort.seed, effort.budget.times(REFERENCE_FACTOR)).0);
    let tracer = PathTracer::new(world, &best.techniques, 0);
    let seen = Progressive { tracer, camera, seed: effort.seed }.render(SEEN, drop).0.image();

    println!("\n{title}");
    let rows: Vec<_> = (contestants.iter().zip(&films))
        .map(|(Contestant { name, .. }, (film, seconds))| Row { name, film, seconds: *seconds })
        .collect();
    table::print(&rows, &reference)?;
    Ok(Comparison { images: films.iter().map(|(film, _)| film.image()).collect(), reference, seen })
}
