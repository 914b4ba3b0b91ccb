//! Radiance of a region of directions: an estimate that is zero only if all of the region is black.
//!
//! The radiance is looked up twice. The *talk's* lookup (Ogaki 2020, "MIP Maps for Environment Map"): the nearest texel
//! of a 3x3 filtered level whose filter is as large as the region's solid angle. It is the better estimate, but a texel
//! of it may miss what lies in the region. The *bounds*: at most 2x2 texels of a level that are sure to hold the whole
//! region. They decide about black and constant, and their mean is a small share of the estimate so that nothing bright
//! is lost.
//!
//! Why these texels hold the region: a geodesic from the region's center to any of its points is at most as long as the
//! region's angular radius ρ. Its image in the plane that is tiled by rotated copies of the square is a
//! continuous path (`wrap_texel`), no coordinate of which moves by more than `STRETCH · ρ`. So the image ends in
//! the box of that half side around the center, and the texels that the box touches, wrapped, hold the point.

use super::rotation::to_local;
use super::view::EnvironmentView;
use crate::math;
use crate::warp::equal_area::{SPHERE, STRETCH, sphere_to_square, wrap_texel_log2};
use glam::Vec3;

/// Share of the mean of the bounds (or of a larger region) in an estimate. *Measured* on the scenes with windows of
/// the bench `quality`: half and double change no variance by more than a tenth.
///
/// Larger: where the talk's lookup is right, more of the samples go astray, by this share. Smaller: the variance of a
/// bright spot that the talk's lookup misses grows with the inverse of this share.
pub(super) const DEFENSIVE_SHARE: f32 = 0.02;

/// Ratio of least to largest radiance from which a region counts as constant. *Measured* on the scenes with windows
/// of the bench `quality`: 0.3 raises the variance without a visible sun by up to a tenth, 0.8 lowers it by up to a
/// twentieth.
///
/// Larger: the descent divides more cells, at the cost of time. Smaller: less of the contrast is followed.
pub(super) const CONSTANT_RATIO: f32 = 0.6;

/// Slack of the box for rounding, in units of the square. *Proved*: covers the errors of the map (2.5e-7 at worst), of
/// the rotation and of the direction.
///
/// Larger: coarser bounds of the smallest regions. Smaller: a lit texel could be missed.
const CONE_BOX_ROUNDING: f32 = 1e-6;

/// Factor on the side of the box when a level is chosen. *Proved*: where the box is as wide as a texel, rounding (1e-7
/// relative) could make it touch three texels instead of two.
///
/// Larger: a coarser level than necessary. Smaller: more than 2x2 texels.
const SIDE_SLACK: f32 = 1.002;

/// A region of directions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DirectionCone {
    /// Unit world direction of the axis of a cone that holds the region.
    pub(crate) direction: Vec3,
    /// Sine of the cone's angular radius. From 1 on it holds everything.
    pub(crate) sin_radius: f32,
    /// Solid angle of the region itself.
    pub(crate) solid_angle: f32,
}

impl DirectionCone {
    /// Returns the directions to a ball with this center, relative to the viewer, and radius.
    #[inline(always)]
    pub(crate) fn ball(center: Vec3, radius: f32) -> Self {
        let inverse = 1.0 / math::sqrt(center.length_squared().max(f32::MIN_POSITIVE));
        let sin_radius = radius * inverse;
        let cos_radius = math::sqrt((1.0 - sin_radius * sin_radius).max(0.0));
        let solid_angle = if sin_radius < 1.0 { 0.5 * SPHERE * (1.0 - cos_radius) } else { SPHERE };
        Self { direction: center * inverse, sin_radius, solid_angle }
    }
}

/// Estimate of how bright a region is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RadianceEstimate {
    /// Estimate of the mean radiance. Zero only if the whole region is black.
    pub(crate) value: f32,
    /// Whether the radiance is known to be nearly constant: its least value is at least [`CONSTANT_RATIO`] of its
    /// largest one.
    pub(crate) is_constant: bool,
}

/// Bounds of the radiance in a region, by a few texels that hold the region.
struct RadianceBounds {
    mean: f32,
    min: f32,
    max: f32,
}

impl EnvironmentView<'_> {
    /// Estimates the mean radiance of a region.
    #[inline]
    pub(crate) fn estimate_radiance(&self, region: &DirectionCone) -> RadianceEstimate {
        if self.is_constant() {
            return RadianceEstimate { value: self.header.mean, is_constant: true };
        }
        let center = sphere_to_square(to_local(&self.header.rotation, region.direction));
        let bounds = self.radiance_bounds(center.x, center.y, region.sin_radius);
        if bounds.min == bounds.max {
            return RadianceEstimate { value: bounds.max, is_constant: true };
        }
        let depth = self.depth_of_solid_angle(region.solid_angle);
        let scale = (1_u32 << depth) as f32;
        let last = (1 << depth) - 1;
        let (x, y) = (((center.x * scale) as u32).min(last), ((center.y * scale) as u32).min(last));
        let talk = self.filtered_at(depth, x, y);
        let value = (1.0 - DEFENSIVE_SHARE) * talk + DEFENSIVE_SHARE * bounds.mean;
        RadianceEstimate { value: value.max(f32::MIN_POSITIVE), is_constant: bounds.min >= CONSTANT_RATIO * bounds.max }
    }

    /// Returns the mean, minimum and maximum over texels that hold a cone around a point of the square.
    #[inline]
    fn radiance_bounds(&self, x: f32, y: f32, sin_radius: f32) -> RadianceBounds {
        let half = STRETCH * asin_bound(sin_radius) + CONE_BOX_ROUNDING;
        let depth = self.depth_of_side(2.0 * half);
        if depth == 0 {
            let [min, max] = self.ranges[0];
            return RadianceBounds { mean: self.mean_without_features(), min, max };
        }
        let size = 1_i32 << depth;
        let scale = size as f32;
        // From depth 1 on `half` is below 1/2: shifted by one, the coordinates are positive, and the cast is the
        // floor.
        let texel = |coordinate: f32| ((coordinate + 1.0) * scale) as i32 - size;
        let (x0, x1, y0, y1) = (texel(x - half), texel(x + half), texel(y - half), texel(y + half));
        let (mut sum, mut count) = (0.0, 0.0);
        let (mut min, mut max) = (f32::INFINITY, 0.0_f32);
        for j in y0..=y1 {
            for i in x0..=x1 {
                let (i, j) = wrap_texel_log2(i, j, depth);
                let [low, high] = self.range_at(depth, i, j);
                (min, max) = (min.min(low), max.max(high));
                sum += self.filtered_at(depth, i, j);
                count += 1.0;
            }
        }
        // The filter reaches beyond the texels.
        RadianceBounds { mean: (sum / count).clamp(min, max), min, max }
    }

    /// Returns the range over texels that hold the box of this half side around a point of the square.
    #[inline]
    pub(super) fn range_of_box(&self, x: f32, y: f32, half: f32) -> [f32; 2] {
        let depth = self.depth_of_side(2.0 * half);
        if depth == 0 {
            return self.ranges[0];
        }
        let size = 1_i32 << depth;
        // As in `radiance_bounds`.
        let texel = |coordinate: f32| ((coordinate + 1.0) * size as f32) as i32 - size;
        let (x0, x1, y0, y1) = (texel(x - half), texel(x + half), texel(y - half), texel(y + half));
        let (mut min, mut max) = (f32::INFINITY, 0.0_f32);
        for (i, j) in [(x0, y0), (x1, y0), (x0, y1), (x1, y1)] {
            let (i, j) = wrap_texel_log2(i, j, depth);
            let [low, high] = self.range_at(depth, i, j);
            (min, max) = (min.min(low), max.max(high));
        }
        [min, max]
    }

    /// Depth of the finest level whose texels are at least as wide as `side`, so that it touches 2x2 at most.
    #[inline(always)]
    fn depth_of_side(&self, side: f32) -> u32 {
        // A little more than `side`: where both are equal, rounding could make it three texels.
        floor_log2(1.0 / (SIDE_SLACK * side)).clamp(0, self.header.depth as i32) as u32
    }

    /// Depth of the level whose 3x3 filter is nearest to a solid angle, Ω = min(4π, 9 · 4π / 4^depth).
    #[inline(always)]
    pub(super) fn depth_of_solid_angle(&self, solid_angle: f32) -> u32 {
        // Rounding log4(q) to nearest is flooring log4(2 q) = log2(2 q) / 2. Zero and NaN give the finest level.
        let q = 9.0 * SPHERE / solid_angle.max(f32::MIN_POSITIVE);
        (floor_log2(2.0 * q) >> 1).clamp(0, self.header.depth as i32) as u32
    }
}

/// Upper bound on asin, above it by at most 13 %, for `sine` in `[0, 1)`. A full turn for all other values.
#[inline]
fn asin_bound(sine: f32) -> f32 {
    // (asin(s) - s - s³/6) / s⁵ grows from 3/40 to π/2 - 7/6 = 0.4041.
    let s = sine.max(0.0);
    let square = s * s;
    if sine < 1.0 { s * (1.0 + square * (1.0 / 6.0 + 0.4042 * square)) } else { core::f32::consts::TAU }
}

/// Floor of the base-2 logarithm of a positive number, from its exponent.
#[inline(always)]
fn floor_log2(x: f32) -> i32 {
    (x.to_bits() >> 23) as i32 - 127
}

#[cfg(test)]
mod tests;
