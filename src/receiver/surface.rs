//! An opaque surface: the cosine, clamped at zero.

use glam::Vec3;

use super::lambert::lambert;
use super::lanes::{LEAST_CLUSTER_COSINE, ReceiverLanes};
use super::{HeightWeights, ReceiverKind};
use crate::geometry::is_below;

/// Least cosine that a cell of directions above the horizon is weighed by.
///
/// *Chosen*, as a guard against rounding: cells at the horizon have centers of about 1e-2. Larger values send samples
/// to the horizon; smaller ones leave a cell too few where rounding has taken its center below.
const LEAST_CELL_COSINE: f32 = 1e-4;

#[derive(Clone, Copy)]
pub(super) struct Surface {
    pub(super) normal: Vec3,
}

impl ReceiverKind for Surface {
    #[inline]
    fn weight(self, direction: Vec3) -> f32 {
        self.normal.dot(direction).max(0.0)
    }

    #[inline(always)]
    fn normal(self) -> Vec3 {
        self.normal
    }

    #[inline(always)]
    fn is_dark(self, vertices: &[Vec3; 3]) -> bool {
        is_below(self.normal, vertices)
    }

    #[inline(always)]
    fn has_horizon(self) -> bool {
        true
    }

    /// Exact for a cone above the horizon. A cone that the horizon cuts gets the mean of a linear ramp.
    #[inline(always)]
    fn mean_over_cone(self, axis: Vec3, sin_radius: f32) -> f32 {
        let (cosine, above) = (self.normal.dot(axis), self.normal.dot(axis) + sin_radius);
        if cosine >= sin_radius { cosine } else { above.max(0.0) * above.max(0.0) / (4.0 * sin_radius) }
    }

    #[inline(always)]
    fn height_weights(self) -> HeightWeights {
        HeightWeights { below: 0.0, distance: 0.0 }
    }

    #[inline]
    fn weight_at_height(self, height: f32, inverse_distance: f32) -> f32 {
        height * inverse_distance
    }

    fn irradiance(self, vertices: &[Vec3; 3]) -> f32 {
        lambert(self.normal, vertices)
    }

    /// Cells of directions are cut off at the horizon, so that the cosine of the center is about the mean.
    #[inline(always)]
    fn least_over_directions(self, _solid_angle: f32) -> f32 {
        LEAST_CELL_COSINE
    }

    #[inline(always)]
    fn lanes(self, position: Vec3) -> ReceiverLanes {
        let normal = self.normal;
        ReceiverLanes::new(position, normal, u32::MAX, LEAST_CLUSTER_COSINE, normal, 0.0)
    }
}
