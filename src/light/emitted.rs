//! Where light leaves a light, with no receiver to weigh it for: by the averages of the texture alone.

use glam::{DVec3, Vec3};

use super::{Light, LightKind, LightTriangle, LightsView};
use crate::blas::{self, ARITY, CellNode, CellTarget, Draw, Follow, Guide, Lattice, LatticeCell};
use crate::warp::Variate;

/// A point that light leaves from, drawn by the light's own weights.
pub(crate) struct EmissionStart {
    pub(crate) point: Lattice,
    /// World position.
    pub(crate) position: DVec3,
    /// Unit normal of the front side.
    pub(crate) normal: Vec3,
    pub(crate) two_sided: bool,
    /// Density per area of the light.
    pub(crate) pdf_area: f64,
}

impl LightsView<'_> {
    /// Draws a point that light leaves from; `None` for a light that is switched off.
    pub(crate) fn sample_start(&self, leaf: u32, u: [Variate; 2]) -> Option<EmissionStart> {
        self.start(leaf, &mut Draw::new(u), Draw::point)
    }

    /// Returns a given point of a light with the density with which [`Self::sample_start`] draws it.
    pub(crate) fn start_at(&self, leaf: u32, point: Lattice) -> Option<EmissionStart> {
        self.start(leaf, &mut Follow::new(point), |_, _| point)
    }

    fn start<G: Guide>(
        &self,
        leaf: u32,
        guide: &mut G,
        point: impl Fn(&G, LatticeCell) -> Lattice,
    ) -> Option<EmissionStart> {
        if self.scale(leaf) == 0.0 {
            return None;
        }
        match self.light(leaf) {
            Light::Triangle(triangle) => start_on_triangle(triangle, self.cells, guide, point),
        }
    }
}

fn start_on_triangle<G: Guide>(
    light: &LightTriangle,
    cells: &[CellNode],
    guide: &mut G,
    point: impl Fn(&G, LatticeCell) -> Lattice,
) -> Option<EmissionStart> {
    let triangle = light.triangle();
    let (normal, area) = triangle.normal_and_area()?;
    let (cell, pmf) = blas::descend(cells, light.root, &Everywhere, guide)?;
    let point = point(guide, cell);
    let [b1, b2] = point.to_barycentrics().map(f64::from);
    let [v0, v1, v2] = triangle.exactly_relative_to(Vec3::ZERO);
    Some(EmissionStart {
        point,
        position: v0 * (1.0 - b1 - b2) + v1 * b1 + v2 * b2,
        normal,
        two_sided: light.is_two_sided(),
        pdf_area: pmf / (f64::from(area) * f64::from(cell.area())),
    })
}

/// A target for which all cells of the same average weigh the same.
struct Everywhere;

impl CellTarget for Everywhere {
    type Cell = ();

    fn whole(&self) {}

    fn child(&self, (): &(), _index: usize) {}

    #[inline(always)]
    fn weigh_children(&self, _at: LatticeCell, (): &(), _averages: &[f32; ARITY], weights: &mut [f32; ARITY]) {
        *weights = [1.0; ARITY];
    }

    #[inline(always)]
    fn is_final(&self, _at: LatticeCell, (): &mut (), _levels: Option<u32>) -> bool {
        true
    }
}
