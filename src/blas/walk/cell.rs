//! The children of a cell in space, side by side: linear functions at their corners and centroids.

use glam::Vec3;

use crate::blas::barycentric::{ARITY, CellPosition, EDGE_CELLS, position};

/// Where the children of a cell lie: weights of the cell's own corners.
struct ChildWeights {
    /// By corner of the child, then by corner of the cell.
    corners: [[[f32; ARITY]; 3]; 3],
    /// Weights of the centroids, by corner of the cell.
    centers: [[f32; ARITY]; 3],
}

const WEIGHTS: ChildWeights = ChildWeights::new();

/// Barycentrics of the children's centroids, by corner of the cell.
pub(super) static CENTER_WEIGHTS: [[f32; ARITY]; 3] = WEIGHTS.centers;

impl ChildWeights {
    const fn new() -> Self {
        let mut weights = Self { corners: [[[0.0; ARITY]; 3]; 3], centers: [[0.0; ARITY]; 3] };
        let mut index = 0;
        while index < ARITY {
            let mut k = 0;
            while k < 3 {
                let corner = corner_weights(position(index), k);
                let mut i = 0;
                while i < 3 {
                    weights.corners[k][i][index] = corner[i];
                    weights.centers[i][index] += corner[i] * (1.0 / 3.0);
                    i += 1;
                }
                k += 1;
            }
            index += 1;
        }
        weights
    }
}

/// Barycentrics of a child's corner `k` in the cell.
#[inline(always)]
const fn corner_weights(CellPosition { a, inverted }: CellPosition, k: usize) -> [f32; 3] {
    let step = 1.0 / EDGE_CELLS as f32;
    let mut weights = [0.0; 3];
    let mut i = 0;
    while i < 3 {
        let toward = (i == k) as u32;
        let along = if inverted { a[i] + 1 - toward } else { a[i] + toward };
        weights[i] = along as f32 * step;
        i += 1;
    }
    weights
}

/// Barycentrics of the children's corners in the cell, by child and corner.
static CORNER_WEIGHTS: [[[f32; 3]; 3]; ARITY] = {
    let mut weights = [[[0.0; 3]; 3]; ARITY];
    let mut index = 0;
    while index < ARITY {
        let mut k = 0;
        while k < 3 {
            weights[index][k] = corner_weights(position(index), k);
            k += 1;
        }
        index += 1;
    }
    weights
};

/// The corners of a child of a cell with these corners.
#[inline]
pub(crate) fn child_corners(&[v0, v1, v2]: &[Vec3; 3], index: usize) -> [Vec3; 3] {
    CORNER_WEIGHTS[index].map(|[p0, p1, p2]| v0 * p0 + v1 * p1 + v2 * p2)
}

/// Interpolates between three values.
#[inline(always)]
fn interpolate(weights: &[[f32; ARITY]; 3], [x, y, z]: [f32; 3]) -> [f32; ARITY] {
    core::array::from_fn(|i| weights[0][i] * x + weights[1][i] * y + weights[2][i] * z)
}

/// A linear function at the corners of the children of a cell, by corner, from its values at the cell's corners.
#[inline(always)]
pub(crate) fn at_corners(values: [f32; 3]) -> [[f32; ARITY]; 3] {
    let [a, b, c] = &const { WEIGHTS.corners };
    [interpolate(a, values), interpolate(b, values), interpolate(c, values)]
}

/// Centroids of the children of a cell, by coordinate.
#[inline(always)]
pub(crate) fn centers([a, b, c]: &[Vec3; 3]) -> [[f32; ARITY]; 3] {
    let center = &CENTER_WEIGHTS;
    [interpolate(center, [a.x, b.x, c.x]), interpolate(center, [a.y, b.y, c.y]), interpolate(center, [a.z, b.z, c.z])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blas::barycentric::LatticeCell;

    #[test]
    fn corners_in_space_are_those_of_the_lattice() {
        let vertices = [Vec3::new(1.0, 2.0, 3.0), Vec3::new(-2.0, 0.5, 1.0), Vec3::new(4.0, -1.0, 0.25)];
        let (mut cell, mut corners) = (LatticeCell::whole(), vertices);
        for step in 0..4 {
            for index in 0..ARITY {
                let found = child_corners(&corners, index);
                for (corner, [b1, b2]) in found.iter().zip(cell.child(index).corner_barycentrics()) {
                    let expected = vertices[0] * (1.0 - b1 - b2) + vertices[1] * b1 + vertices[2] * b2;
                    assert!(corner.abs_diff_eq(expected, 2e-6), "{corner} {expected}");
                }
            }
            let index = (7 * step + 2) % ARITY;
            (cell, corners) = (cell.child(index), child_corners(&corners, index));
        }
        assert_eq!(cell.area(), (ARITY as f32).powi(-4));
    }
}
