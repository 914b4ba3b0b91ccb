//! A point in a participating medium: every direction counts the same.

use core::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::lambert::solid_angle;
use super::lanes::ReceiverLanes;
use super::{HeightWeights, ReceiverKind};

#[derive(Clone, Copy)]
pub(super) struct Volume;

impl ReceiverKind for Volume {
    #[inline]
    fn weight(self, _direction: Vec3) -> f32 {
        1.0
    }

    #[inline(always)]
    fn normal(self) -> Vec3 {
        Vec3::ZERO
    }

    #[inline(always)]
    fn is_dark(self, _vertices: &[Vec3; 3]) -> bool {
        false
    }

    #[inline(always)]
    fn has_horizon(self) -> bool {
        false
    }

    #[inline(always)]
    fn mean_over_cone(self, _axis: Vec3, _sin_radius: f32) -> f32 {
        1.0
    }

    #[inline(always)]
    fn height_weights(self) -> HeightWeights {
        HeightWeights { below: 0.0, distance: 1.0 }
    }

    #[inline]
    fn weight_at_height(self, _height: f32, _inverse_distance: f32) -> f32 {
        1.0
    }

    fn irradiance(self, vertices: &[Vec3; 3]) -> f32 {
        solid_angle(vertices) * FRAC_1_PI
    }

    #[inline(always)]
    fn least_over_directions(self, _solid_angle: f32) -> f32 {
        1.0
    }

    #[inline(always)]
    fn lanes(self, position: Vec3) -> ReceiverLanes {
        // A least cosine of 1 replaces the cosine.
        ReceiverLanes::new(position, Vec3::ZERO, u32::MAX, 1.0, Vec3::ZERO, 1.0)
    }
}
