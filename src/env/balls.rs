//! How bright the directions to many balls are: a quicker estimate than that of one region, for choices among boxes.

use super::footprint::{DEFENSIVE, Footprint};
use super::pyramid::level_start;
use super::rotation::to_local;
use super::view::{EnvironmentView, texel_at};
use crate::warp::equal_area::sphere_to_square;
use glam::Vec3;

/// Fewer balls than this are looked at one by one: vectors for all lanes would mostly be empty.
const FEW: u32 = 4;

impl EnvironmentView<'_> {
    /// Estimates of the mean radiance of balls by the talk's look-up (see [`footprint`](super::footprint)), with
    /// centres by axis, relative to the viewer. Zero only if a ball is black. Only the balls in a set of bits are
    /// looked at.
    #[inline(always)]
    pub(crate) fn averages_of_balls<const N: usize>(
        &self,
        centers: &[[f32; N]; 3],
        radii: &[f32; N],
        set: u32,
    ) -> [f32; N] {
        if self.is_constant() {
            return [self.header.mean; N];
        }
        let mut values = [0.0; N];
        let asked = (0..N).filter(|i| set >> i & 1 == 1);
        if self.has_black() {
            for i in asked {
                values[i] = self.average_of_ball([0, 1, 2].map(|axis| centers[axis][i]), radii[i]);
            }
        } else if set.count_ones() < FEW {
            for i in asked {
                let texels = self.texels_of_balls(&[0, 1, 2].map(|axis| [centers[axis][i]]), &[radii[i]]);
                values[i] = self.estimate(texels[0]);
            }
        } else {
            let texels = self.texels_of_balls(centers, radii);
            for i in asked {
                values[i] = self.estimate(texels[i]);
            }
        }
        values
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

    /// The texels that stand for balls, in one plain loop over arrays that a compiler can turn into vectors.
    #[inline(always)]
    fn texels_of_balls<const N: usize>(&self, centers: &[[f32; N]; 3], radii: &[f32; N]) -> [u32; N] {
        let mut texels = [0; N];
        for i in 0..N {
            let ball = Footprint::ball(Vec3::new(centers[0][i], centers[1][i], centers[2][i]), radii[i]);
            let place = sphere_to_square(to_local(&self.header.rotation, ball.direction));
            let depth = self.depth_of_solid_angle(ball.solid_angle);
            texels[i] = level_start(depth) as u32 + texel_at(depth, place);
        }
        texels
    }
}

#[cfg(test)]
mod tests;
