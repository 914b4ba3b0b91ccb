//! How much a small triangle of unit radiance sends to a shading point: the three terms of the talk, and a fourth
//! that is both faster and closer, as interchangeable strategies.

use core::f32::consts::FRAC_1_PI;

use glam::Vec3;

use crate::math;
use crate::receiver::{Lobe, Receiver, ReceiverKind, for_lobe};

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
/// *Chosen*: from the talk's own comparison, which this term is kept for. Larger values send samples to the horizon.
/// Zero loses light there.
const LEAST_POINT_COSINE: f32 = 0.01;

/// Share of the conservative term that the boundary integral keeps where rounding makes it vanish.
///
/// Proved necessary: in `f32` the integral of a cell seen from afar is zero. A larger share wastes samples.
const LEAST_BOUNDARY: f32 = 1e-4;

/// Share of a cell's area that is added to the squared distance of its center.
///
/// Measured (docs/ACCURACY.md, "Terms inside a triangle"): 0.1 and 0.6 are worse near a triangle.
pub(super) const SOFTENING: f32 = 0.25;

impl Illumination {
    /// Returns the strategy of a code that bytes hold.
    pub(crate) fn from_u32(value: u32) -> Option<Self> {
        [Self::ClampedVertices, Self::Conservative, Self::PointToPoint, Self::Boundary]
            .into_iter()
            .find(|kind| *kind as u32 == value)
    }

    /// Returns the estimate for a cell. Zero only below the horizon; never NaN, possibly infinite.
    pub(super) fn estimate(self, receiver: Receiver, cell: &CellView) -> f32 {
        let [a, b, c] = cell.heights;
        if a.max(b).max(c) < cell.horizon {
            return 0.0;
        }
        match self {
            Self::ClampedVertices => clamped_vertices(receiver, cell),
            Self::Boundary => self.at_center(receiver, cell),
            Self::Conservative | Self::PointToPoint => self.at_center(receiver, cell) * lobe_factor(receiver, cell),
        }
    }

    /// The terms that look at the center of a cell.
    fn at_center(self, receiver: Receiver, cell: &CellView) -> f32 {
        let &CellView { vertices, heights, distance2, area, height, .. } = cell;
        let inverse = 1.0 / math::sqrt(distance2);
        let cos_l = (height * inverse).min(1.0);
        let cos_s = receiver.weight_at_height(heights.iter().sum::<f32>() * (1.0 / 3.0), inverse);
        let least = LEAST_POINT_COSINE;
        let conservative = area * (1.0 + cos_s).max(least) * (1.0 + cos_l) * (0.25 * FRAC_1_PI) / distance2;
        match self {
            Self::ClampedVertices | Self::Conservative => conservative,
            Self::PointToPoint => area * cos_s.max(least) * cos_l.max(least) * FRAC_1_PI / distance2,
            Self::Boundary => receiver.irradiance(&vertices).max(LEAST_BOUNDARY * conservative),
        }
    }
}

/// A cell as a shading point sees it.
pub(super) struct CellView {
    /// Corners relative to the shading point.
    pub(super) vertices: [Vec3; 3],
    /// Heights of the corners over the receiver's plane, if it has a normal.
    pub(super) heights: [f32; 3],
    /// Height below which a corner is below the horizon for certain; negative infinity without a horizon.
    pub(super) horizon: f32,
    /// Squared distance of the center; positive.
    pub(super) distance2: f32,
    pub(super) area: f32,
    /// Distance of the shading point from its plane.
    pub(super) height: f32,
    /// Variance of the points of the cell.
    pub(super) variance: f32,
}

impl CellView {
    /// Returns the mean weight times the distance, by the same without a lobe.
    fn with_lobe(&self, receiver: Receiver, toward: f32) -> f32 {
        let [a, b, c] = self.vertices;
        let center = ((a + b + c) * (1.0 / 3.0)).to_array();
        let (distance, spread2) = (math::sqrt(self.distance2), self.variance / self.distance2);
        for_lobe!(receiver, lobe => lobe.weigh(toward, center, distance, spread2))
    }
}

/// Returns the weight of a cell relative to that without a lobe, for the terms that take the cosine at the center.
fn lobe_factor(receiver: Receiver, cell: &CellView) -> f32 {
    if !receiver.has_lobe() {
        return 1.0;
    }
    let inverse = 1.0 / math::sqrt(cell.distance2);
    let cosine = receiver.weight_at_height(cell.heights.iter().sum::<f32>() * (1.0 / 3.0), inverse);
    let toward = cosine.max(LEAST_POINT_COSINE) * math::sqrt(cell.distance2);
    cell.with_lobe(receiver, toward) / toward
}

/// The default, `Σ_k max(0, n · v_k) A h / 3 π (d² + A/4)²`, as the [kernel](super::cell_kernel) has it for many cells.
fn clamped_vertices(receiver: Receiver, cell: &CellView) -> f32 {
    let softened = cell.distance2 + SOFTENING * cell.area;
    let toward = cell.with_lobe(receiver, receiver.height_weights().mean(cell.heights, math::sqrt(cell.distance2)));
    (cell.area * cell.height * FRAC_1_PI * toward / (softened * softened)).max(f32::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::horizon;

    /// The estimate for one cell.
    fn estimate(strategy: Illumination, receiver: Receiver, vertices: [Vec3; 3]) -> f32 {
        let [a, b, c] = vertices;
        let cell = CellView {
            vertices,
            heights: vertices.map(|v| receiver.normal().dot(v)),
            horizon: if receiver.has_horizon() { horizon(receiver.normal(), &vertices) } else { f32::NEG_INFINITY },
            distance2: ((a + b + c) / 3.0).length_squared(),
            area: 0.5,
            height: 0.3,
            variance: 0.1,
        };
        strategy.estimate(receiver, &cell)
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
