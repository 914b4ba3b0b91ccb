//! Densities of a direction, which may cross several lights.

use glam::Vec3;

use super::at::PointSampler;
use super::sample::to_finite;
use crate::blas::Lattice;
use crate::record::LightSample;
use crate::tlas::Splitting;

impl<const N: usize, const M: usize> PointSampler<'_, N, M> {
    /// Density per solid angle with which [`Self::sample`] goes in a direction: the sum over all points of all
    /// lights that the ray from the shading point crosses, found by the crate's own traversal. `direction` need not
    /// have unit length.
    pub fn pdf_direction(&self, direction: Vec3) -> f32 {
        to_finite(self.direction_density(direction, None))
    }

    /// [`Self::pdf_direction`] of a sample's own direction. The sampled point counts with its own density whatever
    /// rounding does to the ray, so the result is never below `sample.pdf`; only what else the ray crosses is
    /// followed down the trees.
    pub fn pdf_sample_direction(&self, sample: &LightSample) -> f32 {
        let sampled = self.lights.leaf(sample.hit.triangle);
        let trees = self.techniques.trees * self.tree_density(sample.direction, sampled, None);
        // The sun's part is in `sample.pdf` if the sampled point is where the ray first crosses a portal.
        let sun = self.sun_density(sample.direction, sampled);
        to_finite(f64::from(sample.pdf) + trees + sun)
    }

    /// Density of a direction by all techniques.
    pub(super) fn direction_density(&self, direction: Vec3, splitting: Option<&Splitting>) -> f64 {
        self.techniques.trees * self.tree_density(direction, None, splitting) + self.sun_density(direction, None)
    }

    /// Sum of the densities by the trees of all points along a ray, but for those of one leaf.
    fn tree_density(&self, direction: Vec3, except: Option<u32>, splitting: Option<&Splitting>) -> f64 {
        let mut density = 0.0;
        self.lights.tlas.cross(self.x.position, direction, |leaf| {
            if Some(leaf) == except {
                return;
            }
            let Some(lit) = self.lights.lit(leaf, &self.x) else { return };
            if let Some(hit) = lit.intersect(direction) {
                let count = self.tree_count(leaf, splitting);
                density += self.tree_pdf(leaf, count, Lattice::from_barycentrics(hit), &lit);
            }
        });
        density
    }
}
