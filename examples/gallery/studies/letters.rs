//! Photons that fall on the floor through letters: how many get there, and how evenly.

use std::sync::LazyLock;
use std::time::Instant;

use glam::{Vec3, vec3};
use rayon::prelude::*;

use super::emission::{Emitter, Source, Way};
use super::without_and_with;
use crate::render::{Error, Image, Model, Point, Random, Reference, World};
use crate::report::{Comparison, Effort};

/// Photons of one picture.
const PHOTONS: u32 = 100_000;
/// How many times as many photons make the reference.
const REFERENCE_FACTOR: u32 = 64;
/// How many times as many are timed.
const TIMED_FACTOR: u32 = 16;
/// Photons that are traced in one piece.
const PIECE: u32 = 5_000;
/// The floor, in meters along z and x, and its cells.
const FLOOR: [f32; 2] = [6.0, 5.0];
const CELLS: [usize; 2] = [192, 160];
/// Height of the room.
const CEILING: f32 = 3.0;

pub(super) fn study(model: &Model, effort: Effort) -> Result<Comparison, Error> {
    let world = World::new(model);
    without_and_with("letters, paths", model, &[1], effort)?;

    println!("\nletters, {PHOTONS} photons");
    println!("{:34} {:>9} {:>14} {:>12} {:>12} {:>10}", "", "through", "through / s", "flux", "error", "gain");
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
    let guided = || emitter.guided();
    let fall = |way: &MakeWay<'_>, numbers, seed, count| Fall::trace(emitter, way, world, numbers, seed, count);
    let unguided = fall(&|| Way::Unguided, Numbers::Independent, seed, PHOTONS);
    let independent = fall(&guided, Numbers::Independent, seed, PHOTONS);
    let stratified = fall(&guided, Numbers::Stratified, seed, PHOTONS);
    let reference = fall(&guided, Numbers::Independent, !seed, REFERENCE_FACTOR * PHOTONS);
    let reference = Reference::exact(reference.image());

    // Long enough to be timed.
    let rate = |way: &MakeWay<'_>, numbers| fall(way, numbers, seed, TIMED_FACTOR * PHOTONS).rate();
    let unguided_rate = rate(&|| Way::Unguided, Numbers::Independent);
    let rows = [
        ("unguided", &unguided, unguided_rate),
        ("guided", &independent, rate(&guided, Numbers::Independent)),
        ("guided, stratified", &stratified, rate(&guided, Numbers::Stratified)),
    ];
    for (way, fall, rate) in rows {
        println!(
            "{:34} {:>8.2}% {:>14.3e} {:>12.4e} {:>12.3e} {:>10.1}",
            format!("{name}, {way}"),
            100.0 * f64::from(fall.through) / f64::from(fall.photons),
            rate,
            fall.flux(),
            error(&fall.image(), reference.image()),
            rate / unguided_rate,
        );
    }
    let seen = Image::black(CELLS[0], CELLS[1]);
    Ok(Comparison { images: vec![unguided.image(), stratified.image()], shown: [0, 1], reference, seen })
}

/// Squared error over the sum of squares: of the letters, and not of the dark around them.
fn error(image: &Image, reference: &Image) -> f64 {
    let squares = |image: &Image| image.pixels.iter().map(|pixel| f64::from(pixel.x).powi(2)).sum::<f64>();
    let pixels = image.pixels.iter().zip(&reference.pixels).map(|(a, b)| a - b).collect();
    squares(&Image { pixels, ..*image }) / squares(reference)
}

/// Where random numbers come from.
#[derive(Clone, Copy)]
enum Numbers {
    Independent,
    /// Sobol' sequence in five dimensions, shifted at random.
    Stratified,
}

impl Numbers {
    fn of(self, seed: u32, i: u32) -> [f32; 5] {
        match self {
            Self::Independent => Random::new(u64::from(seed), u64::from(i)).take(),
            Self::Stratified => {
                let shift: [f32; 5] = Random::new(u64::from(seed), 0).take();
                // The best pair is for the place on the portal.
                let dimensions = [2, 0, 1, 3, 4];
                core::array::from_fn(|d| {
                    let bits = sobol(i, dimensions[d]) >> 8 ^ (shift[d] * (1 << 24) as f32) as u32;
                    bits as f32 / (1 << 24) as f32
                })
            }
        }
    }
}

/// One dimension of Sobol's sequence.
fn sobol(i: u32, dimension: usize) -> u32 {
    let directions = &SOBOL[dimension];
    (0..32).filter(|k| i >> k & 1 == 1).fold(0, |bits, k| bits ^ directions[k])
}

/// Its direction numbers. Degrees, polynomials and first numbers are those of Joe and Kuo (2008).
static SOBOL: LazyLock<[[u32; 32]; 5]> = LazyLock::new(|| {
    const TABLE: [(usize, u32, [u32; 3]); 4] =
        [(1, 0, [1, 0, 0]), (2, 1, [1, 3, 0]), (3, 1, [1, 3, 1]), (3, 2, [1, 1, 1])];
    core::array::from_fn(|dimension| {
        let mut directions = core::array::from_fn(|k| 1 << (31 - k));
        let Some((degree, polynomial, first)) = dimension.checked_sub(1).map(|row| TABLE[row]) else {
            return directions;
        };
        for k in 0..32 {
            directions[k] = if k < degree {
                first[k] << (31 - k)
            } else {
                let before: u32 = directions[k - degree];
                (1..degree)
                    .filter(|j| polynomial >> (degree - 1 - j) & 1 == 1)
                    .fold(before ^ before >> degree, |bits, j| bits ^ directions[k - j])
            };
        }
        directions
    })
});

/// Makes a way for each piece of work: what is found out about one point belongs to one thread.
type MakeWay<'a> = dyn Fn() -> Way<'a> + Sync + 'a;

/// Photons that fell on the floor.
struct Fall {
    photons: u32,
    /// How many got through the letters.
    through: u32,
    seconds: f64,
    /// Power by cell.
    power: Vec<f64>,
}

impl Fall {
    fn trace(
        emitter: &Emitter<'_>,
        way: &MakeWay<'_>,
        world: &World,
        numbers: Numbers,
        seed: u32,
        photons: u32,
    ) -> Self {
        let start = Instant::now();
        let nothing = || (0, vec![0.0; CELLS[0] * CELLS[1]]);
        let (through, power) = (0..photons.div_ceil(PIECE))
            .into_par_iter()
            .fold(nothing, |(mut through, mut power), piece| {
                let way = way();
                for i in PIECE * piece..photons.min(PIECE * (piece + 1)) {
                    let Some(photon) = emitter.photon(&way, numbers.of(seed, i)) else { continue };
                    let start = photon.origin + 2.0 * world.scene.offset() * photon.direction;
                    let Some(point) = world.trace(start, photon.direction).1 else { continue };
                    through += u32::from(is_inside(&point));
                    if let Some(cell) = floor_cell(&point) {
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

    /// Photons through the letters per second.
    fn rate(&self) -> f64 {
        f64::from(self.through) / self.seconds
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

/// Whether a photon that ended here has passed the wall with the letters.
fn is_inside(point: &Point) -> bool {
    let [z, x] = FLOOR;
    point.position.cmpgt(Vec3::ZERO).all() && point.position.cmplt(vec3(x, CEILING, z)).all()
}

/// The cell of the floor that a point is in, as letters stand upright.
fn floor_cell(point: &Point) -> Option<usize> {
    if point.normal.y < 0.9 || point.position.y > 0.01 {
        return None;
    }
    let place = [1.0 - point.position.z / FLOOR[0], point.position.x / FLOOR[1]];
    let index = |i: usize| ((place[i].max(0.0) * CELLS[i] as f32) as usize).min(CELLS[i] - 1);
    Some(index(1) * CELLS[0] + index(0))
}
