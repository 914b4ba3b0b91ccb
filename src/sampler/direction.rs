//! Densities of a direction, which may cross several lights.

use glam::Vec3;

use super::lights::{LightSampler, LightSamplerView};
use super::sample::to_finite;
use super::suns::Techniques;
use crate::blas::Lattice;
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
        to_finite(self.direction_density(x, direction, &self.techniques(x), None))
    }

    /// [`Self::pdf_direction`] of a sample's own direction. The sampled point counts with its own density whatever
    /// rounding does to the ray, so the result is never below `sample.pdf`.
    pub fn pdf_sample_direction(&self, x: &ShadingPoint, sample: &LightSample) -> f32 {
        let techniques = self.techniques(x);
        let sampled = self.leaf(sample.hit.triangle);
        let trees = techniques.trees * self.tree_density(x, sample.direction, sampled, None);
        // The sun's part is in `sample.pdf` if the sampled point is where the ray first crosses a portal.
        let sun = self.sun_density(x, sample.direction, None, &techniques);
        let in_sample = if sun > 0.0 { self.sun_density(x, sample.direction, sampled, &techniques) } else { 0.0 };
        to_finite(f64::from(sample.pdf) + trees + (sun - in_sample))
    }

    /// Density of a direction by all techniques.
    pub(super) fn direction_density(
        &self,
        x: &ShadingPoint,
        direction: Vec3,
        techniques: &Techniques,
        splitting: Option<&Splitting>,
    ) -> f64 {
        let trees = techniques.trees * self.tree_density(x, direction, None, splitting);
        if techniques.is_trees() { trees } else { trees + self.sun_density(x, direction, None, techniques) }
    }

    /// Sum of the densities by the trees of all points along a ray, but for those of one leaf.
    fn tree_density(
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
            let Some(lit) = self.lit(leaf, x) else { return };
            if let Some(hit) = lit.intersect(direction) {
                density += self.tree_pdf(leaf, Lattice::from_barycentrics(hit), x, &lit, splitting);
            }
        });
        density
    }
}
