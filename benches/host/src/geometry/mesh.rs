//! Triangle meshes.

use glam::{Vec2, Vec3};

/// Triangles; the vertices run counter-clockwise around the front.
#[derive(Clone, Debug, Default)]
pub(crate) struct Mesh {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) indices: Vec<[u32; 3]>,
    /// Texture coordinates, one a vertex, or none at all.
    pub(crate) uvs: Vec<Vec2>,
}

impl Mesh {
    /// Returns a parallelogram of two triangles.
    pub(crate) fn quad(corners: [Vec3; 4]) -> Self {
        Self { positions: corners.to_vec(), indices: vec![[0, 1, 2], [0, 2, 3]], uvs: Vec::new() }
    }

    /// Adds the triangles of another mesh.
    pub(crate) fn append(&mut self, other: &Self) {
        let first = self.positions.len() as u32;
        self.positions.extend(&other.positions);
        self.uvs.extend(&other.uvs);
        self.indices.extend(other.indices.iter().map(|triangle| triangle.map(|i| first + i)));
    }

    /// Returns the corners of all triangles.
    pub(crate) fn triangles(&self) -> impl Iterator<Item = [Vec3; 3]> {
        self.indices.iter().map(|triangle| triangle.map(|i| self.positions[i as usize]))
    }
}
