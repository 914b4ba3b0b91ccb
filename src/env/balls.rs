//! How bright the directions to many balls are: a quicker estimate than that of one region, for choices among boxes.

use super::footprint::Footprint;
use super::view::EnvironmentView;
use crate::math::{self, at_least};
use crate::warp::equal_area::{SPHERE, to_square};
use glam::Vec3;

/// Fewer balls than this are looked at one by one.
const FEW: u32 = 4;

/// Share of the mean over all directions in an estimate, for what the one look may miss.
const DEFENSIVE: f32 = 0.02;

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
        if self.has_black() {
            for i in bits(set) {
                values[i] = self.average_of_ball([0, 1, 2].map(|axis| centers[axis][i]), radii[i]);
            }
        } else if set.count_ones() < FEW {
            for i in bits(set) {
                let texels = self.texels_of_balls(&[0, 1, 2].map(|axis| [centers[axis][i]]), &[radii[i]]);
                values[i] = self.estimate(texels[0]);
            }
        } else {
            let texels = self.texels_of_balls(centers, radii);
            for i in bits(set) {
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
        let [row_x, row_y, row_z] = self.header.rotation.map(Vec3::from_array);
        let finest = self.header.depth as i32;
        let mut texels = [0; N];
        for i in 0..N {
            let center = Vec3::new(centers[0][i], centers[1][i], centers[2][i]);
            let inverse = 1.0 / math::sqrt(at_least(center.length_squared(), f32::MIN_POSITIVE));
            let direction = center * inverse;
            let (x, y) = to_square(row_x.dot(direction), row_y.dot(direction), row_z.dot(direction));
            let sine = radii[i] * inverse;
            let cosine = math::sqrt(at_least(1.0 - sine * sine, 0.0));
            // Twice the number of texels that the filter should have been shrunk by: see `depth_of_solid_angle`.
            let solid_angle = at_least(0.5 * SPHERE * (1.0 - cosine), f32::MIN_POSITIVE);
            let solid_angle = if sine < 1.0 { solid_angle } else { SPHERE };
            let log2 = ((18.0 * SPHERE / solid_angle).to_bits() >> 23).cast_signed() - 127;
            let depth = (log2 >> 1).clamp(0, finest) as u32;
            let (scale, last) = ((1_u32 << depth) as f32, (1_i32 << depth) - 1);
            let (column, row) = (((x * scale) as i32).min(last), ((y * scale) as i32).min(last));
            let start = ((1_u32 << (2 * depth)) - 1) / 3;
            texels[i] = start + ((row << depth) | column).cast_unsigned();
        }
        texels
    }
}

/// The numbers of the bits in a set.
#[inline(always)]
fn bits(set: u32) -> impl Iterator<Item = usize> {
    let above = |&set: &u32| Some(set & (set - 1)).filter(|&rest| rest != 0);
    core::iter::successors(Some(set).filter(|&set| set != 0), above).map(|set| set.trailing_zeros() as usize)
}

#[cfg(test)]
mod tests;
