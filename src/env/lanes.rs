//! Radiances of many small regions of directions at once: the lookups of a vector loop.
//!
//! As in [`cone`](super::cone), a region is looked up in the texel of a 3x3 filtered level whose filter is as large as
//! its solid angle. Where the image has black texels, or more contrast than a share of the mean can make up for, a
//! second, *covering* lookup takes the texel of a level whose texels are so wide that the 3x3 filter holds the whole
//! region. It is zero only if the region is black.

use super::cone::{CONSTANT_RATIO, DEFENSIVE_SHARE};
use super::view::EnvironmentView;
use crate::math::{self, at_least, at_most, only_if};
use crate::warp::equal_area::{QUICK_ERROR, SPHERE, STRETCH};

/// Share of the covering lookup in an estimate. Chosen on skies with black patches and with lamps, from 2 % and 25 %:
/// these differ only where the contrast is large, and there the larger share has down to a third of the variance.
///
/// Larger: a coarser estimate. Smaller: more noise where the finer lookup misses something bright.
const COVER_SHARE: f32 = 0.25;

/// Ratio of the largest radiance to the mean from which on lookups are covered. Chosen, not swept: twice the ratio at
/// which bright features are capped, so that an image without other contrast is looked up once.
///
/// Larger: more noise in images of high contrast. Smaller: images without need of it pay for the second lookup.
const SMOOTH_CONTRAST: f32 = 32.0;

/// Adding it to a small non-negative number leaves the nearest integer in the low bits. *Proved*: 1.5 · 2^23, from
/// where on floats are integers.
const INTEGER: f32 = 12_582_912.0;

/// The low bits that hold the integer. *Proved*: indices of texels a side are below 2^14.
const INTEGER_MASK: u32 = 0x3f_ffff;

/// Texels of the image up to whose solid angle a region counts as constant. Chosen together with the steps of the
/// spherical grid, not swept.
///
/// Larger: the contrast between neighboring texels is not followed. Smaller: steps that divide single texels.
const CONSTANT_TEXELS: f32 = 4.0;

/// Half the side of the box that stands for a region, in sides of the square of its solid angle. Chosen, not swept: the
/// box has the solid angle of the region.
///
/// Larger: more steps. Smaller: contrast beside the center is not seen.
const BOX_HALF: f32 = 0.5;

impl EnvironmentView<'_> {
    /// Whether estimates need the covering lookup: whether there are black texels or high contrast, apart from the
    /// bright features.
    #[inline(always)]
    pub(crate) fn is_rough(&self) -> bool {
        let [least, largest] = self.ranges[0];
        !(least > 0.0 && largest <= SMOOTH_CONTRAST * self.mean_without_features())
    }

    /// Returns a vector in the environment's frame.
    #[inline(always)]
    pub(crate) fn local_vector(&self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        self.header.rotation.map(|axis| axis[0] * x + axis[1] * y + axis[2] * z)
    }

    /// Returns the number of texels a side of the level whose filter is nearest to a solid angle.
    #[inline(always)]
    pub(crate) fn filter_size(&self, solid_angle: f32) -> u32 {
        1 << self.depth_of_solid_angle(solid_angle)
    }

    /// Returns [`filter_size`](Self::filter_size) of a lane. `texels` is [`filter_texels`](Self::filter_texels) of the
    /// solid angle, `finest` is [`size`](Self::size).
    #[inline(always)]
    pub(crate) fn filter_size_of_lane(texels: f32, finest: f32) -> f32 {
        // Half the logarithm, rounded down: an operation on the exponent. NaN gives the finest level.
        let size = f32::from_bits((((texels.to_bits() >> 23) + 127) >> 1) << 23);
        at_least(at_most(size, finest), 1.0)
    }

    /// Returns twice the number of texels of a level whose filter has this solid angle: the squares of sizes are
    /// rounded to the nearest power of four by rounding twice as much down.
    #[inline(always)]
    pub(crate) fn filter_texels(solid_angle: f32) -> f32 {
        2.0 * 9.0 * SPHERE / at_least(solid_angle, f32::MIN_POSITIVE)
    }

    /// Returns the number, among those of all levels, of the first texel of the level of this size.
    #[inline(always)]
    pub(crate) fn first_texel(size: u32) -> u32 {
        // Levels start at (size² - 1) / 3: every other bit below that of size².
        size.wrapping_mul(size).wrapping_sub(1) & 0x5555_5555
    }

    /// Returns the number of texels a side of the level whose filter holds a region. `angle` is a bound of the angle
    /// from the central direction to any other. `finest` is [`size`](Self::size).
    #[inline(always)]
    pub(crate) fn cover_size(angle: f32, finest: f32) -> f32 {
        // Wherever in its texel the center lies, the neighborhood reaches a texel further, which is at least as wide as
        // this: the power of two above it.
        let half = 1.001 * STRETCH * angle + QUICK_ERROR;
        let size = f32::from_bits((253_u32 << 23).wrapping_sub(half.to_bits() & 0x7f80_0000));
        // NaN and what is too large for any texel get the whole sphere.
        let size = if half < 0.5 { size } else { 1.0 };
        at_least(at_most(size, finest), 1.0)
    }

    /// Returns the number, among those of all levels, of the texel at a point of the square in the level of this size.
    #[inline(always)]
    pub(crate) fn texel_in_level([x, y]: [f32; 2], size: f32) -> u32 {
        let (x, y) = (texel_of(x * size), texel_of(y * size));
        let size = (size + INTEGER).to_bits() & INTEGER_MASK;
        Self::first_texel(size).wrapping_add(y.wrapping_mul(size)).wrapping_add(x)
    }

    /// Multiplies weights with the radiances of regions over the mean radiance. `fine` are the texels of the size of
    /// the regions, `cover` those whose filters hold them, where that is requested. A weight becomes zero only if its
    /// region is black, and what is zero stays so.
    #[inline(always)]
    pub(crate) fn weigh_lanes<const LANES: usize>(
        &self,
        fine: &[u32; LANES],
        cover: Option<&[u32; LANES]>,
        weights: &mut [f32; LANES],
    ) {
        let scale = 1.0 / self.mean_without_features();
        let fine = self.gather(fine);
        match cover {
            None => {
                let share = (1.0 - DEFENSIVE_SHARE) * scale;
                for i in 0..LANES {
                    weights[i] *= share * fine[i] + DEFENSIVE_SHARE;
                }
            }
            Some(cover) => {
                let cover = self.gather(cover);
                for i in 0..LANES {
                    let radiance = scale * ((1.0 - COVER_SHARE) * fine[i] + COVER_SHARE * cover[i]);
                    let weight = weights[i] * at_least(radiance, f32::MIN_POSITIVE);
                    let is_possible = cover[i] > 0.0 && weights[i] > 0.0;
                    weights[i] = only_if(is_possible, at_least(weight, f32::MIN_POSITIVE));
                }
            }
        }
    }

    /// Whether the radiance is about constant over a region of this solid angle around a point of the square, as far as
    /// estimates are concerned.
    #[inline]
    pub(crate) fn is_about_constant(&self, [x, y]: [f32; 2], solid_angle: f32) -> bool {
        if solid_angle <= CONSTANT_TEXELS * self.texel_solid_angle() {
            return true;
        }
        let half = BOX_HALF * math::sqrt(solid_angle * (1.0 / SPHERE));
        let [least, largest] = self.range_of_box(x, y, half);
        least >= CONSTANT_RATIO * largest
    }

    #[inline(always)]
    fn gather<const LANES: usize>(&self, texels: &[u32; LANES]) -> [f32; LANES] {
        let filtered = self.filtered;
        let mut values = [0.0; LANES];
        let Some(last) = filtered.len().checked_sub(1) else { return values };
        for i in 0..LANES {
            // Always in range. A choice, as it costs less than a check.
            let texel = texels[i] as usize;
            values[i] = filtered[if texel < last { texel } else { last }];
        }
        values
    }
}

/// Returns the largest integer not above a number in `[0, 2^14)`, or a neighbor where rounding is undecided: the column
/// or row of a coordinate in units of texels.
#[inline(always)]
pub(crate) fn texel_of(x: f32) -> u32 {
    (x - 0.5 + INTEGER).to_bits() & INTEGER_MASK
}
