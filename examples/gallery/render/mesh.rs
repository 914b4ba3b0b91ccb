//! Triangles, and simple shapes of them.

use core::f32::consts::{PI, TAU};

use glam::{Affine3A, Vec2, Vec3, vec2};

use super::alloc::sync::Arc;

/// Triangles of one material.
#[derive(Clone, Debug, Default)]
pub(crate) struct Mesh {
    pub(crate) positions: Vec<Vec3>,
    /// One a vertex.
    pub(crate) uvs: Vec<Vec2>,
    /// Where the emission's image is read, one a vertex; empty if that is where all others are.
    pub(crate) emission_uvs: Vec<Vec2>,
    /// Multiplies the material's color, one a vertex; empty if all are white.
    pub(crate) colors: Vec<Vec3>,
    pub(crate) indices: Vec<[u32; 3]>,
    pub(crate) material: usize,
    /// Center and radius of the sphere that is passed to `fanlight` in place of these triangles, if they are a bulb.
    pub(crate) bulb: Option<(Vec3, f32)>,
    /// What all of these triangles are copies of, if they are.
    pub(crate) copies: Option<Copies>,
}

/// A mesh that stands in several places, one after the other in the mesh that holds its copies.
#[derive(Clone, Debug)]
pub(crate) struct Copies {
    /// What is copied, shared by all meshes that hold copies of it.
    pub(crate) object: Arc<Mesh>,
    /// From its coordinates to the world.
    pub(crate) places: Vec<Affine3A>,
}

impl Mesh {
    /// Nothing yet, of some material.
    pub(crate) fn of(material: usize) -> Self {
        Self { material, ..Self::default() }
    }

    /// The copy of that number, alone.
    pub(crate) fn copy(&self, number: usize) -> Self {
        let Some(Copies { object, .. }) = &self.copies else { return self.clone() };
        let (vertices, triangles) = (object.positions.len(), object.indices.len());
        let first = number * vertices;
        let indices = self.indices[number * triangles..][..triangles].iter();
        Self {
            positions: self.positions[first..][..vertices].to_vec(),
            indices: indices.map(|corners| corners.map(|i| i - first as u32)).collect(),
            copies: None,
            ..Self::clone(object)
        }
    }

    /// Where the emission's image is read, one a vertex.
    pub(crate) fn emission_uvs(&self) -> &[Vec2] {
        if self.emission_uvs.is_empty() { &self.uvs } else { &self.emission_uvs }
    }

    /// Adds a parallelogram. Its front is where `u` to `v` turns counter-clockwise.
    pub(crate) fn quad(mut self, corner: Vec3, u: Vec3, v: Vec3) -> Self {
        self.grid([1, 1], |at| corner + at.x * u + at.y * v);
        self
    }

    /// Adds an upright box that is turned about the vertical through its center.
    pub(crate) fn block(mut self, center: Vec3, size: Vec3, turn: f32) -> Self {
        let rotation = glam::Mat3::from_rotation_y(turn);
        let [x, y, z] = [Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z].map(|axis| rotation * axis);
        let low = center - 0.5 * (x + y + z);
        for (corner, u, v) in [(low, y, x), (low, z, y), (low, x, z), (low + z, x, y), (low + x, y, z), (low + y, z, x)]
        {
            self = self.quad(corner, u, v);
        }
        self
    }

    /// Adds a sphere of the given number of rings, facing outwards.
    pub(crate) fn sphere(mut self, center: Vec3, radius: f32, rings: u32) -> Self {
        self.grid([2 * rings, rings], |at| {
            let (sin_phi, cos_phi) = (TAU * at.x).sin_cos();
            let (sin_theta, cos_theta) = (PI * at.y).sin_cos();
            center - radius * Vec3::new(-sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi)
        });
        self
    }

    /// Makes a bulb: a sphere that has to be the whole mesh.
    pub(crate) fn bulb(self, center: Vec3, radius: f32, rings: u32) -> Self {
        Self { bulb: Some((center, radius)), ..self.sphere(center, radius, rings) }
    }

    /// Adds a polygon with holes that lies in the plane of `u` and `v` through `origin`; coordinates in that plane.
    pub(crate) fn polygon(mut self, [origin, u, v]: [Vec3; 3], outline: &[Vec2], holes: &[Vec<Vec2>]) -> Self {
        let points: Vec<Vec2> = outline.iter().chain(holes.iter().flatten()).copied().collect();
        let starts: Vec<u32> = holes
            .iter()
            .scan(outline.len() as u32, |next, hole| Some(core::mem::replace(next, *next + hole.len() as u32)))
            .collect();
        let mut corners: Vec<u32> = Vec::new();
        earcut::Earcut::new().earcut(points.iter().map(Vec2::to_array), &starts, &mut corners);
        let first = self.positions.len() as u32;
        self.indices.extend(corners.as_chunks::<3>().0.iter().map(|&[a, b, c]| {
            let [pa, pb, pc] = [a, b, c].map(|i| points[i as usize]);
            let front = (pb - pa).perp_dot(pc - pa) > 0.0;
            (if front { [a, b, c] } else { [a, c, b] }).map(|i| first + i)
        }));
        self.positions.extend(points.iter().map(|point| origin + point.x * u + point.y * v));
        self.uvs.extend(points);
        self
    }

    /// Adds a surface of the given columns and rows; `u` to `v` turns counter-clockwise around its front.
    pub(crate) fn grid(&mut self, [columns, rows]: [u32; 2], position: impl Fn(Vec2) -> Vec3) {
        let first = self.positions.len() as u32;
        for row in 0..=rows {
            for column in 0..=columns {
                let at = vec2(column as f32 / columns as f32, row as f32 / rows as f32);
                self.positions.push(position(at));
                self.uvs.push(at);
            }
        }
        for row in 0..rows {
            for column in 0..columns {
                let [a, b] = [row, row + 1].map(|row| first + row * (columns + 1) + column);
                self.indices.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
            }
        }
    }

    /// Turns triangles so that their fronts face a point.
    pub(crate) fn facing(mut self, point: Vec3) -> Self {
        for corners in &mut self.indices {
            let [a, b, c] = corners.map(|i| self.positions[i as usize]);
            if (b - a).cross(c - a).dot(point - a) < 0.0 {
                corners.swap(1, 2);
            }
        }
        self
    }

    /// Adds the triangles of another mesh.
    pub(crate) fn append(&mut self, other: &Self) {
        let first = self.positions.len() as u32;
        self.positions.extend(&other.positions);
        self.uvs.extend(&other.uvs);
        self.indices.extend(other.indices.iter().map(|triangle| triangle.map(|i| first + i)));
    }
}
