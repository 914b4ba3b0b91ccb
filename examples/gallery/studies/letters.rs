//! Photons that fall on the floor through letters: how many get there, and how evenly.

use std::time::Instant;

use glam::{Vec3, vec3};
use rayon::prelude::*;

use super::emission::{Emitter, Source, Way};
use super::without_and_with;
use crate::render::{Error, Image, Model, Random, Reference, World};
use crate::report::{Comparison, Effort};

/// Photons of one picture.
const PHOTONS: u32 = 100_000;
/// And how many times as many make the reference.
const REFERENCE_FACTOR: u32 = 64;
/// Photons that are traced in one piece.
const PIECE: u32 = 5_000;
/// The floor, in metres along z and x, and its cells.
const FLOOR: [f32; 2] = [6.0, 5.0];
const CELLS: [usize; 2] = [192, 160];

pub(super) fn study(model: &Model, effort: Effort) -> Result<Comparison, Error> {
    let world = World::new(model);
    without_and_with("letters, paths", model, &[1], effort)?;

    println!("\nletters, {PHOTONS} photons");
    println!("{:34} {:>9} {:>14} {:>12} {:>12} {:>10}", "", "through", "through / s", "flux", "relMSE", "gain");
    let sources = [
        ("sky with sun", Source::Sky),
        ("sun", Source::Distant(vec3(-0.813_797_7, 0.5, 0.296_198_1))),
        ("point", Source::Point(vec3(-2.0, 2.6, 3.0))),
    ];
    let mut last = Err("no source of light".into());
    for (name, source) in sources {
        last = Ok(study_source(name, &Emitter::new(model, source)?, &world, effort.seed)?);
    }
    last
}

fn study_source(name: &str, emitter: &Emitter<'_>, world: &World, seed: u32) -> Result<Comparison, Error> {
    let guided = emitter.guided();
    let fall = |way: &Way<'_>, numbers, seed, count| Fall::trace(emitter, way, world, numbers, seed, count);
    let unguided = fall(&Way::Unguided, Numbers::Independent, seed, PHOTONS);
    let independent = fall(&guided, Numbers::Independent, seed, PHOTONS);
    let stratified = fall(&guided, Numbers::Stratified, seed, PHOTONS);
    let reference = fall(&guided, Numbers::Independent, !seed, REFERENCE_FACTOR * PHOTONS);
    let reference = Reference::exact(reference.image());

    let rows = [("unguided", &unguided), ("guided", &independent), ("guided, stratified", &stratified)];
    for (way, fall) in rows {
        let rate = |fall: &Fall| f64::from(fall.through) / fall.seconds;
        println!(
            "{:34} {:>8.2}% {:>14.3e} {:>12.4e} {:>12.3e} {:>10.1}",
            format!("{name}, {way}"),
            100.0 * f64::from(fall.through) / f64::from(fall.photons),
            rate(fall),
            fall.flux(),
            reference.rel_mse(&fall.image()),
            rate(fall) / rate(&unguided),
        );
    }
    let seen = Image::black(CELLS[0], CELLS[1]);
    Ok(Comparison { images: vec![unguided.image(), stratified.image()], reference, seen })
}

/// Where random numbers come from.
#[derive(Clone, Copy)]
enum Numbers {
    Independent,
    /// Roberts' additive recurrence in five dimensions, shifted at random.
    Stratified,
}

impl Numbers {
    fn of(self, seed: u32, i: u32) -> [f32; 5] {
        match self {
            Self::Independent => Random::new(u64::from(seed), u64::from(i)).take(),
            Self::Stratified => {
                let shift: [f32; 5] = Random::new(u64::from(seed), 0).take();
                // The root of x⁶ = x + 1.
                const ROOT: f64 = 1.134_724_138_401_519_4;
                core::array::from_fn(|d| {
                    let step = ROOT.powi(-(d as i32 + 1));
                    ((f64::from(shift[d]) + step * f64::from(i)).fract() as f32).min(1.0 - f32::EPSILON)
                })
            }
        }
    }
}

/// Photons that fell on the floor.
struct Fall {
    photons: u32,
    /// How many got there.
    through: u32,
    seconds: f64,
    /// Power by cell.
    power: Vec<f64>,
}

impl Fall {
    fn trace(emitter: &Emitter<'_>, way: &Way<'_>, world: &World, numbers: Numbers, seed: u32, photons: u32) -> Self {
        let start = Instant::now();
        let nothing = || (0, vec![0.0; CELLS[0] * CELLS[1]]);
        let (through, power) = (0..photons.div_ceil(PIECE))
            .into_par_iter()
            .fold(nothing, |(mut through, mut power), piece| {
                for i in PIECE * piece..photons.min(PIECE * (piece + 1)) {
                    let Some(photon) = emitter.photon(way, numbers.of(seed, i)) else { continue };
                    if let Some(cell) = floor_cell(world, photon.origin, photon.direction) {
                        through += 1;
                        power[cell] += f64::from(photon.power);
                    }
                }
                (through, power)
            })
            .reduce(nothing, |(a, mut sum), (b, power)| {
                sum.iter_mut().zip(power).for_each(|(sum, power)| *sum += power);
                (a + b, sum)
            });
        Self { photons, through, seconds: start.elapsed().as_secs_f64(), power }
    }

    /// Power on the floor.
    fn flux(&self) -> f64 {
        self.power.iter().sum::<f64>() / f64::from(self.photons)
    }

    /// Irradiance of the floor's cells: the density of the photons' power.
    fn image(&self) -> Image {
        let area = f64::from(FLOOR[0] * FLOOR[1]) / self.power.len() as f64;
        let scale = 1.0 / (f64::from(self.photons) * area);
        let pixels = self.power.iter().map(|power| Vec3::splat((power * scale) as f32)).collect();
        Image { width: CELLS[0], height: CELLS[1], pixels }
    }
}

/// The cell of the floor that a ray falls into, if it meets nothing else. The letters stand upright.
fn floor_cell(world: &World, origin: Vec3, direction: Vec3) -> Option<usize> {
    let start = origin + 2.0 * world.scene.offset() * direction;
    let point = world.trace(start, direction).1?;
    if point.normal.y < 0.9 || point.position.y > 0.01 {
        return None;
    }
    let place = [1.0 - point.position.z / FLOOR[0], point.position.x / FLOOR[1]];
    let index = |i: usize| ((place[i].max(0.0) * CELLS[i] as f32) as usize).min(CELLS[i] - 1);
    Some(index(1) * CELLS[0] + index(0))
}
