//! Drawing directions in a whole bright feature, and its excess in a direction.

use glam::{Vec2, Vec3};

use super::descend::inside;
use super::feature_texel::FeatureTexel;
use super::features::BrightFeature;
use super::rotation::{to_local, to_world};
use super::view::{EnvironmentView, texel_at};
use crate::warp::Variate;
use crate::warp::equal_area::{SPHERE, sphere_to_square, square_to_sphere};

/// Slack of the cone around a feature for rounding, as a sine. *Proved*: covers the errors of the map (2.5e-7), of the
/// rotation, and of a plane or a direction (2e-7 each), twice over.
///
/// Larger: features are tested texel by texel a little more often. Smaller: a visible direction could be lost.
const FEATURE_ROUNDING: f32 = 2e-6;

impl BrightFeature {
    /// Sine of the angular radius of a cone that holds all directions of the feature, however they were rounded.
    #[inline]
    pub(crate) fn reach(&self) -> f32 {
        self.sin_radius + FEATURE_ROUNDING
    }

    /// Solid angle of one texel of the feature.
    #[inline]
    pub(crate) fn texel_solid_angle(&self) -> f32 {
        SPHERE / (1_u64 << (2 * self.level)) as f32
    }
}

impl<'a> EnvironmentView<'a> {
    /// Clusters of texels that are much brighter than the rest.
    #[inline]
    pub(crate) fn bright_features(&self) -> &'a [BrightFeature] {
        self.features
    }

    /// Texels of a feature, sorted by number.
    #[inline]
    pub(crate) fn feature_texels(&self, feature: usize) -> &'a [FeatureTexel] {
        let [start, end] = self.features[feature].range;
        &self.feature_texels[start as usize..end as usize]
    }

    /// Draws a world direction in a feature, with a density in proportion to its excess over the cap.
    pub(crate) fn sample_feature(&self, feature: usize, mut u: [Variate; 2]) -> Vec3 {
        let texels = self.feature_texels(feature);
        let target = u[1].value_f32();
        let chosen = texels.partition_point(|texel| texel.sum <= target).min(texels.len() - 1);
        let below = if chosen == 0 { 0.0 } else { f64::from(texels[chosen - 1].sum) };
        let width = f64::from(texels[chosen].sum) - below;
        u[1].stretch(u[1].value() - below, width, 1.0);
        self.direction_in_texel(feature, &texels[chosen], u.map(|u| u.value_f32() - 0.5))
    }

    /// World direction of a point in a feature's texel, in units of the texel's side around the center.
    pub(crate) fn direction_in_texel(&self, feature: usize, texel: &FeatureTexel, point: [f32; 2]) -> Vec3 {
        let level = self.features[feature].level;
        let (x, y) = (texel.texel & ((1 << level) - 1), texel.texel >> level);
        let point = Vec2::new(inside(level, x, point[0] + 0.5), inside(level, y, point[1] + 0.5));
        to_world(&self.header.rotation, square_to_sphere(point))
    }

    /// Excess of a feature over the cap in a unit world direction.
    #[inline]
    pub(crate) fn feature_excess(&self, feature: usize, direction: Vec3) -> f32 {
        let bright = &self.features[feature];
        let (axis, reach) = (Vec3::from_array(bright.axis), bright.reach());
        let local = to_local(&self.header.rotation, direction);
        if local.dot(axis) < 0.0 || local.cross(axis).length_squared() > reach * reach {
            return 0.0;
        }
        let number = texel_at(bright.level, sphere_to_square(local));
        let texels = self.feature_texels(feature);
        texels.binary_search_by_key(&number, |texel| texel.texel).map_or(0.0, |found| texels[found].excess)
    }

    /// World direction of a feature's center.
    pub(crate) fn feature_axis(&self, feature: usize) -> Vec3 {
        to_world(&self.header.rotation, Vec3::from_array(self.features[feature].axis))
    }

    /// Direction in the environment's frame of a world direction.
    #[inline]
    pub(crate) fn local_direction(&self, direction: Vec3) -> Vec3 {
        to_local(&self.header.rotation, direction)
    }
}
