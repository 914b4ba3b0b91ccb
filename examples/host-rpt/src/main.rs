//! A renderer that was not written for `fanlight`, lit by its own light sampling and through `fanlight`.
//!
//! `cargo run --release --manifest-path examples/host-rpt/Cargo.toml -- [SAMPLES [PICTURE]]`. What had to be written is
//! `lights.rs`; the renderer is [`rpt`] as it is on the registry.

mod emitter;
mod lights;
mod scene;

use std::time::Instant;

use lights::Lights;
use rpt::image::{GenericImage, RgbImage};
use rpt::{Light, Material, Object, Renderer, Scene, SceneAdd, Shape, glm};

const SIZE: [u32; 2] = [240, 180];
/// Samples a pixel, unless the command line says otherwise.
const SAMPLES: u32 = 16;
/// Samples of the reference for each one of an image.
const REFERENCE: u32 = 16;
/// Added to the squared reference, so that dark pixels do not decide.
const EPSILON: f64 = 1e-3;

fn main() -> Result<(), Box<dyn core::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let samples = arguments.next().map_or(Ok(SAMPLES), |samples| samples.parse())?;
    let emitters = scene::emitters();
    let triangles: usize = emitters.iter().map(|emitter| emitter.indices.len()).sum();
    let own = emitters.iter().cloned().fold(scene::scene(), lit);
    let through = lit(scene::scene(), Lights::new(emitters)?);

    let [first, with, reference] =
        [(&own, samples), (&through, samples), (&through, REFERENCE * samples)].map(|(scene, n)| render(scene, n));
    let as_long = ((f64::from(samples) * with.seconds / first.seconds).round() as u32).max(1);
    let without = render(&own, as_long);
    println!("{triangles} emitting triangles, {} x {} pixels", SIZE[0], SIZE[1]);
    println!("{:24} {:>8} {:>8} {:>10} {:>14}", "", "samples", "seconds", "relMSE", "brightness");
    for (name, frame) in [
        ("rpt, equal samples", &first),
        ("rpt, equal time", &without),
        ("rpt through fanlight", &with),
        ("reference", &reference),
    ] {
        let Frame { samples, seconds, .. } = frame;
        let (error, mean) = (error(frame, &reference), brightness(frame));
        println!("{name:24} {samples:>8} {seconds:>8.2} {error:>10.5} {mean:>14.4}");
    }
    let gain = error(&without, &reference) / error(&with, &reference);
    println!(
        "gain at equal time {gain:.1}, at equal samples {:.1}",
        error(&first, &reference) / error(&with, &reference)
    );
    if let Some(path) = arguments.next() {
        let mut pair = RgbImage::new(2 * SIZE[0], SIZE[1]);
        pair.copy_from(&without.image, 0, 0)?;
        pair.copy_from(&with.image, SIZE[0], 0)?;
        pair.save(path)?;
    }
    Ok(())
}

/// The scene with one more light. Radiance is in the shape's density, and the color here.
fn lit(mut scene: Scene, shape: impl Shape + 'static) -> Scene {
    scene.add(Light::Object(Object::new(shape).material(Material::light(glm::vec3(1.0, 0.85, 0.7), 1.0))));
    scene
}

struct Frame {
    image: RgbImage,
    samples: u32,
    seconds: f64,
}

fn render(scene: &Scene, samples: u32) -> Frame {
    let renderer = Renderer::new(scene, scene::camera()).width(SIZE[0]).height(SIZE[1]).num_samples(samples);
    let start = Instant::now();
    let image = renderer.render();
    Frame { image, samples, seconds: start.elapsed().as_secs_f64() }
}

/// Linear values of all channels, as far as eight bits hold them.
fn linear(frame: &Frame) -> impl Iterator<Item = f64> {
    frame.image.as_raw().iter().map(|byte| (f64::from(*byte) / 255.0).powf(2.2))
}

/// Relative mean squared error.
fn error(frame: &Frame, reference: &Frame) -> f64 {
    let squares = linear(frame).zip(linear(reference)).map(|(a, b)| (a - b).powi(2) / (b * b + EPSILON));
    squares.sum::<f64>() / frame.image.as_raw().len() as f64
}

fn brightness(frame: &Frame) -> f64 {
    linear(frame).sum::<f64>() / frame.image.as_raw().len() as f64
}
