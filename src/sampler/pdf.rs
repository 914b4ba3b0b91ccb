//! Densities of a given point or triangle.

use super::lights::{LightSampler, LightSamplerView};
use super::sample::{follow, to_positive};
use crate::blas::Lattice;
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
        self.leaf(hit.triangle).and_then(|leaf| self.pdf_on(leaf, hit.barycentrics, x, None)).map_or(0.0, to_positive)
    }

    /// Probability with which [`Self::sample`] chooses this triangle, in `[0, 1]`.
    pub fn pmf(&self, x: &ShadingPoint, triangle: TriangleId) -> f32 {
        self.leaf(triangle).map_or(0.0, |leaf| self.tlas.pmf(leaf, x, &self.scene(x)) as f32)
    }

    /// Density per solid angle of a point of the triangle in a leaf, for single or split samples; `None` for zero.
    pub(super) fn pdf_on(
        &self,
        leaf: u32,
        barycentrics: [f32; 2],
        x: &ShadingPoint,
        splitting: Option<&Splitting>,
    ) -> Option<f64> {
        let lit = self.lit(leaf, x)?;
        let scene = self.scene(x);
        let count = match splitting {
            None => self.tlas.pmf(leaf, x, &scene),
            Some(splitting) => self.tlas.expected_count(leaf, x, &scene, splitting),
        };
        if count == 0.0 {
            return None;
        }
        let root = self.triangles[leaf as usize].root;
        Some(count * follow(self.cells, root, &lit, Lattice::from_barycentrics(barycentrics))?)
    }
}
