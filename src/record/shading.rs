//! The point at which light is gathered.

use glam::Vec3;

/// How a direction is weighted at a shading point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Receiver {
    /// An opaque surface with this unit normal: `max(0, cos θ)`.
    Surface(Vec3),
    /// A surface that also passes light through, with this unit normal: `|cos θ|`.
    Transmissive(Vec3),
    /// A point in a medium: every direction counts the same.
    Volume,
}

/// A position, and how a direction is weighted there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadingPoint {
    /// World position. Nothing arrives at one with a coordinate that is not finite, or above 1e15.
    pub position: Vec3,
    /// Weight of a direction at this point.
    pub receiver: Receiver,
}

impl ShadingPoint {
    /// A point on an opaque surface. `normal` is a unit vector to the side that light is gathered from.
    pub const fn surface(position: Vec3, normal: Vec3) -> Self {
        Self { position, receiver: Receiver::Surface(normal) }
    }

    /// A point on a surface that gathers light from both sides. `normal` is a unit vector.
    pub const fn transmissive(position: Vec3, normal: Vec3) -> Self {
        Self { position, receiver: Receiver::Transmissive(normal) }
    }

    /// A point in a participating medium.
    pub const fn volume(position: Vec3) -> Self {
        Self { position, receiver: Receiver::Volume }
    }

    /// Weight of a unit direction that points away from this point: clamped, absolute or no cosine.
    pub fn cosine(&self, direction: Vec3) -> f32 {
        match self.receiver {
            Receiver::Surface(normal) => normal.dot(direction).max(0.0),
            Receiver::Transmissive(normal) => normal.dot(direction).abs(),
            Receiver::Volume => 1.0,
        }
    }
}
