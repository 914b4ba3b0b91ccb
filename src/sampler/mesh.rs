//! How a host describes its lights.

use glam::{Vec2, Vec3};

use crate::error::{Error, Kind as ErrorKind};
use crate::light::POSITION_LIMIT;

/// A texture that was handed to a builder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TextureId(pub(super) usize);

/// The sides of a triangle that light leaves from. A triangle's vertices run counter-clockwise around its front.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Sides {
    /// The front alone. The front of a portal faces the room.
    #[default]
    One,
    /// Both.
    Two,
}

/// What a triangle's density is guided by: luminance of the emission of a mesh light, transmittance of a portal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Weight {
    /// The same everywhere; finite, not negative.
    Constant(f32),
    /// A texture or a [`Procedural`](crate::Procedural), seen through the mesh's texture coordinates.
    Texture(TextureId),
}

/// What a mesh does with light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Emitter,
    Portal,
}

/// A triangle mesh that sends light, borrowed from the host.
#[derive(Clone, Copy, Debug)]
pub struct Mesh<'a> {
    pub(super) kind: Kind,
    pub(super) positions: &'a [Vec3],
    pub(super) indices: &'a [[u32; 3]],
    pub(super) uvs: &'a [Vec2],
    pub(super) weight: Weight,
    pub(super) sides: Sides,
}

impl<'a> Mesh<'a> {
    /// A mesh that emits light; its weight is the luminance of the radiance, 1 until [`Self::weight`] says otherwise.
    pub const fn emitter(positions: &'a [Vec3], indices: &'a [[u32; 3]]) -> Self {
        Self::new(Kind::Emitter, positions, indices)
    }

    /// A mesh that fills an opening to the environment; its weight is the transmittance, 1 until [`Self::weight`]
    /// says otherwise.
    pub const fn portal(positions: &'a [Vec3], indices: &'a [[u32; 3]]) -> Self {
        Self::new(Kind::Portal, positions, indices)
    }

    const fn new(kind: Kind, positions: &'a [Vec3], indices: &'a [[u32; 3]]) -> Self {
        Self { kind, positions, indices, uvs: &[], weight: Weight::Constant(1.0), sides: Sides::One }
    }

    /// Sets what guides the density.
    #[must_use]
    pub const fn weight(mut self, weight: Weight) -> Self {
        self.weight = weight;
        self
    }

    /// Sets the texture coordinates, one a vertex. Needed for a textured weight only.
    #[must_use]
    pub const fn uvs(mut self, uvs: &'a [Vec2]) -> Self {
        self.uvs = uvs;
        self
    }

    /// Sets the sides that light leaves from.
    #[must_use]
    pub const fn sides(mut self, sides: Sides) -> Self {
        self.sides = sides;
        self
    }
}

/// Whether all positions are finite and small enough, and every index has one.
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

/// The mesh that holds a triangle, by the numbers at which the meshes start (and, at last, the one at which they end).
pub(super) fn mesh_of(starts: &[u32], place: u32) -> usize {
    let last = starts.len().saturating_sub(2);
    let total = starts.last().map_or(1, |&end| u64::from(end.max(1)));
    // Meshes are often of like sizes: look around the place where it would be if all were.
    let guess = ((u64::from(place) * (last as u64 + 1) / total) as usize).min(last);
    let (mut low, mut high, mut reach) = (guess, guess + 1, 1);
    while low > 0 && starts[low] > place {
        low = low.saturating_sub(reach);
        reach *= 2;
    }
    while high <= last && starts[high] <= place {
        high = (high + reach).min(last + 1);
        reach *= 2;
    }
    (low + starts[low..high].partition_point(|&start| start <= place)).saturating_sub(1)
}

#[cfg(test)]
mod tests {
    use super::mesh_of;
    use crate::testing::Pcg32;
    use alloc::vec::Vec;

    #[test]
    fn every_triangle_is_in_its_mesh() {
        let mut pcg = Pcg32::new(1, 51);
        for round in 0..200 {
            // Meshes of all sizes, and empty ones.
            let mut starts = Vec::from([0]);
            for _ in 0..1 + pcg.below(60) {
                let size = pcg.below(1 << (round % 9)) * pcg.below(2);
                starts.push(starts[starts.len() - 1] + size);
            }
            for mesh in 0..starts.len() - 1 {
                (starts[mesh]..starts[mesh + 1]).for_each(|place| assert_eq!(mesh_of(&starts, place), mesh));
            }
        }
    }
}
