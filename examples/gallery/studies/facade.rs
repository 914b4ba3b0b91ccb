//! Ten thousand windows: what they cost against a single one, and what remains of the gain with a sun behind them.

use core::hint::black_box;
use std::time::Instant;

use glam::{Vec3, vec3};

use super::without_and_with;
use crate::render::{Daylight, Error, Illumination, Lights, Model, Random};
use crate::report::{Comparison, Effort};
use crate::scenes::{facade, overcast_facade};

/// Points that are timed.
const POINTS: u32 = 20_000;

pub(super) fn study(model: &Model, effort: Effort) -> Result<Comparison, Error> {
    println!("\nµs for a direction and its density from a point of the floor, on one thread:");
    println!("{:12} {:>12} {:>12}", "windows", "overcast", "sun");
    for rows in [1, 10, 100] {
        let clouds = microseconds(&overcast_facade(rows))?;
        let sun = microseconds(&facade(rows, Daylight::new().draw()))?;
        println!("{:12} {clouds:>12.2} {sun:>12.2}", rows * rows);
    }
    let sunny = Model { camera: model.camera, ..facade(100, Daylight::new().draw()) };
    without_and_with("facade in the sun", &sunny, &[1], effort)?;
    without_and_with("facade", model, &[3, 1], effort)
}

fn microseconds(model: &Model) -> Result<f64, Error> {
    let lights = Lights::new(model, Illumination::default())?;
    let mut random = Random::new(0, 1);
    let start = Instant::now();
    for _ in 0..POINTS {
        let [x, z] = random.take();
        let position = vec3(2.0 + 25.0 * x, 1e-4, 1.0 + 18.0 * z);
        black_box(lights.propose(position, Vec3::Y, random.take()));
    }
    Ok(start.elapsed().as_secs_f64() * 1e6 / f64::from(POINTS))
}
