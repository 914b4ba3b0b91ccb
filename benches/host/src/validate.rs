//! Compares the path tracer with references of another renderer.

use glam::DVec3;

use crate::Error;
use crate::args::Args;
use crate::clock::thread_seconds;
use crate::error::Reference;
use crate::film::Film;
use crate::methods::Method;
use crate::random::Pcg32;
use crate::world::World;

/// Standard deviations by which a mean may differ from the reference's. *Measured*: of 40 means, none differs by more
/// than 3 by chance.
const DEVIATIONS: f64 = 4.0;

/// Renders with each method for as long as an image takes, and compares means and errors. Returns whether they agree.
pub(crate) fn validate(
    scene: &str,
    world: &World,
    bounces: u32,
    reference: &Reference,
    args: &Args,
) -> Result<bool, Error> {
    println!(
        "\n{scene}, {bounces} bounces, {} triangles: mean {:.5}, own noise {:.1e}",
        world.triangle_count(),
        reference.image().mean(),
        reference.noise()
    );
    let mut all_agree = true;
    for method in Method::all(world, 1, 0)? {
        let mut film = Film::new();
        let mut random = Pcg32::new(77, 3000);
        let mut curve = Vec::new();
        let start = thread_seconds();
        let mut next = 4;
        while thread_seconds() - start < args.seconds {
            method.render_pass(world, bounces, &mut random, &mut film);
            if film.samples() == next {
                curve.push((next, reference.rel_mse(&film.image()) * f64::from(next)));
                next *= 4;
            }
        }
        let error = reference.rel_mse(&film.image());
        curve.push((film.samples(), error * f64::from(film.samples())));
        let expected = reference.predicted(&film);
        let deviation = deviation(&film, reference);
        let agrees = deviation.abs().max_element() <= DEVIATIONS;
        all_agree &= agrees;
        let curve: Vec<String> = curve.iter().map(|(n, product)| format!("{n}: {product:.3}")).collect();
        println!(
            "  {:<12} mean {:.5} ({:+.1} {:+.1} {:+.1} deviations{}), relMSE {error:.2e}, by variance {expected:.2e}, \
             difference {:+.1e}, relMSE x samples {}",
            method.name,
            film.image().mean(),
            deviation.x,
            deviation.y,
            deviation.z,
            if agrees { "" } else { ": TOO FAR" },
            error - expected,
            curve.join(", ")
        );
    }
    Ok(all_agree)
}

/// Returns by how many standard deviations the mean of an image differs from the reference's.
fn deviation(film: &Film, reference: &Reference) -> DVec3 {
    let pixels = film.variance();
    let variance = pixels.iter().sum::<DVec3>() / (pixels.len() as f64).powi(2);
    // The reference's noise, as if each pixel had as much of it as its error's measure says.
    let image = reference.image();
    let squares: DVec3 = image.pixels.iter().map(|pixel| pixel.as_dvec3() * pixel.as_dvec3()).sum();
    let own = reference.noise() * squares / (pixels.len() as f64).powi(2);
    (film.image().mean() - image.mean()) / (variance + own).map(f64::sqrt)
}
