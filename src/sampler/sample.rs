//! A point on the lights for a shading point.

use super::lights::{LightSampler, LightSamplerView};
use crate::blas::{self, Draw, Lattice};
use crate::light::Lit;
use crate::record::{Hit, LightSample, ShadingPoint};
use crate::warp::{Variate, seed};

impl<const N: usize, const M: usize> LightSampler<N, M> {
    /// See [`LightSamplerView::sample`].
    #[inline]
    pub fn sample(&self, x: &ShadingPoint, u: [f32; 3]) -> Option<LightSample> {
        self.as_view().sample(x, u)
    }
}

impl<const N: usize, const M: usize> LightSamplerView<'_, N, M> {
    /// Draws a point on the lights. `u` is uniform in `[0, 1)³`: the first chooses the triangle, the other two the
    /// point on it, so that stratified pairs stay stratified.
    ///
    /// `None` where nothing can arrive from the part of the lights that `u` leads to; such a `u` counts as a sample
    /// of zero. The densities of all points integrate to the probability of not getting `None`.
    pub fn sample(&self, x: &ShadingPoint, u: [f32; 3]) -> Option<LightSample> {
        let salt = seed(&u);
        let mut choice = Variate::new(u[0], salt);
        let (leaf, pmf) = self.tlas.sample(x, &self.scene(x), &mut choice)?;
        self.sample_on(leaf, pmf, x, [Variate::new(u[1], salt ^ 1), Variate::new(u[2], salt ^ 2)])
    }

    /// Draws a point on one triangle, which was chosen with probability (or expected so often) `pmf`.
    pub(super) fn sample_on(&self, leaf: u32, pmf: f64, x: &ShadingPoint, u: [Variate; 2]) -> Option<LightSample> {
        let lit = self.lit(leaf, x)?;
        let triangle = &self.triangles[leaf as usize];
        let mut draw = Draw::new(u);
        let (cell, cell_pmf) = blas::descend(self.cells, triangle.root, lit.vertices, &lit, &mut draw)?;
        let place = draw.point(cell.domain);
        let pdf_area = pmf * pdf_area(&lit, &cell, cell_pmf);
        let relative = lit.point(place);
        let pdf = lit.per_solid_angle(pdf_area, relative)?;
        let distance = relative.length();
        Some(LightSample {
            hit: Hit { triangle: triangle.id(), barycentrics: place.to_barycentrics() },
            position: x.position + relative,
            normal: lit.normal,
            direction: relative / distance,
            distance,
            pdf: to_positive(pdf),
            pdf_area: to_positive(pdf_area),
            pmf: to_positive(pmf),
        })
    }
}

/// Density per area of the points of a cell that was chosen with this probability.
pub(super) fn pdf_area(lit: &Lit<'_>, cell: &blas::Cell, cell_pmf: f64) -> f64 {
    cell_pmf / (f64::from(lit.area) * f64::from(cell.share()))
}

/// Density per area, and place relative to the shading point, of a given point of a triangle.
pub(super) fn follow<const M: usize>(
    cells: &[blas::Node<M>],
    root: blas::Root,
    lit: &Lit<'_>,
    place: Lattice,
) -> Option<f64> {
    let mut guide = blas::Follow::new(place);
    let (cell, cell_pmf) = blas::descend(cells, root, lit.vertices, lit, &mut guide)?;
    let pdf_area = pdf_area(lit, &cell, cell_pmf);
    lit.per_solid_angle(pdf_area, lit.point(place))
}

/// A positive density in single precision: what is positive in double stays so.
pub(super) fn to_positive(pdf: f64) -> f32 {
    (pdf as f32).clamp(f32::MIN_POSITIVE, f32::MAX)
}
