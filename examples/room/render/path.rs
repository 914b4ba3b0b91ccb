//! The integrator: paths of diffuse bounces, with direct light at each of them.

use core::f32::consts::{FRAC_1_PI, TAU};

use glam::{Vec2, Vec3};
use rand_pcg::{Pcg32, rand_core::Rng};

use super::lighting::{Portals, Proposal};
use super::photon::{Photon, PhotonTracer};
use super::scene::SurfacePoint;
use super::world::World;

/// Albedo of all walls.
const ALBEDO: f32 = 0.6;

/// Where directions to the light come from, next to those of the surface's own cosine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Strategy {
    /// The environment's bright parts.
    Environment,
    /// The environment's bright parts, and the windows: seen from the point that the camera sees, and as the way by
    /// which light comes to the points behind it.
    EnvironmentAndPortals,
}

/// Uniform random numbers in [0, 1).
pub(crate) struct Random(Pcg32);

impl Random {
    /// One of 2⁶³ independent streams.
    pub(crate) fn new(state: u64, stream: u64) -> Self {
        Self(Pcg32::new(state, stream))
    }

    /// The next `N` numbers.
    pub(crate) fn take<const N: usize>(&mut self) -> [f32; N] {
        core::array::from_fn(|_| (self.0.next_u32() >> 8) as f32 / (1 << 24) as f32)
    }
}

/// Estimates the radiance that arrives along a ray.
pub(crate) struct PathTracer<'a> {
    world: &'a World,
    strategy: Strategy,
    /// How many walls light may touch on its way: 1 for direct light alone.
    bounces: u32,
    /// Traces light in the other direction, where that is of use.
    photons: Option<PhotonTracer<'a>>,
}

/// A point of a path, and how light is sampled there.
struct Vertex<'a> {
    at: SurfacePoint,
    portals: Option<Portals<'a>>,
    /// Density per area with which the path came here from the vertex before, if the end of a light ray could have
    /// stood in its place.
    arrival: Option<f32>,
}

impl<'a> PathTracer<'a> {
    /// An integrator for paths of up to the given number of bounces.
    pub(crate) fn new(world: &'a World, strategy: Strategy, bounces: u32) -> Self {
        let photons = (strategy == Strategy::EnvironmentAndPortals && bounces > 1).then(|| PhotonTracer::new(world));
        Self { world, strategy, bounces, photons }
    }

    /// One path that starts along a ray.
    pub(crate) fn radiance(&self, origin: Vec3, direction: Vec3, random: &mut Random) -> Vec3 {
        let Some(first) = self.world.scene.trace(origin, direction) else { return self.world.sky.radiance(direction) };
        let photon = self.photons.as_ref().and_then(|photons| photons.trace(random.take()));
        let portals =
            (self.strategy == Strategy::EnvironmentAndPortals).then(|| self.world.lighting.portals_at(&first));
        let mut x = Vertex { at: first, portals, arrival: None };
        let mut radiance = Vec3::ZERO;
        let mut throughput = 1.0;
        for bounce in 1..=self.bounces {
            radiance += throughput * self.light_by_light_samples(&x, random);
            if let Some(photon) = photon.as_ref().filter(|_| bounce < self.bounces) {
                radiance += throughput * self.light_by_photon(&x.at, photon);
            }
            let direction = sample_cosine(x.at.normal, random.take());
            let Some(next) = self.world.scene.trace(x.at.position, direction) else {
                let light_pdf = self.world.lighting.environment_pdf(direction) + x.portal_pdf(direction);
                return radiance + throughput * self.reflected(&x, direction, light_pdf);
            };
            throughput *= ALBEDO;
            let arrival = self.photons.is_some().then(|| pdf_area(&x.at, &next));
            x = Vertex { at: next, portals: None, arrival };
        }
        radiance
    }

    /// Direct light by one direction of each light sampler.
    fn light_by_light_samples(&self, x: &Vertex<'_>, random: &mut Random) -> Vec3 {
        let lighting = &self.world.lighting;
        let by_environment =
            self.light_along(x, lighting.sample_environment(random.take()), |direction| x.portal_pdf(direction));
        let Some(portals) = &x.portals else { return by_environment };
        by_environment
            + self.light_along(x, portals.sample(random.take()), |direction| lighting.environment_pdf(direction))
    }

    /// Direct light along a proposed direction, whose density under the other light sampler is `other_pdf`.
    fn light_along(&self, x: &Vertex<'_>, proposal: Option<Proposal>, other_pdf: impl Fn(Vec3) -> f32) -> Vec3 {
        match proposal {
            Some(Proposal { direction, pdf })
                if x.at.normal.dot(direction) > 0.0 && self.world.scene.sees_sky(x.at.position, direction) =>
            {
                self.reflected(x, direction, pdf + other_pdf(direction))
            }
            _ => Vec3::ZERO,
        }
    }

    /// Light that a photon's wall reflects to `x`, and `x` to where the path came from.
    fn light_by_photon(&self, x: &SurfacePoint, photon: &Photon) -> Vec3 {
        let by_path = pdf_area(x, &photon.at);
        if by_path == 0.0 || !self.world.scene.sees(x.position, photon.at.position) {
            return Vec3::ZERO;
        }
        // A path could have found this light by a step from `x` to the wall, and a look from there to the sky.
        let cosine_pdf = cosine_pdf(photon.at.normal, photon.direction);
        let density = photon.pdf + by_path * (cosine_pdf + self.world.lighting.environment_pdf(photon.direction));
        let reflected_twice = ALBEDO * ALBEDO * by_path * cosine_pdf;
        reflected_twice / density * self.world.sky.radiance(photon.direction)
    }

    /// The sky's light that is reflected at `x` from a direction, over the sum of the direction's densities under all
    /// techniques: the balance heuristic, for one sample of each. `light_pdf` is that of the light samplers.
    fn reflected(&self, x: &Vertex<'_>, direction: Vec3, light_pdf: f32) -> Vec3 {
        let cosine_pdf = cosine_pdf(x.at.normal, direction);
        let photon_pdf = match (&self.photons, x.arrival) {
            (Some(photons), Some(arrival)) => photons.pdf(&x.at, direction) / arrival,
            _ => 0.0,
        };
        ALBEDO * cosine_pdf / (cosine_pdf + light_pdf + photon_pdf) * self.world.sky.radiance(direction)
    }
}

impl Vertex<'_> {
    /// A direction's density under portal sampling: zero where portals are not sampled.
    fn portal_pdf(&self, direction: Vec3) -> f32 {
        self.portals.as_ref().map_or(0.0, |portals| portals.pdf(direction))
    }
}

/// Density per area with which a cosine-distributed step goes from one point to another; zero if they face away.
fn pdf_area(from: &SurfacePoint, to: &SurfacePoint) -> f32 {
    let step = to.position - from.position;
    let distance2 = step.length_squared();
    let direction = step / distance2.sqrt();
    cosine_pdf(from.normal, direction) * (-to.normal.dot(direction)).max(0.0) / distance2
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
