//! A cell of a triangle's barycentric domain, with its corners in space.

use glam::Vec3;

use super::barycentric::{self, ARITY, Place};

/// Which part of the triangle, and where its corners lie relative to the shading point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cell {
    pub(crate) domain: barycentric::Cell,
    pub(crate) vertices: [Vec3; 3],
}

impl Cell {
    /// The whole triangle.
    #[inline]
    pub(crate) fn root(vertices: [Vec3; 3]) -> Self {
        Self { domain: barycentric::Cell::root(), vertices }
    }

    /// One of the `M` cells of this one, each `1 / M` of its area.
    #[inline]
    pub(crate) fn child(&self, index: usize) -> Self {
        let r = barycentric::EDGE_CELLS;
        let Place { a, inverted } = barycentric::place(index);
        let step = 1.0 / r as f32;
        let corner = |k: usize| {
            let [p0, p1, p2] = core::array::from_fn(|i| {
                let toward = u32::from(i == k);
                let along = if inverted { a[i] + 1 - toward } else { a[i] + toward };
                along as f32 * step
            });
            let [v0, v1, v2] = self.vertices;
            v0 * p0 + v1 * p1 + v2 * p2
        };
        Self { domain: self.domain.child(index), vertices: [corner(0), corner(1), corner(2)] }
    }

    /// Share of the whole triangle's area.
    #[inline]
    pub(crate) fn share(&self) -> f32 {
        let edge = self.domain.size as f32 / barycentric::LATTICE as f32;
        edge * edge
    }
}

/// Where the parts of a cell lie, side by side: weights of the cell's own corners.
struct Weights {
    /// By corner of the part, then by corner of the cell.
    corners: [[[f32; ARITY]; 3]; 3],
    /// The centroid's, by corner of the cell.
    center: [[f32; ARITY]; 3],
}

impl Weights {
    const TABLE: Self = Self::new();

    const fn new() -> Self {
        let step = 1.0 / barycentric::EDGE_CELLS as f32;
        let mut weights = Self { corners: [[[0.0; ARITY]; 3]; 3], center: [[0.0; ARITY]; 3] };
        let mut index = 0;
        while index < ARITY {
            let Place { a, inverted } = barycentric::place(index);
            let mut i = 0;
            while i < 3 {
                let mut k = 0;
                while k < 3 {
                    let toward = (i == k) as u32;
                    let along = if inverted { a[i] + 1 - toward } else { a[i] + toward };
                    weights.corners[k][i][index] = along as f32 * step;
                    weights.center[i][index] += along as f32 * step * (1.0 / 3.0);
                    k += 1;
                }
                i += 1;
            }
            index += 1;
        }
        weights
    }
}

/// The barycentrics of the parts' centroids, by corner of the cell.
#[inline(always)]
pub(crate) fn center_weights() -> &'static [[f32; ARITY]; 3] {
    &Weights::TABLE.center
}

/// Interpolates between three values.
#[inline(always)]
fn interpolate(weights: &[[f32; ARITY]; 3], [x, y, z]: [f32; 3]) -> [f32; ARITY] {
    core::array::from_fn(|i| weights[0][i] * x + weights[1][i] * y + weights[2][i] * z)
}

/// A linear function at the corners of the parts of a cell, by corner, from its values at the cell's corners.
#[inline(always)]
pub(crate) fn at_corners(values: [f32; 3]) -> [[f32; ARITY]; 3] {
    let [a, b, c] = &Weights::TABLE.corners;
    [interpolate(a, values), interpolate(b, values), interpolate(c, values)]
}

/// Centroids of the parts of a cell, by coordinate.
#[inline(always)]
pub(crate) fn centers([a, b, c]: &[Vec3; 3]) -> [[f32; ARITY]; 3] {
    let center = &Weights::TABLE.center;
    [interpolate(center, [a.x, b.x, c.x]), interpolate(center, [a.y, b.y, c.y]), interpolate(center, [a.z, b.z, c.z])]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The corners in space are those of the exact domain.
    fn corners_agree() {
        let vertices = [Vec3::new(1.0, 2.0, 3.0), Vec3::new(-2.0, 0.5, 1.0), Vec3::new(4.0, -1.0, 0.25)];
        let mut cell = Cell::root(vertices);
        for step in 0..4 {
            for index in 0..ARITY {
                let child = cell.child(index);
                for (corner, [b1, b2]) in child.vertices.iter().zip(child.domain.corner_barycentrics()) {
                    let expected = vertices[0] * (1.0 - b1 - b2) + vertices[1] * b1 + vertices[2] * b2;
                    assert!(corner.abs_diff_eq(expected, 2e-6), "{corner} {expected}");
                }
            }
            cell = cell.child((7 * step + 2) % ARITY);
        }
        assert_eq!(cell.share(), (ARITY as f32).powi(-4));
    }

    #[test]
    fn corners_in_space_are_those_of_the_domain() {
        corners_agree();
        corners_agree();
        corners_agree();
    }
}
