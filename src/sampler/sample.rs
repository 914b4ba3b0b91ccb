//! A point on the lights for a shading point.

use super::at::PointSampler;
use super::techniques::Technique;
use crate::blas::{self, Draw, Lattice};
use crate::light::Lit;
use crate::record::{Hit, LightSample};
use crate::tlas::Splitting;
use crate::warp::{Variate, seed};

impl<const N: usize> PointSampler<'_, N> {
    /// Draws a point on the lights. `u` is uniform in `[0, 1)³`: the first chooses the triangle, the other two the
    /// point on it, so that stratified pairs stay stratified.
    ///
    /// `None` where nothing can arrive from the part of the lights that `u` leads to; such a `u` counts as a sample
    /// of zero. The densities of all points integrate to the probability of not getting `None`.
    pub fn sample(&self, u: [f32; 3]) -> Option<LightSample> {
        let [mut choice, point @ ..] = variates(u);
        match self.techniques.choose(&mut choice) {
            Technique::Sun(sun) => self.sample_sun(sun, point, None),
            Technique::Trees => {
                let scene = self.lights.scene(&self.x);
                let (leaf, pmf) = self.lights.tlas.sample(&self.x, &scene, self.first_weights.as_ref(), choice)?;
                self.sample_on(leaf, pmf, point)
            }
        }
    }

    /// Draws a point on one triangle, which the trees choose with probability (or are expected to visit so often)
    /// `count`.
    pub(super) fn sample_on(&self, leaf: u32, count: f64, u: [Variate; 2]) -> Option<LightSample> {
        // By reference: what `?` moves is copied.
        let lit = &self.lights.lit(leaf, &self.x);
        let lit = lit.as_ref()?;
        let mut draw = Draw::new(u);
        let root = self.lights.triangles[leaf as usize].root;
        let (cell, cell_pmf) = blas::descend(self.lights.cells, root, lit, &mut draw)?;
        let place = draw.point(cell);
        let tree_pdf = count * lit.per_solid_angle(pdf_area(lit, cell, cell_pmf), lit.point(place))?;
        self.finish(&Drawn { leaf, place, count, tree_pdf }, lit)
    }

    /// Draws a point on a portal towards a sun.
    pub(super) fn sample_sun(&self, sun: usize, u: [Variate; 2], splitting: Option<&Splitting>) -> Option<LightSample> {
        let (leaf, place) = self.sun_point(sun, u)?;
        let lit = self.lights.lit(leaf, &self.x)?;
        let count = self.tree_count(leaf, splitting);
        let tree_pdf = self.tree_pdf(leaf, count, place, &lit);
        self.finish(&Drawn { leaf, place, count, tree_pdf }, &lit)
    }

    /// Everything that a host wants to know of a point that was drawn.
    fn finish(&self, drawn: &Drawn, lit: &Lit<'_>) -> Option<LightSample> {
        let relative = lit.point(drawn.place);
        let pdf = self.mixed_pdf(drawn, lit);
        let distance = relative.length();
        let positive = pdf > 0.0 && distance > 0.0 && distance.is_finite();
        positive.then(|| LightSample {
            hit: Hit { triangle: self.lights.id(drawn.leaf), barycentrics: drawn.place.to_barycentrics() },
            position: (self.x.position.as_dvec3() + relative).as_vec3(),
            normal: lit.normal,
            direction: (relative / distance).as_vec3(),
            distance: distance as f32,
            pdf: to_positive(pdf),
            pdf_area: to_positive(pdf * lit.solid_angle_per_area(relative)),
            pmf: to_positive(drawn.count * self.techniques.trees),
        })
    }

    /// Density per solid angle by all techniques together.
    #[inline]
    pub(super) fn mixed_pdf(&self, drawn: &Drawn, lit: &Lit<'_>) -> f64 {
        self.techniques.trees * drawn.tree_pdf + self.sun_pdf(drawn.leaf, drawn.place, lit)
    }
}

/// For the triangle, and for the point on it.
pub(super) fn variates(u: [f32; 3]) -> [Variate; 3] {
    let salt = seed(&u);
    [Variate::new(u[0], salt), Variate::new(u[1], salt ^ 1), Variate::new(u[2], salt ^ 2)]
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
pub(super) fn pdf_area(lit: &Lit<'_>, cell: blas::LatticeCell, cell_pmf: f64) -> f64 {
    cell_pmf / (f64::from(lit.area) * f64::from(cell.area()))
}

/// Density per solid angle, on a triangle that is chosen, of a given point.
pub(super) fn follow(cells: &[blas::CellBlock], root: blas::Root, lit: &Lit<'_>, place: Lattice) -> Option<f64> {
    let mut guide = blas::Follow::new(place);
    let (cell, cell_pmf) = blas::descend(cells, root, lit, &mut guide)?;
    lit.per_solid_angle(pdf_area(lit, cell, cell_pmf), lit.point(place))
}

/// A positive density in single precision: what is positive in double stays so.
pub(super) fn to_positive(pdf: f64) -> f32 {
    (pdf as f32).clamp(f32::MIN_POSITIVE, f32::MAX)
}

/// A density in single precision: zero stays zero, and nothing overflows or vanishes.
pub(super) fn to_finite(pdf: f64) -> f32 {
    if pdf > 0.0 { to_positive(pdf) } else { 0.0 }
}
