//! Densities of a direction, which may cross several lights.

use glam::Vec3;

use super::at::PointSampler;
use super::sample::to_finite;
use crate::blas::Lattice;
use crate::geometry;
use crate::record::LightSample;
use crate::tlas::Splitting;

impl<const N: usize> PointSampler<'_, N> {
    /// Density per solid angle with which [`Self::sample`] goes in a direction: the sum over all points of all
    /// lights that the ray from the shading point crosses, found by the crate's own traversal. `direction` need not
    /// have unit length.
    pub fn pdf_direction(&self, direction: Vec3) -> f32 {
        to_finite(self.direction_density(direction, None, None))
    }

    /// [`Self::pdf_direction`] of a sample's own direction. The sampled point counts with its own density whatever
    /// rounding does to the ray, so the result is never below `sample.pdf`; only what else the ray crosses is
    /// followed down the trees.
    pub fn pdf_sample_direction(&self, sample: &LightSample) -> f32 {
        let others = self.direction_density(sample.direction, self.lights.leaf(sample.hit.triangle), None);
        to_finite(f64::from(sample.pdf) + others)
    }

    /// Sum of the densities of all points along a ray, but for those of one leaf.
    pub(super) fn direction_density(&self, direction: Vec3, except: Option<u32>, splitting: Option<&Splitting>) -> f64 {
        let mut density = 0.0;
        self.lights.tlas.cross(self.x.position, direction, |leaf| {
            if Some(leaf) == except {
                return;
            }
            let triangle = self.lights.triangles[leaf as usize].triangle();
            let vertices = triangle.exactly_relative_to(self.x.position);
            let Some(hit) = geometry::intersect(vertices, direction) else { return };
            if let Some(lit) = &self.lights.lit(leaf, &self.x) {
                density += self.density(leaf, Lattice::from_barycentrics(hit), lit, splitting);
            }
        });
        density
    }
}
