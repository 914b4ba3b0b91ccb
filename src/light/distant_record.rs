//! Distant lights and their groups as buffers hold them.

use bytemuck::{Pod, Zeroable};

/// A distant light that can send something.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct DistantRecord {
    /// Unit vector in which light travels.
    pub(super) axis: [f32; 3],
    /// On a surface that faces the light.
    pub(super) irradiance: f32,
    /// Angular radius; zero without an extent.
    pub(super) radius: f32,
    /// Number among all lights that are not made of triangles.
    pub(super) number: u32,
    /// Light groups.
    pub(crate) groups: u32,
}

const _: () = assert!(size_of::<DistantRecord>() == 28);

/// Neighbors in direction.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct DistantGroup {
    /// Unit vector to the middle of the lights.
    pub(super) axis: [f32; 3],
    /// Sine of the angle to the farthest direction of any of them; 2 for more than a right angle.
    pub(super) sin_reach: f32,
    /// Sum of the irradiances.
    pub(super) irradiance: f32,
    pub(super) first: u32,
    pub(super) count: u32,
    /// Light groups that any of the lights is in.
    pub(crate) groups: u32,
}

const _: () = assert!(size_of::<DistantGroup>() == 32);
