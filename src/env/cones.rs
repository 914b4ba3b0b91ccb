//! Radiances of many cones at once: quicker estimates than that of one region, for choices among the boxes of a node.

use super::cone::{DEFENSIVE_SHARE, DirectionCone};
use super::view::EnvironmentView;
use crate::math::{self, at_least};
use crate::warp::equal_area::{SPHERE, sphere_to_square_quickly};
use glam::Vec3;

/// Number of balls from which all lanes are computed in one loop. *Measured* by the bench `instructions`: with 2
/// a sample of the window costs 11 % more.
///
/// Larger: more balls are looked up one by one. Smaller: vectors whose lanes are mostly unused.
const FEWEST_IN_LOOP: u32 = 4;

/// Most balls of one call. *Proved*: a set has 32 bits.
const MAX_BALLS: usize = 32;

impl EnvironmentView<'_> {
    /// Estimates the mean radiances of balls by the talk's lookup (see [`cone`](super::cone)), with centers by axis,
    /// relative to the viewer. A radiance is zero only if the ball is black. Only the balls in a set of bits are
    /// looked up; the others get zero.
    ///
    /// All slices have the same length, at most 32.
    #[inline(always)]
    pub(crate) fn radiances_of_balls(&self, centers: [&[f32]; 3], radii: &[f32], set: u32, radiances: &mut [f32]) {
        if self.is_constant() {
            radiances.fill(self.header.mean);
            return;
        }
        radiances.fill(0.0);
        let asked = (0..radii.len()).filter(|i| set >> i & 1 == 1);
        if self.has_black() {
            for i in asked {
                radiances[i] = self.radiance_of_ball(centers.map(|axis| axis[i]), radii[i]);
            }
        } else if set.count_ones() < FEWEST_IN_LOOP {
            for i in asked {
                let texel = self.texel_of_ball(centers.map(|axis| axis[i]), radii[i]);
                radiances[i] = self.filtered_and_defensive(texel);
            }
        } else {
            // One plain loop over arrays, which a compiler can turn into vectors.
            let mut texels = [0; MAX_BALLS];
            let [x, y, z] = centers;
            for ((((texel, &x), &y), &z), &radius) in texels.iter_mut().zip(x).zip(y).zip(z).zip(radii) {
                *texel = self.texel_of_ball([x, y, z], radius);
            }
            for i in asked {
                radiances[i] = self.filtered_and_defensive(texels[i]);
            }
        }
    }

    /// Whether any texel is black.
    #[inline]
    fn has_black(&self) -> bool {
        self.ranges[0][0] == 0.0
    }

    /// Filtered mean of a texel of the pyramid, and a share of the mean over all directions for what the texel may
    /// miss.
    #[inline]
    fn filtered_and_defensive(&self, texel: u32) -> f32 {
        (1.0 - DEFENSIVE_SHARE) * self.filtered[texel as usize] + DEFENSIVE_SHARE * self.mean_without_features()
    }

    /// The estimate that tells black from dark.
    #[inline(never)]
    fn radiance_of_ball(&self, [x, y, z]: [f32; 3], radius: f32) -> f32 {
        self.estimate_radiance(&DirectionCone::ball(Vec3::new(x, y, z), radius)).value
    }

    /// Index of the texel, among those of all levels, that stands for a ball.
    #[inline(always)]
    fn texel_of_ball(&self, center: [f32; 3], radius: f32) -> u32 {
        let [x, y, z] = self.local_vector(center);
        let inverse = 1.0 / math::sqrt(at_least(x * x + y * y + z * z, f32::MIN_POSITIVE));
        let sine = radius * inverse;
        // From inside the ball it is all around.
        let cosine = if sine < 1.0 { math::sqrt(1.0 - sine * sine) } else { -1.0 };
        let texels = Self::filter_texels(0.5 * SPHERE * (1.0 - cosine));
        let size = Self::filter_size_of_lane(texels, self.size() as f32);
        Self::texel_in_level(sphere_to_square_quickly([x, y, z].map(|axis| axis * inverse)), size)
    }
}

#[cfg(test)]
mod tests;
