//! Where light leaves a light, with no receiver to weigh it for: by the averages of the texture alone.

use core::f32::consts::{FRAC_1_PI, TAU};

use glam::{DVec3, Vec3};

use super::{Light, LightKind, LightLeaf, LightPoint, LightTriangle, LightsView, LocalPoint};
use crate::blas::{self, ARITY, CellNode, CellTarget, Draw, Follow, Guide, Lattice, LatticeCell};
use crate::math;
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

/// A ray in which light leaves a light, drawn by the light's own weights.
pub(crate) struct EmittedRay {
    pub(crate) point: LocalPoint,
    /// World position that the ray starts from.
    pub(crate) position: DVec3,
    /// Unit normal of the front side; for a lamp without an extent, the direction.
    pub(crate) normal: Vec3,
    /// Unit vector.
    pub(crate) direction: Vec3,
    /// Density per area perpendicular to the direction and per solid angle; for a lamp without an extent, per solid
    /// angle alone.
    pub(crate) pdf: f64,
}

impl EmittedRay {
    /// Returns a ray from a light without an extent.
    pub(super) fn from_point(position: Vec3, direction: Vec3, pdf: f64) -> Self {
        Self { point: LocalPoint::NONE, position: position.as_dvec3(), normal: direction, direction, pdf }
    }
}

impl LightsView<'_> {
    /// Draws a ray in which light leaves a light in all directions; `None` for a light that is switched off. `side`
    /// chooses the side of a light of two sides.
    pub(crate) fn emit(
        &self,
        leaf: LightLeaf,
        point: [Variate; 2],
        direction: [Variate; 2],
        side: f64,
    ) -> Option<EmittedRay> {
        if let Light::Lamp(lamp) = self.light(leaf.top) {
            return (lamp.weight() > 0.0).then(|| lamp.emit(point, direction, side));
        }
        let EmissionStart { point, position, normal, two_sided, pdf_area } = self.sample_start(leaf, point)?;
        let pdf = pdf_area * per_direction(two_sided);
        let ray = cosine_ray(position, normal, two_sided && side < 0.5, direction, pdf);
        Some(EmittedRay { point: LocalPoint::on_triangle(point), ..ray })
    }

    /// Returns the density with which [`Self::emit`] draws the ray from a given point of a light in a unit direction.
    pub(crate) fn emission_pdf(&self, LightPoint { leaf, point }: LightPoint, direction: Vec3) -> f64 {
        if let Light::Lamp(lamp) = self.light(leaf.top) {
            return if lamp.weight() > 0.0 { lamp.emission_pdf(direction) } else { 0.0 };
        }
        let Some(start) = self.start_at(leaf, point) else { return 0.0 };
        if !start.two_sided && start.normal.dot(direction) <= 0.0 {
            return 0.0;
        }
        start.pdf_area * per_direction(start.two_sided)
    }

    /// Draws a point of a triangle that light leaves from; `None` for one that is switched off, and for a lamp.
    pub(crate) fn sample_start(&self, leaf: LightLeaf, u: [Variate; 2]) -> Option<EmissionStart> {
        self.start(leaf, &mut Draw::new(u), Draw::point)
    }

    /// Returns a given point of a triangle with the density with which [`Self::sample_start`] draws it.
    pub(crate) fn start_at(&self, leaf: LightLeaf, point: LocalPoint) -> Option<EmissionStart> {
        let point = point.lattice();
        self.start(leaf, &mut Follow::new(point), |_, _| point)
    }

    fn start<G: Guide>(
        &self,
        leaf: LightLeaf,
        guide: &mut G,
        point: impl Fn(&G, LatticeCell) -> Lattice,
    ) -> Option<EmissionStart> {
        if self.scale(leaf) == 0.0 {
            return None;
        }
        match self.light(leaf.top) {
            Light::Triangle(light) => {
                let triangle = light.triangle();
                let shape = (triangle.normal_and_area()?, triangle.exactly_relative_to(Vec3::ZERO));
                start_on_triangle(light, shape, self.cells, guide, point)
            }
            Light::Lamp(_) => None,
            Light::Moving(triangle) => {
                let shape = (triangle.normal_and_area()?, triangle.exactly_relative_to(Vec3::ZERO));
                start_on_triangle(triangle.record, shape, self.cells, guide, point)
            }
            Light::Instance(placed) => {
                let triangle = placed.triangle(leaf.below()?);
                let shape = (triangle.normal_and_area()?, triangle.exactly_relative_to(Vec3::ZERO));
                start_on_triangle(triangle.record, shape, self.cells, guide, point)
            }
        }
    }
}

/// Returns a point of a triangle of which normal, area and vertices are given.
fn start_on_triangle<G: Guide>(
    light: &LightTriangle,
    ((normal, area), [v0, v1, v2]): ((Vec3, f32), [DVec3; 3]),
    cells: &[CellNode],
    guide: &mut G,
    point: impl Fn(&G, LatticeCell) -> Lattice,
) -> Option<EmissionStart> {
    let (cell, pmf) = blas::descend(cells, light.root, &Everywhere, guide)?;
    let point = point(guide, cell);
    let [b1, b2] = point.to_barycentrics().map(f64::from);
    Some(EmissionStart {
        point,
        position: v0 * (1.0 - b1 - b2) + v1 * b1 + v2 * b2,
        normal,
        two_sided: light.is_two_sided(),
        pdf_area: pmf / (f64::from(area) * f64::from(cell.area())),
    })
}

/// Density of cosine-distributed directions over the cosine: from one side, or evenly from two.
pub(super) fn per_direction(two_sided: bool) -> f64 {
    f64::from(if two_sided { 0.5 * FRAC_1_PI } else { FRAC_1_PI })
}

/// Returns a ray from a point of a surface whose direction is distributed by the cosine to one of its sides. The
/// density is that of the point times [`per_direction`].
pub(super) fn cosine_ray(position: DVec3, normal: Vec3, is_back: bool, u: [Variate; 2], pdf: f64) -> EmittedRay {
    let direction = cosine_direction(if is_back { -normal } else { normal }, u);
    EmittedRay { point: LocalPoint::from_direction(direction), position, normal, direction, pdf }
}

/// Returns a direction around a unit normal with a density of its cosine over π (Malley's method; pbrt, section A.5.3).
fn cosine_direction(normal: Vec3, u: [Variate; 2]) -> Vec3 {
    let [u1, u2] = u.map(|u| u.value_f32());
    let (sin_phi, cos_phi) = math::sin_cos(TAU * u2);
    let radius = math::sqrt(u1);
    // Never quite in the plane.
    let height = math::sqrt(1.0 - u1).max(f32::EPSILON);
    let (s, t) = normal.any_orthonormal_pair();
    (s * (radius * cos_phi) + t * (radius * sin_phi) + normal * height).normalize()
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
