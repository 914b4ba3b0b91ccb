//! Sampling a direction of the environment in proportion to its radiance, and the density of that.

use super::pyramid::{children, level_start};
use super::rotation::to_world;
use super::suns::Sun;
use super::view::EnvironmentView;
use crate::warp::equal_area::{SPHERE, square_to_sphere};
use crate::warp::pick_pair;
use crate::warp::variate::{Variate, seed};
use glam::{Vec2, Vec3};

/// How close to its texel's edge a sample may come, in units of the square.
///
/// Twice what the way to the sphere, through the rotation and back can move a point: the direction of a sample
/// falls into the texel that it was drawn from. The samples that are moved for it are moved by less than 3e-6
/// radians.
const MARGIN: f32 = 1e-6;

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
    /// `u` holds two uniform numbers in `[0, 1)`. A stratified set of them gives a stratified set of directions:
    /// at each level of the pyramid the second number chooses the row and the first one the column (two-dimensional
    /// hierarchical warp, Clarberg et al. 2005, "Wavelet Importance Sampling").
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
    /// [`sample`](Self::sample), not given the texel.
    #[inline]
    pub(super) fn sample_below(&self, depth: u32, [mut x, mut y]: [u32; 2], u: &mut [Variate; 2]) -> EnvironmentSample {
        for depth in depth..self.header.depth {
            [x, y] = step(children(self.means, depth, x, y), [x, y], u);
        }
        let point = Vec2::new(self.inside(x, u[0].value_f32()), self.inside(y, u[1].value_f32()));
        let direction = to_world(&self.header.rotation, square_to_sphere(point));
        let radiance = self.mean_at(self.header.depth, x, y);
        EnvironmentSample { direction, radiance, pdf: self.pdf_of(radiance) }
    }

    /// Draws a world direction in a sun, with a density in proportion to its excess over the cap.
    pub(crate) fn sample_sun(&self, sun: usize, mut u: [Variate; 2]) -> Vec3 {
        let [start, end] = self.suns[sun].range;
        let texels = &self.sun_texels[start as usize..end as usize];
        let target = u[1].value_f32();
        let chosen = texels.partition_point(|texel| texel.sum <= target).min(texels.len() - 1);
        let below = if chosen == 0 { 0.0 } else { f64::from(texels[chosen - 1].sum) };
        let width = f64::from(texels[chosen].sum) - below;
        u[1].stretch(u[1].value() - below, width, 1.0);
        let (depth, texel) = (self.header.depth, texels[chosen].texel);
        let (x, y) = (texel & ((1 << depth) - 1), texel >> depth);
        let point = Vec2::new(self.inside(x, u[0].value_f32()), self.inside(y, u[1].value_f32()));
        to_world(&self.header.rotation, square_to_sphere(point))
    }

    /// The sun that a world direction lies in, and the density per solid angle with which
    /// [`sample_sun`](Self::sample_sun) draws it.
    #[inline]
    pub(crate) fn sun_at(&self, direction: Vec3) -> Option<(usize, f32)> {
        if self.suns.is_empty() {
            return None;
        }
        let texel = self.texel(direction);
        let radiance = self.means[level_start(self.header.depth) + texel as usize];
        if radiance <= self.header.cap {
            return None;
        }
        let holds = |sun: &Sun| {
            let texels = &self.sun_texels[sun.range[0] as usize..sun.range[1] as usize];
            texels.binary_search_by_key(&texel, |texel| texel.texel).is_ok()
        };
        let sun = self.suns.iter().position(holds)?;
        Some((sun, (radiance - self.header.cap) / self.suns[sun].power))
    }

    /// Axis of a sun in the world.
    pub(crate) fn sun_axis(&self, sun: usize) -> Vec3 {
        to_world(&self.header.rotation, Vec3::from_array(self.suns[sun].axis))
    }

    /// Density, per solid angle, with which [`sample`](Self::sample) draws a unit world direction.
    #[inline]
    pub fn pdf(&self, direction: Vec3) -> f32 {
        if self.header.mean <= 0.0 { 0.0 } else { self.pdf_of(self.radiance(direction)) }
    }

    /// Density of the directions of a texel with this radiance.
    ///
    /// The choices of the descent telescope: the product of `child / (sum of four children)` over the levels is
    /// the texel's share of the whole, as every mean is a quarter of that sum.
    #[inline]
    fn pdf_of(&self, radiance: f32) -> f32 {
        radiance / (self.header.mean * SPHERE)
    }

    /// Coordinate in the square of a place in a texel, kept off the texel's edges.
    #[inline]
    fn inside(&self, texel: u32, place: f32) -> f32 {
        let side = 1.0 / (1_u32 << self.header.depth) as f32;
        let low = texel as f32 * side;
        ((texel as f32 + place) * side).max(low + MARGIN).min(low + side - MARGIN)
    }
}

/// Chooses one of the four texels below a texel in proportion to their weights: the second variate the row, the
/// first one the column.
#[inline]
pub(super) fn step([a, b, c, d]: [f32; 4], [x, y]: [u32; 2], u: &mut [Variate; 2]) -> [u32; 2] {
    let j = pick_pair([a + b, c + d], &mut u[1]);
    let i = pick_pair([[a, b], [c, d]][j], &mut u[0]);
    [2 * x + i as u32, 2 * y + j as u32]
}
