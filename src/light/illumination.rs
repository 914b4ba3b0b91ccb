//! How much a small triangle of unit radiance sends to a shading point: the three terms of the talk, and a fourth
//! that is both faster and closer, as interchangeable strategies.

use core::f32::consts::FRAC_1_PI;

use glam::Vec3;

use crate::math;
use crate::receiver::{CornerHeights, Receiver, ReceiverKind};

/// Which estimate of the irradiance from a cell guides the descent inside a triangle.
///
/// Each is zero only where the whole cell lies below the horizon, so that all give unbiased sampling; they differ
/// in noise and speed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
#[repr(u32)]
pub enum Illumination {
    /// The mean of the receiver's clamped cosine at the vertices, over the squared distance of the center made larger
    /// by a part of the cell's area: an upper bound of the cosine that is exact where the cell is above the horizon.
    #[default]
    ClampedVertices,
    /// The talk's extremely conservative term, `(1 + cos θs) (1 + cos θl) / 4 π d²` at the center.
    Conservative,
    /// The form factor from point to point, `cos θs cos θl / π d²` at the center, where both cosines are clamped to
    /// at least 0.01.
    PointToPoint,
    /// Lambert's boundary integral over the part above the horizon (for volumes: the solid angle).
    Boundary,
}

/// Least cosine of the point-to-point term in a cell that is not below the horizon as a whole.
///
/// From the talk's own comparison, which this term is kept for. Zero loses light at the horizon.
const LEAST_CELL_COSINE: f32 = 0.01;

/// Share of the conservative term that the boundary integral keeps where rounding makes it vanish.
///
/// Proved necessary: in `f32` the integral of a cell seen from afar is zero. A larger share wastes samples.
const LEAST_BOUNDARY: f32 = 1e-4;

/// Share of a cell's area that is added to the squared distance of its center.
///
/// Measured (docs/ACCURACY.md, "Terms inside a triangle"): 0.1 and 0.6 are worse near a triangle.
const SOFTENING: f32 = 0.25;

impl Illumination {
    /// Returns the strategy of a code that bytes hold.
    pub(crate) fn from_u32(value: u32) -> Option<Self> {
        [Self::ClampedVertices, Self::Conservative, Self::PointToPoint, Self::Boundary]
            .into_iter()
            .find(|kind| *kind as u32 == value)
    }

    /// Returns the estimates for cells of one size in a plane. Zero only below the horizon; never NaN, possibly infinite.
    #[inline(always)]
    pub(super) fn estimate<const COUNT: usize>(
        self,
        receiver: Receiver,
        cells: &CellViews<COUNT>,
        vertices: impl Fn(usize) -> [Vec3; 3],
    ) -> [f32; COUNT] {
        let mut estimates = match self {
            Self::ClampedVertices => clamped_vertices(receiver, cells),
            _ => core::array::from_fn(|i| self.at_center(receiver, cells, i, &vertices)),
        };
        if receiver.has_horizon() {
            let [a, b, c] = &cells.heights;
            for (i, estimate) in estimates.iter_mut().enumerate() {
                let highest = a[i].max(b[i]).max(c[i]);
                *estimate = if highest < cells.horizon { 0.0 } else { *estimate };
            }
        }
        estimates
    }

    /// The terms that look at the center of a cell.
    fn at_center<const COUNT: usize>(
        self,
        receiver: Receiver,
        cells: &CellViews<COUNT>,
        i: usize,
        vertices: &impl Fn(usize) -> [Vec3; 3],
    ) -> f32 {
        let (area, distance2) = (cells.area, cells.distance2[i]);
        let inverse = 1.0 / math::sqrt(distance2);
        let cos_l = (cells.height * inverse).min(1.0);
        let mean = cells.heights.iter().map(|height| height[i]).sum::<f32>() * (1.0 / 3.0);
        let cos_s = receiver.weight_at_height(mean, inverse);
        let least = LEAST_CELL_COSINE;
        let conservative = area * (1.0 + cos_s).max(least) * (1.0 + cos_l) * (0.25 * FRAC_1_PI) / distance2;
        match self {
            Self::ClampedVertices | Self::Conservative => conservative,
            Self::PointToPoint => area * cos_s.max(least) * cos_l.max(least) * FRAC_1_PI / distance2,
            Self::Boundary => receiver.irradiance(&vertices(i)).max(LEAST_BOUNDARY * conservative),
        }
    }
}

/// Cells of one size in a plane as a shading point sees them.
pub(super) struct CellViews<const COUNT: usize> {
    /// Heights of the corners over the receiver's plane, if it has a normal.
    pub(super) heights: [[f32; COUNT]; 3],
    /// Weights of the corners.
    pub(super) weights: [[f32; COUNT]; 3],
    /// Height below which a corner is below the horizon for certain.
    pub(super) horizon: f32,
    /// Squared distances of the centers; positive.
    pub(super) distance2: [f32; COUNT],
    /// Area of each.
    pub(super) area: f32,
    /// Distance of the shading point from their plane.
    pub(super) height: f32,
}

/// The default, `Σ_k w_k max(0, n · v_k) A h / π (d² + A/4)²`. Neither square roots nor branches on a surface, so that cells
/// share vector registers.
#[inline(always)]
fn clamped_vertices<const COUNT: usize>(receiver: Receiver, cells: &CellViews<COUNT>) -> [f32; COUNT] {
    let softened: [f32; COUNT] = core::array::from_fn(|i| cells.distance2[i] + SOFTENING * cells.area);
    let corners = CornerHeights { heights: &cells.heights, weights: &cells.weights, distance2: &softened };
    let toward = receiver.mean_over_cells(&corners);
    let scale = cells.area * cells.height * FRAC_1_PI;
    core::array::from_fn(|i| (scale * toward[i] / (softened[i] * softened[i])).max(f32::MIN_POSITIVE))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::horizon;

    /// The estimate for one cell.
    fn estimate(strategy: Illumination, receiver: Receiver, vertices: [Vec3; 3]) -> f32 {
        let normal = if receiver.has_horizon() { receiver.normal() } else { Vec3::Z };
        let [a, b, c] = vertices;
        let cells = CellViews {
            heights: vertices.map(|v| [normal.dot(v)]),
            weights: [[1.0 / 3.0]; 3],
            horizon: horizon(normal, &vertices),
            distance2: [((a + b + c) / 3.0).length_squared()],
            area: 0.5,
            height: 0.3,
        };
        strategy.estimate(receiver, &cells, |_| vertices)[0]
    }

    #[test]
    fn only_cells_below_the_horizon_have_no_weight() {
        let strategies = [
            Illumination::ClampedVertices,
            Illumination::Conservative,
            Illumination::PointToPoint,
            Illumination::Boundary,
        ];
        let up = Receiver::Surface(Vec3::Z);
        let below = [Vec3::new(0.0, 0.0, -1.0), Vec3::new(1.0, 0.0, -0.1), Vec3::new(0.0, 1.0, -0.5)];
        let crossing = [below[0], below[1], Vec3::new(0.0, 1.0, 1e-3)];
        for strategy in strategies {
            assert_eq!(estimate(strategy, up, below), 0.0);
            assert!(estimate(strategy, up, crossing) > 0.0);
            assert!(estimate(strategy, Receiver::Volume, below) > 0.0);
            assert!(estimate(strategy, Receiver::Transmissive(Vec3::Z), below) > 0.0);
        }
    }
}
