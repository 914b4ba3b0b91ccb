//! Sampling a direction of the environment in proportion to its radiance, and the density of that.

use super::pyramid::{children, grandchildren};
use super::rotation::to_world;
use super::view::EnvironmentView;
use crate::warp::equal_area::{SPHERE, square_to_sphere};
use crate::warp::variate::{Variate, seed};
use crate::warp::{pick_pair, pick_wide};
use glam::{Vec2, Vec3};

/// Least distance of a sample from its texel's edge, in units of the square. *Proved*: twice what the way to the
/// sphere, through the rotation and back can move a point, so that the direction of a sample falls into the texel that
/// it was drawn from.
///
/// Larger: samples near an edge are moved farther; at this value by less than 3e-6 radians. Smaller: the density of a
/// sample could be that of the next texel.
const TEXEL_INSET: f32 = 1e-6;

/// A direction drawn from the environment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnvironmentSample {
    /// Unit world direction, away from the viewer.
    pub direction: Vec3,
    /// Radiance along the direction. Above zero.
    pub radiance: f32,
    /// Density of the direction per solid angle. Finite and above zero.
    pub pdf: f32,
}

impl EnvironmentView<'_> {
    /// Draws a direction with a density in proportion to its radiance. `None` if the environment is black.
    ///
    /// `u` holds two uniform numbers in `[0, 1)`. A stratified set of them gives a stratified set of directions: each
    /// step goes two levels down the pyramid (the first one a single level if their number is odd), where the second
    /// number chooses the row of texels and the first one the texel of the row (two-dimensional hierarchical warp,
    /// Clarberg et al. 2005, "Wavelet Importance Sampling").
    #[must_use]
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> Option<EnvironmentSample> {
        if self.header.mean <= 0.0 {
            return None;
        }
        let salt = seed(&u);
        let mut place = [Variate::new(u[0], salt), Variate::new(u[1], !salt)];
        Some(self.sample_below(0, [0, 0], &mut place))
    }

    /// Draws a direction below a texel of a level in proportion to its radiance. Its density is that of
    /// [`sample`](Self::sample), not given the texel. The level may be below the finest, where directions are uniform.
    #[inline]
    pub(crate) fn sample_below(&self, level: u32, [mut x, mut y]: [u32; 2], u: &mut [Variate; 2]) -> EnvironmentSample {
        let depth = self.header.depth.max(level);
        let mut level = level;
        if (depth - level) % 2 == 1 {
            [x, y] = step(children(self.means, level, x, y), [x, y], u);
            level += 1;
        }
        while level < depth {
            [x, y] = step_twice(&grandchildren(self.means, level, x, y), [x, y], u);
            level += 2;
        }
        let point = Vec2::new(inside(depth, x, u[0].value_f32()), inside(depth, y, u[1].value_f32()));
        let direction = to_world(&self.header.rotation, square_to_sphere(point));
        let radiance = self.mean_in(depth, [x, y]);
        EnvironmentSample { direction, radiance, pdf: self.pdf_of(radiance) }
    }

    /// Density, per solid angle, with which [`sample`](Self::sample) draws a unit world direction.
    #[must_use]
    #[inline]
    pub fn pdf(&self, direction: Vec3) -> f32 {
        if self.header.mean <= 0.0 { 0.0 } else { self.pdf_of(self.radiance(direction)) }
    }

    /// Density of the directions of a texel with this radiance.
    ///
    /// The choices of the descent telescope: the product of `child / (sum of all children)` over the levels is
    /// the texel's share of the whole, as every mean is a quarter of the sum of four, and a sixteenth of that of 16.
    #[inline]
    fn pdf_of(&self, radiance: f32) -> f32 {
        radiance / (self.header.mean * SPHERE)
    }
}

/// Coordinate in the square of a place in a texel of a level with `2^depth` texels a side, kept off its edges.
#[inline]
pub(super) fn inside(depth: u32, texel: u32, place: f32) -> f32 {
    let side = 1.0 / (1_u32 << depth) as f32;
    let low = texel as f32 * side;
    ((texel as f32 + place) * side).max(low + TEXEL_INSET).min(low + side - TEXEL_INSET)
}

/// Chooses one of the four texels below a texel in proportion to their weights: the second variate the row, the
/// first one the column.
#[inline]
pub(crate) fn step([a, b, c, d]: [f32; 4], [x, y]: [u32; 2], u: &mut [Variate; 2]) -> [u32; 2] {
    let j = pick_pair([a + b, c + d], &mut u[1]);
    let i = pick_pair([[a, b], [c, d]][j], &mut u[0]);
    [2 * x + i as u32, 2 * y + j as u32]
}

/// Chooses one of the 16 texels two levels below a texel in proportion to their weights: the second variate the row,
/// the first one the texel of the row. Two choices wait for each other, where two [`step`]s make four, and all 16
/// weights are read at once, not level by level.
#[inline(always)]
fn step_twice(rows: &[[f32; 4]; 4], [x, y]: [u32; 2], u: &mut [Variate; 2]) -> [u32; 2] {
    let sums = rows.map(|[a, b, c, d]| (a + b) + (c + d));
    let row = pick_wide(&sums, &mut u[1]).map_or(0, |(row, _)| row);
    let column = pick_wide(&rows[row], &mut u[0]).map_or(0, |(column, _)| column);
    [4 * x + column as u32, 4 * y + row as u32]
}
