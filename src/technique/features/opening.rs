//! Bright features through an opening with three straight edges: how much of a feature is visible, and directions into
//! the visible part.

use glam::{DVec3, Vec3};

use super::texel_cut::TexelCut;
use crate::env::{BrightFeature, EnvironmentView};
use crate::warp::Variate;

/// The directions between three planes through the viewer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Opening {
    /// Unit normals that point inwards, in the environment's frame. Zero for an edge that passes through the viewer.
    pub(super) planes: [Vec3; 3],
}

/// How much of a feature is visible.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Coverage {
    /// Nothing of the feature.
    Nothing,
    /// Perhaps a part of the feature.
    Part,
    /// All of the feature.
    All,
}

impl Opening {
    /// The directions in which a triangle is visible whose vertices are given relative to the viewer.
    pub(super) fn new(environment: &EnvironmentView<'_>, [a, b, c]: [DVec3; 3]) -> Self {
        let planes = [b.cross(c), c.cross(a), a.cross(b)];
        let sign = 1f64.copysign(planes[0].dot(a));
        let inwards = |plane: DVec3| (sign * plane).normalize_or_zero().as_vec3();
        Self { planes: planes.map(|plane| environment.local_direction(inwards(plane))) }
    }

    /// Bounds how much of a feature the opening shows, by the cone around the feature.
    #[inline]
    pub(super) fn coverage(&self, feature: &BrightFeature) -> Coverage {
        let (axis, reach) = (Vec3::from_array(feature.axis), feature.reach());
        let depths = self.planes.map(|plane| plane.dot(axis));
        if depths.iter().any(|&depth| depth < -reach) {
            Coverage::Nothing
        } else if depths.iter().all(|&depth| depth >= reach) {
            Coverage::All
        } else {
            Coverage::Part
        }
    }

    /// Returns a feature's excess over the cap, integrated over the directions of the opening.
    pub(super) fn power(&self, environment: &EnvironmentView<'_>, feature: usize) -> f32 {
        let bright = &environment.bright_features()[feature];
        match self.coverage(bright) {
            Coverage::Nothing => 0.0,
            Coverage::All => bright.power,
            Coverage::Part => {
                let texels = environment.feature_texels(feature).iter();
                let shares = texels.map(|texel| texel.excess * TexelCut::new(texel, self).share());
                bright.texel_solid_angle() * shares.sum::<f32>()
            }
        }
    }

    /// Draws a world direction in the visible part of a feature, with a density in proportion to the excess over the
    /// cap. `power` is [`Self::power`] of the same feature, above zero.
    ///
    /// The direction may miss the opening by as much as a texel's margin.
    pub(super) fn sample(
        &self,
        environment: &EnvironmentView<'_>,
        feature: usize,
        power: f32,
        mut u: [Variate; 2],
    ) -> Vec3 {
        let bright = &environment.bright_features()[feature];
        if self.coverage(bright) == Coverage::All {
            return environment.sample_feature(feature, u);
        }
        let per_share = bright.texel_solid_angle() / power;
        let target = u[1].value();
        let (mut chosen, mut low, mut width, mut below) = (None, 0.0, 1.0, 0.0);
        for texel in environment.feature_texels(feature) {
            let cut = TexelCut::new(texel, self);
            let share = f64::from(texel.excess * cut.share() * per_share);
            if share > 0.0 {
                (chosen, low, width) = (Some((texel, cut)), below, share);
                below += share;
                if target < below {
                    break;
                }
            }
        }
        u[1].stretch(target - low, width, 1.0);
        match chosen {
            Some((texel, TexelCut::Part(polygon, _))) => {
                environment.direction_in_texel(feature, texel, polygon.sample(u))
            }
            Some((texel, _)) => environment.direction_in_texel(feature, texel, u.map(|u| u.value_f32() - 0.5)),
            None => environment.sample_feature(feature, u),
        }
    }
}
