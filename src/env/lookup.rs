//! Estimates of the radiance in many directions at once: loops over plain arrays, which a compiler turns into vectors.
//!
//! The lookups are those of [`cone`](super::cone) with a single texel each. The *nearest* texel of the level whose filter
//! is as large as a region's solid angle is the estimate. Where the image has black texels or great contrast, a second
//! texel *covers* the region: its level is so coarse that its 3x3 filter holds the whole cone around the region. A mean
//! of zero there proves that the region is black.
//!
//! A loop over lanes maps directions to the square ([`direction_to_square`]), finds the texels
//! ([`VectorLookup::nearest`], [`VectorLookup::covering`]), and leaves it to [`VectorLookup::relative_radiances`] to fetch
//! them after the loop.

use super::cone::CONSTANT_RATIO;
use super::view::EnvironmentView;
use crate::math::{at_least, at_most, only_if, sqrt};
use crate::warp::equal_area::{SPHERE, STRETCH};

/// Share of the mean of all directions in an estimate where no region can be black. *Measured* with the share of bounds
/// in an estimate of one region, which it equals.
///
/// Larger: more samples go astray. Smaller: the variance of a bright spot that the nearest texel misses grows.
const MEAN_SHARE: f32 = super::cone::DEFENSIVE_SHARE;

/// Share of the covering texel in an estimate where the image has black texels or great contrast. *Measured* on a window
/// to a sky with black patches and to one with uncapped lamps: without it the variance is 2 and 35 times as large; 2 %
/// and 10 % are the same where there is little contrast, and worse where there is much.
///
/// Larger: regions beside a bright spot get too many samples. Smaller: fireflies where the nearest texel misses a spot.
const COVERING_SHARE: f32 = 0.25;

/// Ratio of the largest to the mean radiance, both without the bright features, from which the contrast is great.
/// *Measured*: at 16 the covering texel gains nothing.
///
/// Larger: fireflies. Smaller: time for the second lookup.
const GREAT_CONTRAST: f32 = 32.0;

/// Added to a number from 0 to 2^22, it leaves the nearest integer in the low bits. *Format* of the number: 1.5 · 2^23.
const TO_INTEGER: f32 = 12_582_912.0;

/// The bits that hold the integer. *Format* of the number.
const INTEGER_BITS: u32 = 0x3f_ffff;

/// Largest coordinate of the square. *Proved*: it lies in the last texel of every level, of which the finest has 2^13.
const LAST: f32 = 1.0 - 1.0 / 131_072.0;

/// Slack of a covering texel in units of the square. *Proved*: [`LAST`] moves a point by 7.7e-6 at most, the arc tangent
/// by 3.7e-6 (a test looks at both), and rounding by less than 1e-6.
///
/// Larger: coarser texels for the smallest regions. Smaller: a lit texel could be missed.
const COVERING_SLACK: f32 = 2e-5;

/// Factor on the half side of the box that a covering texel must hold, so that rounding (1e-7 relative) does not matter.
/// *Proved* as for the bounds of one region.
const SIDE_SLACK: f32 = 1.002;

/// What a loop over lanes needs to know of an environment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VectorLookup<'a> {
    /// See [`EnvironmentView`].
    filtered: &'a [f32],
    /// Texels a side of the finest level.
    finest: f32,
    /// Over the mean radiance.
    inverse_mean: f32,
    /// Whether regions may be black or of great contrast, so that covering texels are looked up as well.
    pub(crate) needs_covering: bool,
}

impl<'a> EnvironmentView<'a> {
    /// Prepares to look directions up in vectors.
    #[inline(always)]
    pub(crate) fn vector_lookup(&self) -> VectorLookup<'a> {
        let (mean, range) = (self.mean_without_features(), self.ranges.first());
        let [least, largest] = range.copied().unwrap_or([mean; 2]);
        VectorLookup {
            filtered: self.filtered,
            finest: (1_u32 << self.header.depth) as f32,
            inverse_mean: 1.0 / mean,
            needs_covering: least == 0.0 || largest > GREAT_CONTRAST * mean,
        }
    }

    /// Whether the radiance is about constant in the texels that a box around a point of the square touches.
    #[inline(always)]
    pub(crate) fn is_about_constant(&self, [u, v]: [f32; 2], half_side: f32) -> bool {
        let [min, max] = self.range_of_box([u, v], half_side);
        min >= CONSTANT_RATIO * max
    }
}

impl VectorLookup<'_> {
    /// Returns the texel, among those of all levels, whose 3x3 filter is as large as a solid angle, given by
    /// [`Self::texels_of`] it.
    #[inline(always)]
    pub(crate) fn nearest(&self, [u, v]: [f32; 2], texels: f32) -> u32 {
        // Rounding log4 to nearest is halving log2 of twice the number, rounded down: an operation on the exponent. NaN
        // gives the finest level.
        let scale = f32::from_bits((((texels.to_bits() >> 23) + 127) >> 1) << 23);
        self.texel([u, v], scale)
    }

    /// Returns twice the number of texels of a level whose 3x3 filter has this solid angle.
    #[inline(always)]
    pub(crate) fn texels_of(solid_angle: f32) -> f32 {
        2.0 * 9.0 * SPHERE / at_least(solid_angle, f32::MIN_POSITIVE)
    }

    /// Returns the finest texel whose 3x3 filter holds the cone around a point of the square with this sine of its angular
    /// radius.
    #[inline(always)]
    pub(crate) fn covering(&self, [u, v]: [f32; 2], sine: f32) -> u32 {
        // asin(s) <= s + (π/2 - 1) s³, as its series has no other signs. From 1 on the level is the coarsest anyway.
        let half = (SIDE_SLACK * STRETCH) * (sine + 0.570_8 * (sine * sine * sine)) + COVERING_SLACK;
        // The largest power of two below 1 / half: the exponents of both add up to -1.
        let scale = f32::from_bits((253_u32 << 23).wrapping_sub(half.to_bits() & 0x7f80_0000));
        self.texel([u, v], scale)
    }

    /// Returns the texel of a point in the level with `scale` texels a side, a power of two that is first limited to the
    /// levels there are.
    #[inline(always)]
    fn texel(&self, [u, v]: [f32; 2], scale: f32) -> u32 {
        let scale = at_least(at_most(scale, self.finest), 1.0);
        let integer = |x: f32| (x + TO_INTEGER).to_bits() & INTEGER_BITS;
        let (x, y, side) = (integer(u * scale - 0.5), integer(v * scale - 0.5), integer(scale));
        // (4^d - 1) / 3 texels are in the levels above: every other bit of 4^d - 1.
        let start = side.wrapping_mul(side).wrapping_sub(1) & 0x5555_5555;
        start.wrapping_add(y.wrapping_mul(side)).wrapping_add(x)
    }

    /// Writes the estimates, over the mean radiance. One is zero only if its region is black. `covering` counts only where
    /// [`Self::needs_covering`] says so.
    #[inline(always)]
    pub(crate) fn relative_radiances<const LANES: usize>(
        &self,
        nearest: &[u32; LANES],
        covering: &[u32; LANES],
        radiances: &mut [f32; LANES],
    ) {
        self.gather(nearest, radiances);
        if self.needs_covering {
            let mut wide = [0.0; LANES];
            self.gather(covering, &mut wide);
            for (radiance, wide) in radiances.iter_mut().zip(&wide) {
                let value = (*radiance * (1.0 - COVERING_SHARE) + *wide * COVERING_SHARE) * self.inverse_mean;
                *radiance = only_if(*wide > 0.0, at_least(value, f32::MIN_POSITIVE));
            }
        } else {
            let scale = (1.0 - MEAN_SHARE) * self.inverse_mean;
            for radiance in radiances {
                *radiance = *radiance * scale + MEAN_SHARE;
            }
        }
    }

    /// Fetches texels.
    #[inline(always)]
    fn gather<const LANES: usize>(&self, texels: &[u32; LANES], values: &mut [f32; LANES]) {
        let Some((first, _)) = self.filtered.split_first() else { return };
        for (value, texel) in values.iter_mut().zip(texels) {
            // A look whether the texel is there that is no branch.
            *value = *self.filtered.get(*texel as usize).unwrap_or(first);
        }
    }
}

/// Returns the point of the square that a direction in the environment's frame maps to, within 3.7e-6 of the exact map and
/// no farther than [`LAST`]. `distance` is the length of the vector.
#[inline(always)]
pub(crate) fn direction_to_square([x, y, z]: [f32; 3], distance: f32) -> [f32; 2] {
    let (ax, ay, az) = (x.abs(), y.abs(), z.abs());
    // As in the exact map, but with an arc tangent of fewer terms.
    let r = sqrt((x * x + y * y) / (distance * (distance + az)));
    let (small, large) = (at_most(ax, ay), at_least(ax, ay));
    let t = small / at_least(large, f32::MIN_POSITIVE);
    let s = t * t;
    let high = -0.210_275_2 + s * (0.114_681_3 + s * (-0.054_197_4 + s * 0.013_264_0));
    let minor = t * (0.636_534_5 + s * high) * r;
    let major = r - minor;
    let (a, b) = if ay > ax { (minor, major) } else { (major, minor) };
    let (u, v) = if z < 0.0 { (1.0 - b, 1.0 - a) } else { (a, b) };
    [at_most(0.5 + 0.5 * u.copysign(x), LAST), at_most(0.5 + 0.5 * v.copysign(y), LAST)]
}

#[cfg(test)]
mod tests;
