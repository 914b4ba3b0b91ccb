//! Renders the reference room with the example's renderer, and compares it with images by another renderer.
//!
//! The references were rendered with Mitsuba 3, which knows no portals. It interpolates the sky bilinearly, as the
//! example does.

#[expect(dead_code, unused_imports, reason = "the example uses the rest")]
#[path = "../../room/render/mod.rs"]
mod render;

use std::path::{Path, PathBuf};

use glam::DVec3;
use render::{
    Budget, Camera, Film, Image, Opening, PathTracer, Progressive, Reference, Sky, Strategy, Window, World, read_rgb,
};

/// Samples a pixel of the two renderings whose errors are compared.
const FEW: u32 = 32;
const MANY: u32 = 512;

/// A scene whose image is known.
struct Case {
    window: Window,
    opening: Opening,
    bounces: u32,
    reference: &'static str,
    /// The reference's own noise, as a relative mean squared error.
    noise: f64,
}

/// Noise of the references for direct light and for more bounces, from the error at which renderings with ever more
/// samples settle.
const NOISE: [f64; 2] = [1e-4, 2.5e-3];

#[test]
fn direct_light_through_a_rectangle() {
    Case { window: Window::Rect, opening: Opening::Hole, bounces: 1, reference: "reference_a_2.exr", noise: NOISE[0] }
        .check();
}

#[test]
fn direct_light_through_a_star() {
    Case { window: Window::Star, opening: Opening::Hole, bounces: 1, reference: "reference_b_2.exr", noise: NOISE[0] }
        .check();
}

#[test]
fn direct_light_through_a_star_on_a_clip_map() {
    Case { window: Window::Star, opening: Opening::Clip, bounces: 1, reference: "reference_b_2.exr", noise: NOISE[0] }
        .check();
}

#[test]
fn five_bounces_through_a_rectangle() {
    Case { window: Window::Rect, opening: Opening::Hole, bounces: 5, reference: "reference_a_6.exr", noise: NOISE[1] }
        .check();
}

impl Case {
    fn check(&self) {
        let (Some(sky), Some(reference)) = (data("sky.exr"), data(self.reference)) else { return };
        let sky = Sky::new(rows_off_poles(&read_rgb(&sky).unwrap()));
        let world = World::new(self.window, self.opening, sky).unwrap();
        let reference = Reference::exact(read_rgb(&reference).unwrap());
        for strategy in [Strategy::Environment, Strategy::EnvironmentAndPortals] {
            let [few, many] = [FEW, MANY].map(|samples| self.render(&world, strategy, samples));
            println!("{} {:?} {strategy:?}:", self.reference, self.opening);
            check_mean(&many, &reference);
            check_convergence(&few, &many, &reference, self.noise);
        }
    }

    fn render(&self, world: &World, strategy: Strategy, samples: u32) -> Film {
        let tracer = PathTracer::new(world, strategy, self.bounces);
        Progressive { tracer, camera: Camera::scaled(1), seed: samples }.render(Budget::Samples(samples), |_| ()).0
    }
}

/// Every channel's mean is the reference's, within four standard deviations and a thousandth.
fn check_mean(film: &Film, reference: &Reference) {
    let expected = reference.image().mean();
    let deviation = film.variance().iter().sum::<DVec3>().map(f64::sqrt) / reference.image().pixels.len() as f64;
    let error = film.image().mean() / expected - 1.0;
    let tolerance = 4.0 * deviation / expected + 0.001;
    println!("  mean {error:+.5} of the reference's, tolerance {tolerance:.5}");
    assert!(
        error.abs().cmple(tolerance).all(),
        "the mean's relative error is {error}, with a tolerance of {tolerance}"
    );
    assert!(error.abs().max_element() < 0.005, "the mean is off by more than half a percent");
    assert!(tolerance.max_element() < 0.02, "too noisy to tell");
}

/// The error falls as the number of samples rises, so that there is no systematic part in it but the reference's noise.
fn check_convergence(few: &Film, many: &Film, reference: &Reference, noise: f64) {
    let [few_cost, many_cost] = [few, many].map(|film| reference.rel_mse(&film.image()) * f64::from(film.samples()));
    println!("  relMSE x samples: {few_cost:.4} with {FEW}, {many_cost:.4} with {MANY}");
    let limit = 2.0 * few_cost + noise * f64::from(many.samples());
    assert!(many_cost < limit, "relMSE x samples grows from {few_cost} to {many_cost}");
}

/// A file of the reference data. `None`, with a printed line, where it is absent.
fn data(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/room").join(name);
    let exists = path.exists();
    if !exists {
        println!("skipped: no {}", path.display());
    }
    exists.then_some(path)
}

/// The references' renderer spreads an image's rows from pole to pole, the first and the last of them *on* the poles.
/// Here, as nearly everywhere else, they lie half a row away from them.
///
/// Interpolates the image to twice its rows, enough for the sun to keep its place and shape.
fn rows_off_poles(image: &Image) -> Image {
    let (width, height) = (image.width, 2 * image.height);
    let mut resampled = Image::black(width, height);
    for (i, texel) in resampled.pixels.iter_mut().enumerate() {
        let row = ((i / width) as f32 + 0.5) / height as f32 * (image.height - 1) as f32;
        let above = row as usize * width + i % width;
        *texel = image.pixels[above].lerp(image.pixels[above + width], row.fract());
    }
    resampled
}
