//! The integrator: paths of diffuse bounces, with direct light at each of them.

use core::f32::consts::{FRAC_1_PI, TAU};

use glam::{Vec2, Vec3};
use rand_pcg::{Pcg32, rand_core::Rng};

use super::lighting::{Portals, Proposal};
use super::scene::SurfacePoint;
use super::world::World;

/// Albedo of all walls.
const ALBEDO: f32 = 0.6;

/// Where directions to the light come from, next to those of the surface's own cosine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Strategy {
    /// The environment's bright parts.
    Environment,
    /// The environment's bright parts, and the windows.
    EnvironmentAndPortals,
}

/// Uniform random numbers in [0, 1).
pub(crate) struct Random(Pcg32);

impl Random {
    /// One of 2⁶³ independent streams.
    pub(crate) fn new(state: u64, stream: u64) -> Self {
        Self(Pcg32::new(state, stream))
    }

    /// So many numbers.
    pub(crate) fn take<const N: usize>(&mut self) -> [f32; N] {
        core::array::from_fn(|_| (self.0.next_u32() >> 8) as f32 / (1 << 24) as f32)
    }
}

/// Estimates the radiance that arrives along a ray.
pub(crate) struct PathTracer<'a> {
    pub(crate) world: &'a World,
    pub(crate) strategy: Strategy,
    /// How many walls light may touch on its way: 1 for direct light alone.
    pub(crate) bounces: u32,
}

impl PathTracer<'_> {
    /// One path that starts along a ray.
    pub(crate) fn radiance(&self, origin: Vec3, direction: Vec3, random: &mut Random) -> Vec3 {
        let Some(mut x) = self.world.scene.trace(origin, direction) else { return self.world.sky.radiance(direction) };
        let mut radiance = Vec3::ZERO;
        let mut throughput = 1.0;
        for _ in 0..self.bounces {
            let portals = self.portals_at(&x);
            radiance += throughput * self.light_by_light_samples(&x, portals.as_ref(), random);
            let direction = sample_cosine(x.normal, random.take());
            let Some(next) = self.world.scene.trace(x.position, direction) else {
                let density = cosine_pdf(x.normal, direction)
                    + self.world.lighting.environment_pdf(direction)
                    + portal_pdf(portals.as_ref(), direction);
                return radiance + throughput * self.reflected(&x, direction, density);
            };
            throughput *= ALBEDO;
            x = next;
        }
        radiance
    }

    /// The windows, if they are sampled.
    fn portals_at(&self, x: &SurfacePoint) -> Option<Portals<'_>> {
        (self.strategy == Strategy::EnvironmentAndPortals).then(|| self.world.lighting.portals_at(x))
    }

    /// Direct light by one direction of each light sampler.
    fn light_by_light_samples(&self, x: &SurfacePoint, portals: Option<&Portals<'_>>, random: &mut Random) -> Vec3 {
        let lighting = &self.world.lighting;
        let by_environment =
            self.light_along(x, lighting.sample_environment(random.take()), |direction| portal_pdf(portals, direction));
        let Some(portals) = portals else { return by_environment };
        by_environment
            + self.light_along(x, portals.sample(random.take()), |direction| lighting.environment_pdf(direction))
    }

    /// Direct light along a proposed direction, whose density under the other light sampler is `other_pdf`.
    fn light_along(&self, x: &SurfacePoint, proposal: Option<Proposal>, other_pdf: impl Fn(Vec3) -> f32) -> Vec3 {
        match proposal {
            Some(Proposal { direction, pdf })
                if x.normal.dot(direction) > 0.0 && self.world.scene.sees_sky(x.position, direction) =>
            {
                self.reflected(x, direction, cosine_pdf(x.normal, direction) + pdf + other_pdf(direction))
            }
            _ => Vec3::ZERO,
        }
    }

    /// The sky's light that is reflected at `x` from a direction, over the sum of the direction's densities under all
    /// techniques: the balance heuristic, for one sample of each.
    fn reflected(&self, x: &SurfacePoint, direction: Vec3, density: f32) -> Vec3 {
        ALBEDO * cosine_pdf(x.normal, direction) / density * self.world.sky.radiance(direction)
    }
}

/// A direction's density under portal sampling: zero where portals are not sampled.
fn portal_pdf(portals: Option<&Portals<'_>>, direction: Vec3) -> f32 {
    portals.map_or(0.0, |portals| portals.pdf(direction))
}

/// A unit direction with the density of [`cosine_pdf`].
fn sample_cosine(normal: Vec3, [u0, u1]: [f32; 2]) -> Vec3 {
    let disc = u0.sqrt() * Vec2::from_angle(TAU * u1);
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    (disc.x * tangent + disc.y * bitangent + (1.0 - u0).sqrt() * normal).normalize()
}

/// Density per solid angle of cosine-distributed directions. It is also what a diffuse surface of albedo 1 reflects.
fn cosine_pdf(normal: Vec3, direction: Vec3) -> f32 {
    normal.dot(direction).max(0.0) * FRAC_1_PI
}
