//! How a host describes its lights.

use glam::{Vec2, Vec3};

use super::POSITION_LIMIT;
use crate::error::{Error, ErrorKind};
use crate::receiver::ALL_GROUPS;
use crate::record::{MeshId, TextureId};

/// The sides of a triangle that light leaves from. A triangle's vertices run counter-clockwise around its front.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Sides {
    /// The front alone. The front of a portal faces the room.
    #[default]
    One,
    /// Both sides.
    Two,
}

/// What guides a triangle's density: luminance of the emission of a mesh light, transmittance of a portal.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Weight {
    /// A weight that is the same everywhere; finite, not negative.
    Constant(f32),
    /// A texture or a [`Procedural`](crate::Procedural), seen through the mesh's texture coordinates.
    Texture(TextureId),
}

/// What a mesh does with light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MeshKind {
    Emitter,
    Portal,
}

/// A triangle mesh that sends light, borrowed from the host.
#[derive(Clone, Copy)]
#[must_use]
pub struct Mesh<'a> {
    pub(super) kind: MeshKind,
    pub(super) positions: &'a [Vec3],
    /// Positions at the end of the shutter interval; `None` for a mesh that stands still.
    pub(super) end: Option<&'a [Vec3]>,
    pub(super) indices: &'a [[u32; 3]],
    pub(super) uvs: &'a [Vec2],
    pub(super) weight: Weight,
    pub(super) sides: Sides,
    pub(super) groups: u32,
}

impl core::fmt::Debug for Mesh<'_> {
    /// Shows the numbers of vertices and triangles, not the vertices.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Mesh")
            .field("kind", &self.kind)
            .field("positions", &self.positions.len())
            .field("end", &self.end.map(<[Vec3]>::len))
            .field("indices", &self.indices.len())
            .field("uvs", &self.uvs.len())
            .field("weight", &self.weight)
            .field("sides", &self.sides)
            .field("groups", &self.groups)
            .finish()
    }
}

impl<'a> Mesh<'a> {
    /// Returns a mesh that emits light. Its weight is the luminance of the radiance, 1 until [`Self::weight`] sets it.
    pub const fn emitter(positions: &'a [Vec3], indices: &'a [[u32; 3]]) -> Self {
        Self::new(MeshKind::Emitter, positions, indices)
    }

    /// Returns a mesh that fills an opening to the environment. Its weight is the transmittance, 1 until
    /// [`Self::weight`] sets it.
    pub const fn portal(positions: &'a [Vec3], indices: &'a [[u32; 3]]) -> Self {
        Self::new(MeshKind::Portal, positions, indices)
    }

    const fn new(kind: MeshKind, positions: &'a [Vec3], indices: &'a [[u32; 3]]) -> Self {
        Self {
            kind,
            positions,
            end: None,
            indices,
            uvs: &[],
            weight: Weight::Constant(1.0),
            sides: Sides::One,
            groups: ALL_GROUPS,
        }
    }

    /// Makes the vertices move while the shutter is open: from their positions at its start, the time 0, along straight
    /// lines to these at its end, the time 1, one a vertex.
    ///
    /// Samples and densities are those of the time of the shading point
    /// ([`ShadingPoint::at_time`](crate::ShadingPoint::at_time)), and exact at each. A triangle that has no area at
    /// some time sends nothing then. Texture coordinates and weights do not change.
    pub const fn moving_to(mut self, end: &'a [Vec3]) -> Self {
        self.end = Some(end);
        self
    }

    /// Sets what guides the density.
    pub const fn weight(mut self, weight: Weight) -> Self {
        self.weight = weight;
        self
    }

    /// Sets the texture coordinates, one a vertex. Only a textured weight needs them.
    pub const fn uvs(mut self, uvs: &'a [Vec2]) -> Self {
        self.uvs = uvs;
        self
    }

    /// Sets the sides that light leaves from.
    pub const fn sides(mut self, sides: Sides) -> Self {
        self.sides = sides;
        self
    }

    /// Sets the light groups that the mesh is in, a set of bits; all by default. It sends light to the points that
    /// receive any of them ([`ShadingPoint::with_groups`](crate::ShadingPoint::with_groups)). Photons leave it in any
    /// case.
    pub const fn groups(mut self, groups: u32) -> Self {
        self.groups = groups;
        self
    }
}

/// A change of a mesh that is in a sampler already.
#[derive(Clone, Copy)]
#[must_use]
pub struct MeshUpdate<'a> {
    pub(super) mesh: MeshId,
    pub(super) triangles: Option<(&'a [Vec3], &'a [[u32; 3]])>,
    /// Positions at the end of the shutter interval; `None` for a mesh that stands still.
    pub(super) end: Option<&'a [Vec3]>,
    pub(super) scale: Option<f32>,
}

impl core::fmt::Debug for MeshUpdate<'_> {
    /// Shows the number of triangles that move, not the vertices.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("MeshUpdate")
            .field("mesh", &self.mesh)
            .field("triangles", &self.triangles.map(|(_, indices)| indices.len()))
            .field("scale", &self.scale)
            .finish()
    }
}

impl<'a> MeshUpdate<'a> {
    /// Returns an update that does not change the mesh yet.
    pub const fn new(mesh: MeshId) -> Self {
        Self { mesh, triangles: None, end: None, scale: None }
    }

    /// Moves the vertices. There must be as many triangles as the mesh was added with, in the same order; they keep
    /// their texture coordinates. A mesh that was [moving](Mesh::moving_to) stands still from then on.
    pub const fn moved(mut self, positions: &'a [Vec3], indices: &'a [[u32; 3]]) -> Self {
        (self.triangles, self.end) = (Some((positions, indices)), None);
        self
    }

    /// Moves the vertices as [`Self::moved`] does, to where they are at the start of the shutter interval, and makes
    /// them move to others at its end ([`Mesh::moving_to`]).
    pub const fn moving(mut self, positions: &'a [Vec3], end: &'a [Vec3], indices: &'a [[u32; 3]]) -> Self {
        (self.triangles, self.end) = (Some((positions, indices)), Some(end));
        self
    }

    /// Multiplies the weights that the mesh was added with. 1 restores them, whatever was set before, and 0 switches
    /// the mesh off.
    pub const fn scaled(mut self, factor: f32) -> Self {
        self.scale = Some(factor);
        self
    }
}

/// Checks that there are as many positions at the end of the shutter interval as at its start, and all of them.
pub(super) fn check_end(mesh: usize, vertices: usize, end: &[Vec3]) -> Result<(), Error> {
    if end.len() != vertices {
        return Err(Error(ErrorKind::EndCount { mesh, found: end.len(), vertices }));
    }
    check_triangles(mesh, end, &[])
}

/// Checks that all positions are finite and small enough, and that every index has one.
pub(super) fn check_triangles(mesh: usize, positions: &[Vec3], indices: &[[u32; 3]]) -> Result<(), Error> {
    let in_range = |p: &Vec3| p.to_array().iter().all(|x| x.abs() <= POSITION_LIMIT);
    if let Some(vertex) = positions.iter().position(|p| !in_range(p)) {
        let value = positions[vertex].to_array();
        return Err(Error(ErrorKind::Position { mesh, vertex, value, limit: POSITION_LIMIT }));
    }
    let vertices = positions.len();
    for (triangle, indices) in indices.iter().enumerate() {
        if let Some(&index) = indices.iter().find(|index| **index as usize >= vertices) {
            return Err(Error(ErrorKind::Index { mesh, triangle, index, vertices }));
        }
    }
    Ok(())
}
