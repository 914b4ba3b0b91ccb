//! A renderer that knows no lights but spheres and lets nobody else choose them, lit by its own choice and through
//! `fanlight`.
//!
//! `cargo run --release --manifest-path examples/host-scene/Cargo.toml -- [SAMPLES [PICTURE]]`. What had to be written
//! is `lights.rs`, and what `scene.rs` does with it; the renderer is [`rust_pathtracer`] as it is on the registry.

mod lights;
mod scene;

use image::{Rgb, RgbImage};
use rust_pathtracer::prelude::{ColorBuffer, Scene, Tracer};
use rustix::time::{ClockId, clock_gettime};
use scene::World;

const SIZE: [u32; 2] = [200, 150];
/// Samples a pixel with `fanlight`, unless the command line says otherwise.
const SAMPLES: u32 = 16;
/// Samples of the reference for each one of an image.
const REFERENCE: u32 = 32;
/// Added to the squared reference, as a share of its squared mean, so that dark pixels do not decide.
const EPSILON: f64 = 0.01;

fn main() -> Result<(), Box<dyn core::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let samples = arguments.next().map_or(Ok(SAMPLES), |samples| samples.parse())?;
    let through = || World::through_fanlight().map(|world| Tracer::new(Box::new(world)));
    let own = || Tracer::new(Box::new(World::new()));
    let with = render(through()?, samples);
    let first = render(own(), samples);
    let as_long = (f64::from(samples) * with.seconds / first.seconds).round().max(1.0) as u32;
    let without = render(own(), as_long);
    let reference = render(through()?, REFERENCE * samples);
    println!("{:34} {:>8} {:>8} {:>10} {:>14}", "", "samples", "seconds", "relMSE", "brightness");
    for (name, frame) in [
        ("rust-pathtracer, equal samples", &first),
        ("rust-pathtracer, equal time", &without),
        ("rust-pathtracer through fanlight", &with),
        ("reference, through fanlight", &reference),
    ] {
        let Frame { samples, seconds, .. } = frame;
        let (error, mean) = (error(frame, &reference), brightness(frame));
        println!("{name:34} {samples:>8} {seconds:>8.2} {error:>10.5} {mean:>14.4}");
    }
    let gain = |frame: &Frame| error(frame, &reference) / error(&with, &reference);
    println!("gain at equal time {:.1}, at equal samples {:.1}", gain(&without), gain(&first));
    if let Some(path) = arguments.next() {
        let mut pair = RgbImage::new(2 * SIZE[0], SIZE[1]);
        let exposure = 0.35 / brightness(&reference);
        let display = |value: f64| (255.0 * (1.0 - (-exposure * value).exp()).powf(1.0 / 2.2)) as u8;
        for (left, frame) in [(0, &without), (SIZE[0], &with)] {
            for (i, pixel) in (0..).zip(frame.buffer.pixels.chunks_exact(4)) {
                let [r, g, b] = [pixel[0], pixel[1], pixel[2]].map(|value| display(value.into()));
                pair.put_pixel(left + i % SIZE[0], i / SIZE[0], Rgb([r, g, b]));
            }
        }
        pair.save(path)?;
    }
    Ok(())
}

struct Frame {
    buffer: ColorBuffer,
    samples: u32,
    seconds: f64,
}

fn render(mut tracer: Tracer, samples: u32) -> Frame {
    let mut buffer = ColorBuffer::new(SIZE[0] as usize, SIZE[1] as usize);
    let start = seconds();
    for _ in 0..samples {
        tracer.render(&mut buffer);
    }
    Frame { buffer, samples, seconds: seconds() - start }
}

/// Time that all threads have spent on a processor.
fn seconds() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Red, green and blue of all pixels.
fn channels(frame: &Frame) -> impl Iterator<Item = f64> {
    frame.buffer.pixels.chunks_exact(4).flat_map(|pixel| pixel[..3].iter().map(|value| f64::from(*value)))
}

/// Relative mean squared error.
fn error(frame: &Frame, reference: &Frame) -> f64 {
    let floor = EPSILON * brightness(reference).powi(2);
    let squares = channels(frame).zip(channels(reference)).map(|(a, b)| (a - b).powi(2) / (b * b + floor));
    squares.sum::<f64>() / channels(reference).count() as f64
}

fn brightness(frame: &Frame) -> f64 {
    channels(frame).sum::<f64>() / channels(frame).count() as f64
}
