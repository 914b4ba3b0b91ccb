//! A surface that gathers light from both sides: the absolute cosine.

use glam::Vec3;

use super::lambert::lambert;
use super::lanes::{LEAST_CLUSTER_COSINE, ReceiverLanes};
use super::{HeightWeights, ReceiverKind};
use crate::math;

#[derive(Clone, Copy)]
pub(super) struct Transmissive {
    pub(super) normal: Vec3,
}

impl ReceiverKind for Transmissive {
    #[inline]
    fn weight(self, direction: Vec3) -> f32 {
        self.normal.dot(direction).abs()
    }

    #[inline(always)]
    fn normal(self) -> Vec3 {
        self.normal
    }

    #[inline(always)]
    fn is_dark(self, _vertices: &[Vec3; 3]) -> bool {
        false
    }

    #[inline(always)]
    fn has_horizon(self) -> bool {
        false
    }

    /// The cosine of the axis, but no less than the mean of a cone whose axis lies in the plane.
    #[inline(always)]
    fn mean_over_cone(self, axis: Vec3, sin_radius: f32) -> f32 {
        self.normal.dot(axis).abs().max(0.5 * sin_radius)
    }

    #[inline(always)]
    fn height_weights(self) -> HeightWeights {
        HeightWeights { below: -1.0, distance: 0.0 }
    }

    #[inline]
    fn weight_at_height(self, height: f32, inverse_distance: f32) -> f32 {
        height.abs() * inverse_distance
    }

    fn irradiance(self, vertices: &[Vec3; 3]) -> f32 {
        lambert(self.normal, vertices) + lambert(-self.normal, vertices)
    }

    /// The mean of a square cell that the plane halves.
    #[inline(always)]
    fn least_over_directions(self, solid_angle: f32) -> f32 {
        0.25 * math::sqrt(solid_angle)
    }

    #[inline(always)]
    fn lanes(self, position: Vec3) -> ReceiverLanes {
        // All bits of the cosine but its sign: both sides receive.
        ReceiverLanes::new(position, self.normal, u32::MAX >> 1, LEAST_CLUSTER_COSINE, Vec3::ZERO, 1.0)
    }
}
