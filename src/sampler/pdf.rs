//! Densities of a given point or triangle.

use super::lights::{LightSampler, LightSamplerView};
use super::sample::{Drawn, follow, to_finite};
use super::suns::Techniques;
use crate::blas::Lattice;
use crate::light::Lit;
use crate::record::{Hit, ShadingPoint, TriangleId};
use crate::tlas::Splitting;

impl<const N: usize, const M: usize> LightSampler<N, M> {
    /// See [`LightSamplerView::pdf`].
    #[inline]
    pub fn pdf(&self, x: &ShadingPoint, hit: &Hit) -> f32 {
        self.as_view().pdf(x, hit)
    }

    /// See [`LightSamplerView::pmf`].
    #[inline]
    pub fn pmf(&self, x: &ShadingPoint, triangle: TriangleId) -> f32 {
        self.as_view().pmf(x, triangle)
    }
}

impl<const N: usize, const M: usize> LightSamplerView<'_, N, M> {
    /// Density per solid angle with which [`Self::sample`] draws this point of this triangle. Zero where it cannot;
    /// infinity nowhere.
    ///
    /// Where a ray can cross several portals, what a host wants is [`Self::pdf_direction`].
    pub fn pdf(&self, x: &ShadingPoint, hit: &Hit) -> f32 {
        self.pdf_of_hit(x, hit, &self.techniques(x), None)
    }

    /// Probability with which the trees choose this triangle, in `[0, 1]`. Where suns of the environment are seen
    /// through portals, samples that are drawn towards them come on top; without any, this is the probability with
    /// which [`Self::sample`] chooses it.
    pub fn pmf(&self, x: &ShadingPoint, triangle: TriangleId) -> f32 {
        let trees = self.techniques(x).trees;
        self.leaf(triangle).map_or(0.0, |leaf| (trees * self.tree_count(leaf, x, None)) as f32)
    }

    /// Probability of a triangle by the trees, or expected number of visits if they are split.
    pub(super) fn tree_count(&self, leaf: u32, x: &ShadingPoint, splitting: Option<&Splitting>) -> f64 {
        match splitting {
            None => self.tlas.pmf(leaf, x, &self.scene(x)),
            Some(splitting) => self.tlas.expected_count(leaf, x, &self.scene(x), splitting),
        }
    }

    /// Density per solid angle of a hit by all techniques.
    pub(super) fn pdf_of_hit(
        &self,
        x: &ShadingPoint,
        hit: &Hit,
        techniques: &Techniques,
        splitting: Option<&Splitting>,
    ) -> f32 {
        let Some(leaf) = self.leaf(hit.triangle) else { return 0.0 };
        let Some(lit) = self.lit(leaf, x) else { return 0.0 };
        let place = Lattice::from_barycentrics(hit.barycentrics);
        let tree_pdf = self.tree_pdf(leaf, place, x, &lit, splitting);
        let drawn = Drawn { leaf, place, count: 0.0, tree_pdf };
        to_finite(self.mixed_pdf(&drawn, lit.point(place), x, techniques))
    }

    /// Density per solid angle of a point of the triangle in a leaf by the trees.
    pub(super) fn tree_pdf(
        &self,
        leaf: u32,
        place: Lattice,
        x: &ShadingPoint,
        lit: &Lit<'_>,
        splitting: Option<&Splitting>,
    ) -> f64 {
        match self.tree_count(leaf, x, splitting) {
            0.0 => 0.0,
            count => count * follow(self.cells, self.triangles[leaf as usize].root, lit, place).unwrap_or(0.0),
        }
    }
}
