//! The children of a cell in space.

use glam::Vec3;

use crate::blas::barycentric::{ARITY, CellPosition, EDGE_CELLS, POSITIONS};

/// Centers, sizes and orientations of the children of a cell, as arrays for loops over all of them.
///
/// A linear function with the values `f0`, `f1` and `f2` at the corners of the cell, and `f` at its center, has the
/// value `g = f0 + b1 (f1 - f0) + b2 (f2 - f0)` at the center of a child, and `g + scale (fk - f)` at the child's
/// corner `k`.
pub(crate) struct ChildCenters {
    /// Barycentrics of the centroids.
    pub(crate) b1: [f32; ARITY],
    pub(crate) b2: [f32; ARITY],
    /// Size relative to the cell's, negative for children that are turned.
    pub(crate) scale: [f32; ARITY],
}

pub(crate) static CHILD_CENTERS: ChildCenters = {
    let step = 1.0 / EDGE_CELLS as f32;
    let mut centers = ChildCenters { b1: [0.0; ARITY], b2: [0.0; ARITY], scale: [0.0; ARITY] };
    let mut index = 0;
    while index < ARITY {
        let CellPosition { a, inverted } = POSITIONS[index];
        let third = if inverted { 2.0 / 3.0 } else { 1.0 / 3.0 };
        centers.b1[index] = (a[1] as f32 + third) * step;
        centers.b2[index] = (a[2] as f32 + third) * step;
        centers.scale[index] = if inverted { -step } else { step };
        index += 1;
    }
    centers
};

/// For each child, the strips that it fills along the axes: its barycentrics times [`EDGE_CELLS`] lie between these
/// numbers and one more.
pub(crate) static CHILD_STRIPS: [[u8; 3]; ARITY] = {
    let mut strips = [[0; 3]; ARITY];
    let mut index = 0;
    while index < ARITY {
        let [a0, a1, a2] = POSITIONS[index].a;
        strips[index] = [a0 as u8, a1 as u8, a2 as u8];
        index += 1;
    }
    strips
};

/// Barycentrics of the children's corners in the cell, by child and corner.
static CORNER_WEIGHTS: [[[f32; 3]; 3]; ARITY] = {
    let mut weights = [[[0.0; 3]; 3]; ARITY];
    let mut index = 0;
    while index < ARITY {
        let mut k = 0;
        while k < 3 {
            weights[index][k] = corner_weights(POSITIONS[index], k);
            k += 1;
        }
        index += 1;
    }
    weights
};

/// Barycentrics of a child's corner `k` in the cell.
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

/// The corners of a child of a cell with these corners.
#[inline(always)]
pub(crate) fn child_corners(&[v0, v1, v2]: &[Vec3; 3], index: usize) -> [Vec3; 3] {
    CORNER_WEIGHTS[index].map(|[p0, p1, p2]| v0 * p0 + v1 * p1 + v2 * p2)
}

/// A linear function at the corners of a child of a cell, from its values at the cell's corners.
#[inline(always)]
pub(crate) fn child_values(&[f0, f1, f2]: &[f32; 3], index: usize) -> [f32; 3] {
    CORNER_WEIGHTS[index].map(|[p0, p1, p2]| f0 * p0 + f1 * p1 + f2 * p2)
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
            let center = corners.iter().copied().sum::<Vec3>() / 3.0;
            for index in 0..ARITY {
                let found = child_corners(&corners, index);
                let centers = &CHILD_CENTERS;
                let [v0, v1, v2] = corners;
                let child_center = v0 + (v1 - v0) * centers.b1[index] + (v2 - v0) * centers.b2[index];
                for (k, [b1, b2]) in cell.child(index).corner_barycentrics().into_iter().enumerate() {
                    let expected = vertices[0] * (1.0 - b1 - b2) + vertices[1] * b1 + vertices[2] * b2;
                    assert!(found[k].abs_diff_eq(expected, 2e-6), "{} {expected}", found[k]);
                    let from_center = child_center + (corners[k] - center) * centers.scale[index];
                    assert!(from_center.abs_diff_eq(expected, 2e-6), "{from_center} {expected}");
                    let values = child_values(&corners.map(|corner| corner.y), index);
                    assert_eq!(values[k], found[k].y);
                }
            }
            let index = (7 * step + 2) % ARITY;
            (cell, corners) = (cell.child(index), child_corners(&corners, index));
        }
        assert_eq!(cell.area(), (ARITY as f32).powi(-4));
    }
}
