//! The integrator: paths with direct light at each vertex. All techniques that find the same light are weighted by the
//! balance heuristic (Veach and Guibas 1995): with one sample of each, that is what arrives over the sum of densities.

use glam::Vec3;

use super::lighting::{Aim, Proposal};
use super::photon::{Photon, PhotonTracer};
pub(crate) use super::random::Random;
use super::scene::Point;
use super::technique::{ChoiceAt, Techniques};
use super::vertex::{Place, Vertex};
use super::world::World;

/// How many offsets of rays apart two points may be that are the same one.
const SAME: f32 = 20.0;

/// Estimates the radiance that arrives along a ray after being scattered, or, for no bounces at all, without.
pub(crate) struct PathTracer<'a> {
    world: &'a World,
    techniques: &'a Techniques,
    /// How many surfaces light may touch on its way: 1 for direct light alone, 0 for lights as they are seen.
    bounces: u32,
    /// Traces light in the other direction, where that is of use.
    photons: Option<PhotonTracer<'a>>,
}

impl<'a> PathTracer<'a> {
    /// An integrator for paths of up to the given number of bounces.
    pub(crate) fn new(world: &'a World, techniques: &'a Techniques, bounces: u32) -> Self {
        let photons = (techniques.photons && bounces > 1).then(|| PhotonTracer::new(world, &techniques.lights));
        Self { world, techniques, bounces, photons }
    }

    /// One path that starts along a ray.
    pub(crate) fn radiance(&self, origin: Vec3, direction: Vec3, random: &mut Random) -> Vec3 {
        let (passed, end) = self.world.trace(origin, direction);
        if self.bounces == 0 {
            return passed * self.world.light(end.as_ref(), direction);
        }
        let distance = end.map_or(f32::INFINITY, |end| end.distance);
        let scattered = self.scattered_by_fog(origin, direction, distance, random);
        match end {
            Some(first) => scattered + passed * self.reflected(first, direction, random),
            None => scattered,
        }
    }

    /// Light that a surface reflects to where a ray that goes in a direction came from.
    fn reflected(&self, first: Point, direction: Vec3, random: &mut Random) -> Vec3 {
        let photon = self.photons.as_ref().and_then(|photons| photons.trace(random.take()));
        let (mut radiance, mut throughput) = (Vec3::ZERO, Vec3::ONE);
        let (mut point, mut direction, mut arrival) = (first, direction, None);
        for bounce in 1..=self.bounces {
            let x = self.vertex(point, direction, bounce, arrival);
            radiance += throughput * self.by_light_samples(&x, random);
            if let Some(photon) = photon.as_ref().filter(|_| bounce < self.bounces) {
                radiance += throughput * self.by_photon(&x, photon, bounce + 1);
            }
            let Some((scattered, value)) = x.scatter(random) else { break };
            let (passed, end) = self.world.trace(x.start(scattered), scattered);
            throughput *= value * passed;
            let light = self.world.light(end.as_ref(), scattered);
            if light != Vec3::ZERO && !matches!(x.lights, ChoiceAt::Single(_)) {
                radiance += throughput * light / self.density(&x, scattered, end.as_ref(), None);
            }
            let Some(next) = end else { break };
            let pdf = x.pdf(scattered);
            throughput /= pdf;
            let per_area = pdf * next.normal.dot(scattered).abs() / (next.distance * next.distance);
            (point, direction, arrival) = (next, scattered, self.photons.is_some().then_some(per_area));
        }
        radiance
    }

    /// Light that fog scatters once to the start of a ray, somewhere along it.
    fn scattered_by_fog(&self, origin: Vec3, direction: Vec3, distance: f32, random: &mut Random) -> Vec3 {
        let Some(fog) = self.world.fog else { return Vec3::ZERO };
        let [enter, leave] = fog.span(origin, direction, distance);
        // By the lights, or in proportion to the fog that is seen through the fog before it.
        let share = 1.0 - (-fog.density * (leave - enter)).exp();
        let (start, u) = (origin + enter * direction, random.one());
        let (distance, weight) = match self.techniques.distance_in_fog(start, direction, leave - enter, fog.density, u)
        {
            Some((beyond, pdf)) => (enter + beyond, fog.density * (-fog.density * beyond).exp() / pdf),
            None => (enter - (1.0 - u * share).ln() / fog.density, share),
        };
        let position = origin + distance * direction;
        let lights = self.techniques.lights_in_fog(position);
        let x = Vertex { place: Place::Fog(position), lights, guide: None, arrival: None };
        weight * (self.by_light_samples(&x, random) + self.by_phase_sample(&x, random))
    }

    /// The vertex of that number, at a point that a ray of that direction has met.
    fn vertex(&self, point: Point, direction: Vec3, number: u32, arrival: Option<f32>) -> Vertex<'a> {
        let bsdf = self.world.bsdf(&point, direction);
        let lights = if bsdf.is_black() { ChoiceAt::None } else { self.techniques.lights_at(&point, &bsdf, number) };
        let guide = self.techniques.guide_at(&point, &bsdf);
        Vertex { place: Place::Surface(point, bsdf), lights, guide, arrival }
    }

    /// Direct light by one direction of each light sampler.
    fn by_light_samples(&self, x: &Vertex<'_>, random: &mut Random) -> Vec3 {
        let mut radiance = Vec3::ZERO;
        if self.samples_environment()
            && let Some(proposal) = self.techniques.lights.sample_environment(random.take())
        {
            radiance += self.along(x, &proposal, true);
        }
        if let Some(proposal) = x.lights.sample(random.take()) {
            radiance += self.along(x, &proposal, false);
        }
        radiance
    }

    /// Direct light along a direction that the environment or the lights proposed.
    fn along(&self, x: &Vertex<'_>, proposal: &Proposal, by_environment: bool) -> Vec3 {
        let &Proposal { direction, pdf, aim } = proposal;
        let value = x.value(direction);
        if value == Vec3::ZERO {
            return value;
        }
        let start = x.start(direction);
        let arrival = match aim {
            Aim::Lamp(lamp) => return value * self.world.arriving_from_lamp(lamp, start) / pdf,
            Aim::Sky => self.world.arriving_from_sky(start, direction),
            Aim::Any | Aim::Point(_) => self.world.arriving(start, direction),
        };
        // Another point of an emitter may be in front of the one that was drawn, or the ray may miss that one.
        let other = match (aim, arrival.from) {
            (Aim::Point(drawn), Some(met)) => {
                (x.position() + drawn * direction).distance(met.position) > SAME * self.world.scene.offset()
            }
            (Aim::Point(_), None) => true,
            _ => false,
        };
        if arrival.radiance == Vec3::ZERO || other {
            return Vec3::ZERO;
        }
        let lights_pdf = (!by_environment).then_some(pdf);
        value * arrival.radiance / self.density(x, direction, arrival.from.as_ref(), lights_pdf)
    }

    /// Direct light along a direction that fog scatters to.
    fn by_phase_sample(&self, x: &Vertex<'_>, random: &mut Random) -> Vec3 {
        let Some((direction, value)) = x.scatter(random) else { return Vec3::ZERO };
        let arrival = self.world.arriving(x.start(direction), direction);
        if arrival.radiance == Vec3::ZERO {
            return Vec3::ZERO;
        }
        value * arrival.radiance / self.density(x, direction, arrival.from.as_ref(), None)
    }

    /// Light that a photon's surface, the path's vertex of that number, sends to `x`, and `x` to where the path came
    /// from.
    fn by_photon(&self, x: &Vertex<'_>, photon: &Photon, number: u32) -> Vec3 {
        let step = photon.at.position - x.position();
        let distance2 = step.length_squared();
        let direction = step / distance2.sqrt();
        let value = x.value(direction);
        if value == Vec3::ZERO {
            return value;
        }
        let at = photon.at.facing(direction);
        let y = self.vertex(at, direction, number, None);
        let reflected = y.value(photon.direction);
        if reflected == Vec3::ZERO {
            return reflected;
        }
        let passed = self.world.passes(x.start(direction), at.position);
        if passed == Vec3::ZERO {
            return passed;
        }
        // A path could have found this light by a step from `x` to the surface, and a look from there to the light.
        let geometry = at.normal.dot(direction).abs() / distance2;
        let by_path = x.pdf(direction) * geometry * self.density(&y, photon.direction, photon.from.as_ref(), None);
        value * passed * geometry * reflected * photon.radiance / (photon.pdf + by_path)
    }

    /// Whether directions to the bright parts of the sky are a technique of their own.
    fn samples_environment(&self) -> bool {
        self.techniques.environment && self.world.has_sky()
    }

    /// Density per solid angle with which all techniques together find the light from a direction: that of an
    /// emitter's point, or that of the sky. `lights_pdf` is the light sampler's part of it, if it is known.
    fn density(&self, x: &Vertex<'_>, direction: Vec3, from: Option<&Point>, lights_pdf: Option<f32>) -> f32 {
        let lights_pdf = lights_pdf.unwrap_or_else(|| x.lights.pdf(direction, from));
        if matches!(x.lights, ChoiceAt::Single(_)) {
            return lights_pdf;
        }
        let environment_pdf = match from {
            None if self.samples_environment() => self.techniques.lights.environment_pdf(direction),
            _ => 0.0,
        };
        let photon_pdf = match (&self.photons, x.arrival, &x.place) {
            (Some(photons), Some(arrival), Place::Surface(point, _)) => photons.pdf(point, direction, from) / arrival,
            _ => 0.0,
        };
        x.pdf(direction) + environment_pdf + lights_pdf + photon_pdf
    }
}
