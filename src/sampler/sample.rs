//! A point on the lights for a shading point.

use glam::DVec3;

use super::lights::{LightSampler, LightSamplerView};
use super::suns::{Crossing, Technique, Techniques};
use crate::blas::{self, Draw, Lattice};
use crate::light::Lit;
use crate::record::{Hit, LightSample, ShadingPoint};
use crate::tlas::Splitting;
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
        let point = [Variate::new(u[1], salt ^ 1), Variate::new(u[2], salt ^ 2)];
        let techniques = self.techniques(x);
        match techniques.choose(&mut choice) {
            Technique::Sun(sun) => self.sample_sun(sun, x, point, &techniques, None),
            Technique::Trees => {
                let (leaf, pmf) = self.tlas.sample(x, &self.scene(x), &mut choice)?;
                self.sample_on(leaf, pmf, x, point, &techniques)
            }
        }
    }

    /// Draws a point on one triangle, which the trees choose with probability (or are expected to visit so often)
    /// `count`.
    pub(super) fn sample_on(
        &self,
        leaf: u32,
        count: f64,
        x: &ShadingPoint,
        u: [Variate; 2],
        techniques: &Techniques,
    ) -> Option<LightSample> {
        let lit = self.lit(leaf, x)?;
        let mut draw = Draw::new(u);
        let root = self.triangles[leaf as usize].root;
        let (cell, cell_pmf) = blas::descend(self.cells, root, lit.vertices, &lit, &mut draw)?;
        let place = draw.point(cell.domain);
        let tree_pdf = count * lit.per_solid_angle(pdf_area(&lit, &cell, cell_pmf), lit.point(place))?;
        self.finish(&Drawn { leaf, place, count, tree_pdf }, &lit, x, techniques)
    }

    /// Draws the point where a direction to a sun first crosses a portal.
    pub(super) fn sample_sun(
        &self,
        sun: usize,
        x: &ShadingPoint,
        u: [Variate; 2],
        techniques: &Techniques,
        splitting: Option<&Splitting>,
    ) -> Option<LightSample> {
        let Crossing { leaf, place, .. } = self.crossing(x, self.environment.sample_sun(sun, u))?;
        let lit = self.lit(leaf, x)?;
        let count = self.tree_count(leaf, x, splitting);
        let tree_pdf = self.tree_pdf(leaf, place, x, &lit, splitting);
        self.finish(&Drawn { leaf, place, count, tree_pdf }, &lit, x, techniques)
    }

    /// Everything that a host wants to know of a point that was drawn.
    fn finish(&self, drawn: &Drawn, lit: &Lit<'_>, x: &ShadingPoint, techniques: &Techniques) -> Option<LightSample> {
        let relative = lit.point(drawn.place);
        let pdf = self.mixed_pdf(drawn, relative, x, techniques);
        let distance = relative.length();
        let positive = pdf > 0.0 && distance > 0.0 && distance.is_finite();
        positive.then(|| LightSample {
            hit: Hit {
                triangle: self.triangles[drawn.leaf as usize].id(),
                barycentrics: drawn.place.to_barycentrics(),
            },
            position: (x.position.as_dvec3() + relative).as_vec3(),
            normal: lit.normal,
            direction: (relative / distance).as_vec3(),
            distance: distance as f32,
            pdf: to_positive(pdf),
            pdf_area: to_positive(pdf * lit.solid_angle_per_area(relative)),
            pmf: to_positive(drawn.count * techniques.trees),
        })
    }

    /// Density per solid angle by all techniques together.
    #[inline]
    pub(super) fn mixed_pdf(&self, drawn: &Drawn, relative: DVec3, x: &ShadingPoint, techniques: &Techniques) -> f64 {
        let by_trees = techniques.trees * drawn.tree_pdf;
        if techniques.is_trees() {
            return by_trees;
        }
        by_trees + self.sun_density(x, relative.normalize_or_zero().as_vec3(), Some(drawn.leaf), techniques)
    }
}

/// A point on a light, and its density by the trees alone.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drawn {
    pub(super) leaf: u32,
    pub(super) place: Lattice,
    /// Probability of the triangle, or expected number of visits.
    pub(super) count: f64,
    /// Per solid angle.
    pub(super) tree_pdf: f64,
}

/// Density per area of the points of a cell that was chosen with this probability.
pub(super) fn pdf_area(lit: &Lit<'_>, cell: &blas::Cell, cell_pmf: f64) -> f64 {
    cell_pmf / (f64::from(lit.area) * f64::from(cell.share()))
}

/// Density per solid angle, on a triangle that is chosen, of a given point.
pub(super) fn follow<const M: usize>(
    cells: &[blas::Block<M>],
    root: blas::Root,
    lit: &Lit<'_>,
    place: Lattice,
) -> Option<f64> {
    let mut guide = blas::Follow::new(place);
    let (cell, cell_pmf) = blas::descend(cells, root, lit.vertices, lit, &mut guide)?;
    lit.per_solid_angle(pdf_area(lit, &cell, cell_pmf), lit.point(place))
}

/// A positive density in single precision: what is positive in double stays so.
pub(super) fn to_positive(pdf: f64) -> f32 {
    (pdf as f32).clamp(f32::MIN_POSITIVE, f32::MAX)
}

/// A density in single precision: zero stays zero, and nothing overflows or vanishes.
pub(super) fn to_finite(pdf: f64) -> f32 {
    if pdf > 0.0 { to_positive(pdf) } else { 0.0 }
}
