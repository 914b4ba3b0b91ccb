//! Densities of a given point or triangle.

use super::at::PointSampler;
use super::sample::{Drawn, follow, to_finite};
use crate::blas::Lattice;
use crate::light::Lit;
use crate::record::{Hit, TriangleId};
use crate::tlas::Splitting;

impl<const N: usize> PointSampler<'_, N> {
    /// Density per solid angle with which [`Self::sample`] draws this point of this triangle. Zero where it cannot;
    /// infinity nowhere.
    ///
    /// Where a ray can cross several portals, what a host wants is [`Self::pdf_direction`].
    pub fn pdf(&self, hit: &Hit) -> f32 {
        self.pdf_of_hit(hit, None)
    }

    /// Probability with which the trees choose this triangle, in `[0, 1]`. Where suns of the environment are seen
    /// through portals, samples that are drawn towards them come on top; without any, this is the probability with
    /// which [`Self::sample`] chooses it.
    pub fn pmf(&self, triangle: TriangleId) -> f32 {
        self.lights.leaf(triangle).map_or(0.0, |leaf| (self.techniques.trees * self.tree_count(leaf, None)) as f32)
    }

    /// Probability of a triangle by the trees, or expected number of visits if they are split.
    pub(super) fn tree_count(&self, leaf: u32, splitting: Option<&Splitting>) -> f64 {
        let scene = self.lights.scene(&self.x);
        match splitting {
            None => self.lights.tlas.pmf(leaf, &self.x, &scene, self.first_weights.as_ref()),
            Some(splitting) => self.lights.tlas.expected_count(leaf, &self.x, &scene, splitting),
        }
    }

    /// Density per solid angle of a hit by all techniques.
    pub(super) fn pdf_of_hit(&self, hit: &Hit, splitting: Option<&Splitting>) -> f32 {
        let Some(leaf) = self.lights.leaf(hit.triangle) else { return 0.0 };
        let lit = &self.lights.lit(leaf, &self.x);
        let Some(lit) = lit else { return 0.0 };
        to_finite(self.density(leaf, Lattice::from_barycentrics(hit.barycentrics), lit, splitting))
    }

    /// Density per solid angle of a point of a triangle by all techniques.
    pub(super) fn density(&self, leaf: u32, place: Lattice, lit: &Lit<'_>, splitting: Option<&Splitting>) -> f64 {
        let count = self.tree_count(leaf, splitting);
        self.mixed_pdf(&Drawn { leaf, place, count, tree_pdf: self.tree_pdf(leaf, count, place, lit) }, lit)
    }

    /// Density per solid angle by the trees of a point of a triangle, which they choose so often.
    pub(super) fn tree_pdf(&self, leaf: u32, count: f64, place: Lattice, lit: &Lit<'_>) -> f64 {
        match count {
            0.0 => 0.0,
            count => {
                count * follow(self.lights.cells, self.lights.triangles[leaf as usize].root, lit, place).unwrap_or(0.0)
            }
        }
    }
}
