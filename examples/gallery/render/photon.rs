//! Light that is traced from where it starts: one ray for each path, and where it lands.
//!
//! A patch of floor in the sun lights the whole room, but a path comes upon it by chance only. A ray of light that
//! comes in ends there nearly always: its end is one more vertex that the path can go on to (bidirectional path
//! tracing, Veach and Guibas 1994, with one vertex from the light).

use glam::Vec3;

use super::lighting::{Lights, Outgoing};
use super::scene::Point;
use super::world::World;

/// Where light meets a surface for the first time.
pub(crate) struct Photon {
    pub(crate) at: Point,
    /// Back to the light.
    pub(crate) direction: Vec3,
    /// The emitter that it comes from; `None` for the sky.
    pub(crate) from: Option<Point>,
    /// What arrives.
    pub(crate) radiance: Vec3,
    /// Density of having come there in this direction: per area of the surface and per solid angle.
    pub(crate) pdf: f32,
}

/// Traces light.
pub(crate) struct PhotonTracer<'a> {
    world: &'a World,
    outgoing: Outgoing<'a>,
}

impl<'a> PhotonTracer<'a> {
    pub(crate) fn new(world: &'a World, lights: &'a Lights) -> Self {
        Self { world, outgoing: lights.outgoing() }
    }

    /// Traces one ray. `None` if no light comes along it, or it meets nothing.
    pub(crate) fn trace(&self, u: [f32; 5]) -> Option<Photon> {
        let ray = self.outgoing.sample(u)?;
        let start = ray.origin + 2.0 * self.world.scene.offset() * ray.direction;
        let at = self.world.scene.trace(start, ray.direction).1?;
        let direction = -ray.direction;
        let arrival = self.world.arriving(at.position, direction);
        // Light of an emitter in front of a portal is that of rays which start at the emitter.
        if arrival.radiance == Vec3::ZERO || arrival.from.is_some() != ray.emitted {
            return None;
        }
        let pdf = self.pdf(&at, direction, arrival.from.as_ref());
        (pdf > 0.0).then_some(Photon { at, direction, from: arrival.from, radiance: arrival.radiance, pdf })
    }

    /// Density with which [`trace`](Self::trace) comes to a point from the direction of its light.
    pub(crate) fn pdf(&self, at: &Point, direction: Vec3, from: Option<&Point>) -> f32 {
        at.normal.dot(direction).abs() * self.outgoing.pdf(at.position, direction, from)
    }
}
