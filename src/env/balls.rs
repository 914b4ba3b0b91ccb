//! How bright the directions to many balls are: a quicker estimate than that of one region, for choices among boxes.

use super::footprint::{DEFENSIVE, Footprint};
use super::pyramid::level_start;
use super::rotation::to_local;
use super::view::{EnvironmentView, texel_at};
use crate::warp::equal_area::sphere_to_square;
use glam::Vec3;

/// Largest number of balls: *format*, the largest arity of a tree over triangles.
const MAX_BALLS: usize = 16;

/// Fewer balls than this are looked at one by one: vectors for all lanes would mostly be empty.
const FEW: u32 = 4;

impl EnvironmentView<'_> {
    /// Estimates of the mean radiance of balls by the talk's look-up (see [`footprint`](super::footprint)), with
    /// centres by axis, relative to the viewer. Zero only if a ball is black. Only the balls in a set of bits are
    /// looked at.
    #[inline(always)]
    pub(crate) fn averages_of_balls(&self, centers: [&[f32]; 3], radii: &[f32], set: u32, values: &mut [f32]) {
        if self.is_constant() {
            values.fill(self.header.mean);
            return;
        }
        let count = radii.len().min(MAX_BALLS);
        let center = |i: usize| centers.map(|centers| centers[i]);
        let asked = (0..count).filter(|i| set >> i & 1 == 1);
        if self.has_black() {
            for i in asked {
                values[i] = self.average_of_ball(center(i), radii[i]);
            }
        } else if set.count_ones() < FEW {
            for i in asked {
                values[i] = self.estimate(self.texel_of_ball(center(i), radii[i]));
            }
        } else {
            let mut texels = [0; MAX_BALLS];
            for i in 0..count {
                texels[i] = self.texel_of_ball(center(i), radii[i]);
            }
            for i in asked {
                values[i] = self.estimate(texels[i]);
            }
        }
    }

    /// Whether any texel is black.
    #[inline]
    fn has_black(&self) -> bool {
        self.ranges[0][0] == 0.0
    }

    /// What the talk's texel says, and a share of the mean over all directions for what it may miss.
    #[inline]
    fn estimate(&self, texel: u32) -> f32 {
        (1.0 - DEFENSIVE) * self.filtered[texel as usize] + DEFENSIVE * self.mean_without_suns()
    }

    /// The estimate that tells black from dark.
    #[inline(never)]
    fn average_of_ball(&self, [x, y, z]: [f32; 3], radius: f32) -> f32 {
        self.average(&Footprint::ball(Vec3::new(x, y, z), radius)).value
    }

    /// The texel that stands for a ball, without a branch, so that loops over balls can become vectors.
    #[inline(always)]
    fn texel_of_ball(&self, [x, y, z]: [f32; 3], radius: f32) -> u32 {
        let ball = Footprint::ball(Vec3::new(x, y, z), radius);
        let place = sphere_to_square(to_local(&self.header.rotation, ball.direction));
        let depth = self.depth_of_solid_angle(ball.solid_angle);
        level_start(depth) as u32 + texel_at(depth, place)
    }
}

#[cfg(test)]
mod tests;
