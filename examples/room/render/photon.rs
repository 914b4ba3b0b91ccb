//! Light that is traced into the room: one ray through a window for each path, and where it lands.
//!
//! A patch of floor in the sun lights the whole room, but a path comes upon it by chance only. A ray of light that
//! comes in ends there nearly always: its end is one more vertex that the path can go on to (bidirectional path
//! tracing, Veach and Guibas 1994, with one vertex from the light).

use super::lighting::Incoming;
use super::scene::SurfacePoint;
use super::world::World;

/// How far a ray starts behind its window, so that it does not meet the window itself.
const OFFSET: f32 = 1e-4;

/// Where light from the sky meets a wall.
pub(crate) struct Photon {
    pub(crate) at: SurfacePoint,
    /// Back to the sky.
    pub(crate) direction: glam::Vec3,
    /// Density of having come there in this direction: per area of the wall and per solid angle.
    pub(crate) pdf: f32,
}

/// Traces light from the sky into the room.
pub(crate) struct PhotonTracer<'a> {
    world: &'a World,
    incoming: Incoming<'a>,
}

impl<'a> PhotonTracer<'a> {
    pub(crate) fn new(world: &'a World) -> Self {
        Self { world, incoming: world.lighting.incoming() }
    }

    /// Traces one ray through the windows. `None` if no light comes along it, or it meets no wall.
    pub(crate) fn trace(&self, u: [f32; 5]) -> Option<Photon> {
        let ray = self.incoming.sample(u)?;
        let at = self.world.scene.trace(ray.origin + OFFSET * ray.direction, ray.direction)?;
        let direction = -ray.direction;
        let photon = Photon { at, direction, pdf: self.pdf(&at, direction) };
        (photon.pdf > 0.0 && self.world.scene.sees_sky(at.position, direction)).then_some(photon)
    }

    /// Density with which [`trace`](Self::trace) comes to a point of a wall from a direction in which it sees the sky.
    pub(crate) fn pdf(&self, x: &SurfacePoint, direction: glam::Vec3) -> f32 {
        x.normal.dot(direction).max(0.0) * self.incoming.pdf(x.position, direction)
    }
}
