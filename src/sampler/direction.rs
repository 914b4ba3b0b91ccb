//! Densities of a direction, which may cross several lights.

use glam::Vec3;

use super::lights::{LightSampler, LightSamplerView};
use crate::record::{LightSample, ShadingPoint};
use crate::tlas::Splitting;

impl<const N: usize, const M: usize> LightSampler<N, M> {
    /// See [`LightSamplerView::pdf_direction`].
    #[inline]
    pub fn pdf_direction(&self, x: &ShadingPoint, direction: Vec3) -> f32 {
        self.as_view().pdf_direction(x, direction)
    }

    /// See [`LightSamplerView::pdf_sample_direction`].
    #[inline]
    pub fn pdf_sample_direction(&self, x: &ShadingPoint, sample: &LightSample) -> f32 {
        self.as_view().pdf_sample_direction(x, sample)
    }
}

impl<const N: usize, const M: usize> LightSamplerView<'_, N, M> {
    /// Density per solid angle with which [`Self::sample`] goes in a direction: the sum over all points of all
    /// lights that the ray from `x` crosses, found by the crate's own traversal. `direction` need not have unit
    /// length.
    pub fn pdf_direction(&self, x: &ShadingPoint, direction: Vec3) -> f32 {
        to_finite(self.direction_density(x, direction, None, None))
    }

    /// [`Self::pdf_direction`] of a sample's own direction. The sampled point counts with its own density whatever
    /// rounding does to the ray, so the result is never below `sample.pdf`.
    pub fn pdf_sample_direction(&self, x: &ShadingPoint, sample: &LightSample) -> f32 {
        let sampled = self.leaf(sample.hit.triangle);
        to_finite(f64::from(sample.pdf) + self.direction_density(x, sample.direction, sampled, None))
    }

    /// Sum of the densities of all points along a ray, but for those of one leaf.
    pub(super) fn direction_density(
        &self,
        x: &ShadingPoint,
        direction: Vec3,
        except: Option<u32>,
        splitting: Option<&Splitting>,
    ) -> f64 {
        let mut density = 0.0;
        self.tlas.cross(x.position, direction, |leaf| {
            if Some(leaf) == except {
                return;
            }
            let hit = self.lit(leaf, x).and_then(|lit| lit.intersect(direction));
            density += hit.and_then(|hit| self.pdf_on(leaf, hit, x, splitting)).unwrap_or(0.0);
        });
        density
    }
}

/// A density in single precision: zero stays zero, and nothing overflows or vanishes.
pub(super) fn to_finite(pdf: f64) -> f32 {
    if pdf > 0.0 { super::sample::to_positive(pdf) } else { 0.0 }
}
