//! The environment behind all openings: a smooth sky and a small sun.

use core::f64::consts::FRAC_PI_4;

use fanlight::{Environment, Filter};
use glam::{DVec2, DVec3};

const SIZE: usize = 1024;
const SUN: f64 = 20_000.0;
/// Directions per axis of a sun texel that stand for it in the oracle.
const SUN_SAMPLES: usize = 16;

/// Solid angle that each of these directions stands for.
pub(crate) const SUN_SAMPLE_SOLID_ANGLE: f64 = 16.0 * FRAC_PI_4 / ((SIZE * SUN_SAMPLES) * (SIZE * SUN_SAMPLES)) as f64;

/// The environment as the crate has it, and what oracles know about it.
#[derive(Clone, Debug)]
pub(crate) struct Sky {
    /// Texels of the equal-area image, the row at `y = 0` first.
    pub(crate) texels: Vec<f32>,
    pub(crate) environment: Environment,
    /// Directions that fill the sun's texels, and the radiance over that of the smooth sky, times solid angle.
    pub(crate) sun: Vec<(DVec3, f64)>,
}

impl Sky {
    /// The sky of the workloads.
    pub(crate) fn new() -> Self {
        Self::with_sun(is_sun)
    }

    /// Returns the sky of the workloads without its sun.
    pub(crate) fn without_sun() -> Self {
        Self::with_sun(|_| false)
    }

    fn with_sun(is_sun: impl Fn(DVec3) -> bool) -> Self {
        let center = |i: usize| (i as f64 + 0.5) / SIZE as f64;
        let direction = |k: usize| square_to_sphere(DVec2::new(center(k % SIZE), center(k / SIZE)));
        let radiance = |d: DVec3| if is_sun(d) { SUN } else { smooth(d.z) };
        let texels: Vec<f32> = (0..SIZE * SIZE).map(|k| radiance(direction(k)) as f32).collect();
        let environment = environment(&texels);
        let sun = (0..SIZE * SIZE).filter(|&k| texels[k] == SUN as f32).flat_map(sun_samples).collect();
        Self { texels, environment, sun }
    }

    /// The texel that a direction falls into.
    pub(crate) fn texel(&self, direction: DVec3) -> f64 {
        let at = sphere_to_square(direction) * SIZE as f64;
        let index = |x: f64| (x as usize).min(SIZE - 1);
        f64::from(self.texels[index(at.y) * SIZE + index(at.x)])
    }
}

/// The environment with these texels.
pub(crate) fn environment(texels: &[f32]) -> Environment {
    Environment::from_equal_area(SIZE, texels, Filter::Nearest).expect("the sky is finite")
}

/// Radiance of the sky without the sun, by the height of a unit direction.
pub(crate) fn smooth(z: f64) -> f64 {
    0.2 + 0.8 * z.max(0.0)
}

fn is_sun(direction: DVec3) -> bool {
    let axis = DVec3::new(0.3, 0.8, 0.5).normalize();
    direction.dot(axis) > 0.5_f64.to_radians().cos()
}

fn sun_samples(texel: usize) -> impl Iterator<Item = (DVec3, f64)> {
    (0..SUN_SAMPLES * SUN_SAMPLES).map(move |k| {
        let place = |texel: usize, k: usize| (texel as f64 + (k as f64 + 0.5) / SUN_SAMPLES as f64) / SIZE as f64;
        let at = DVec2::new(place(texel % SIZE, k % SUN_SAMPLES), place(texel / SIZE, k / SUN_SAMPLES));
        let direction = square_to_sphere(at);
        (direction, (SUN - smooth(direction.z)) * SUN_SAMPLE_SOLID_ANGLE)
    })
}

/// Clarberg 2008, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD", oriented as in pbrt-v4.
pub(crate) fn square_to_sphere(point: DVec2) -> DVec3 {
    let at = 2.0 * point - 1.0;
    let (u, v) = (at.x.abs(), at.y.abs());
    let signed_distance = 1.0 - (u + v);
    let r = 1.0 - signed_distance.abs();
    let phi = if r == 0.0 { FRAC_PI_4 } else { ((v - u) / r + 1.0) * FRAC_PI_4 };
    let z = (1.0 - r * r).copysign(signed_distance);
    let radius = r * (2.0 - r * r).max(0.0).sqrt();
    DVec3::new((radius * phi.cos()).copysign(at.x), (radius * phi.sin()).copysign(at.y), z)
}

/// The inverse of [`square_to_sphere`].
pub(crate) fn sphere_to_square(direction: DVec3) -> DVec2 {
    let d = direction.abs();
    let r = (1.0 - d.z).max(0.0).sqrt();
    let phi = if d.x == 0.0 && d.y == 0.0 { 0.0 } else { d.y.atan2(d.x) / (2.0 * FRAC_PI_4) };
    let (mut u, mut v) = (r - phi * r, phi * r);
    if direction.z < 0.0 {
        (u, v) = (1.0 - v, 1.0 - u);
    }
    DVec2::new(0.5 + 0.5 * u.copysign(direction.x), 0.5 + 0.5 * v.copysign(direction.y))
}
