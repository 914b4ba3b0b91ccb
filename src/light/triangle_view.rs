//! A triangle as seen from a shading point: the target that its cells are chosen by.

use core::f32::consts::PI;

use glam::{DVec3, Vec3};

use super::cell_kernel::CellDescent;
use super::{Illumination, LightKind, LightTriangle, LightViewKind};
use crate::blas::{CellNode, Draw, Follow, Guide, Lattice, LatticeCell, Root};
use crate::env::{DirectionCone, EnvironmentView};
use crate::geometry;
use crate::math;
use crate::receiver::{Receiver, ReceiverKind, ShadingPoint};
use crate::simd::InstructionSet;
use crate::warp::Variate;

/// Largest coordinate of a shading point that anything arrives at.
///
/// Proved: squares of distances, 1e30, are finite, and so are their products with weights of up to 1e8.
const FARTHEST_POINT: f32 = 1e15;

/// A triangle is close if its squared radius is more than this many times the squared distance from its plane.
///
/// Measured on star (docs/ACCURACY.md, "Where it is still weak"): it decides where the trees get a fifth of the samples next
/// to bright features. Larger values miss points close to a card, smaller ones waste samples at a distance.
const CLOSE_RATIO: f32 = 256.0;

/// A light triangle seen from a shading point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangleView<'a> {
    pub(super) receiver: Receiver,
    /// Vertices relative to the shading point.
    pub(super) vertices: [Vec3; 3],
    /// Vertices relative to the shading point, in double precision.
    exact_vertices: [DVec3; 3],
    /// Unit normal of the front side.
    normal: Vec3,
    pub(super) area: f32,
    /// Distance of the shading point from the triangle's plane.
    pub(super) height: f32,
    /// Distance of the shading point from the triangle's plane, in double precision.
    exact_height: f64,
    /// Squared distance of the farthest vertex from the centroid.
    pub(super) radius2: f32,
    /// Normal of the receiver; zero without one.
    pub(super) receiver_normal: Vec3,
    /// Height over the receiver's plane below which a vertex is below it for certain.
    pub(super) horizon: f32,
    /// Height of the highest vertex above or below the receiver's plane.
    pub(super) highest: f32,
    pub(super) illumination: Illumination,
    /// What the triangle is a portal to, if that depends on the direction.
    pub(super) environment: Option<&'a EnvironmentView<'a>>,
    /// The tree over the texture.
    pub(crate) root: Root,
    /// Nodes of the trees over textures.
    pub(crate) cells: &'a [CellNode],
}

impl<'a> TriangleView<'a> {
    /// Returns the view from a shading point, or `None` where nothing can arrive.
    #[inline]
    pub(super) fn new(
        light: &LightTriangle,
        x: &ShadingPoint,
        illumination: Illumination,
        cells: &'a [CellNode],
        environment: Option<&'a EnvironmentView<'a>>,
    ) -> Option<Self> {
        // NaN fails.
        let is_near = x.position.to_array().iter().all(|x| x.abs() <= FARTHEST_POINT);
        let triangle = light.triangle();
        let (exact_vertices, vertices) = (triangle.exactly_relative_to(x.position), triangle.relative_to(x.position));
        let cross = triangle.double_area_vector();
        let side = cross.dot(exact_vertices[0]);
        if !(is_near && light.emits_to(side) && !x.receiver.is_dark(&vertices)) {
            return None;
        }
        let double_area = math::sqrt64(cross.length_squared());
        let (normal, area) = geometry::normal_and_area(cross, double_area)?;
        let height = side.abs() / double_area;
        let [a, b, c] = vertices;
        let center = (a + b + c) * (1.0 / 3.0);
        let receiver_normal = x.receiver.normal();
        Some(Self {
            receiver: x.receiver,
            vertices,
            radius2: vertices.iter().fold(0.0, |r: f32, v| r.max((*v - center).length_squared())),
            receiver_normal,
            horizon: geometry::horizon(receiver_normal, &vertices),
            highest: vertices.iter().fold(0.0, |h: f32, v| h.max(receiver_normal.dot(*v).abs())),
            exact_vertices,
            normal,
            area,
            height: height as f32,
            exact_height: height,
            illumination,
            environment: environment.filter(|_| light.is_portal()),
            root: light.root,
            cells,
        })
    }

    /// Returns the vertices relative to the shading point.
    pub(crate) fn vertices(&self) -> &[Vec3; 3] {
        &self.vertices
    }

    /// Whether the shading point is almost in the triangle's plane.
    pub(crate) fn is_close(&self) -> bool {
        self.radius2 > CLOSE_RATIO * self.height * self.height
    }

    /// Returns the point where a ray from the shading point crosses the triangle.
    pub(crate) fn intersect(&self, direction: Vec3) -> Option<Lattice> {
        geometry::intersect(self.exact_vertices, direction).map(Lattice::from_barycentrics)
    }

    /// Descends to a cell of about constant density. Returns it with its probability.
    #[inline(always)]
    fn descend(&self, guide: &mut impl Guide) -> Option<(LatticeCell, f64)> {
        InstructionSet::best().run(CellDescent { view: self, guide })
    }

    /// Returns the density per solid angle of a point of a cell that was chosen with this probability, `p_A d² / cos θl`.
    /// `None` where it is not a positive number.
    #[inline]
    fn pdf_in(&self, cell: LatticeCell, cell_pmf: f64, point: Lattice) -> Option<f64> {
        let pdf_area = cell_pmf / (f64::from(self.area) * f64::from(cell.area()));
        let pdf = pdf_area / self.solid_angle_per_area(self.point(point));
        (pdf > 0.0 && pdf.is_finite()).then_some(pdf)
    }
}

impl LightViewKind for TriangleView<'_> {
    #[inline(always)]
    fn sample(&self, u: [Variate; 2]) -> Option<(Lattice, f64)> {
        let mut draw = Draw::new(u);
        let (cell, cell_pmf) = self.descend(&mut draw)?;
        let point = draw.point(cell);
        Some((point, self.pdf_in(cell, cell_pmf, point)?))
    }

    #[inline]
    fn pdf(&self, point: Lattice) -> Option<f64> {
        let (cell, cell_pmf) = self.descend(&mut Follow::new(point))?;
        self.pdf_in(cell, cell_pmf, point)
    }

    /// Returns a point in double precision, as it may be much nearer than the vertices.
    #[inline]
    fn point(&self, point: Lattice) -> DVec3 {
        let [b1, b2] = point.to_barycentrics().map(f64::from);
        let [v0, v1, v2] = self.exact_vertices;
        v0 * (1.0 - b1 - b2) + v1 * b1 + v2 * b2
    }

    #[inline]
    fn normal(&self) -> Vec3 {
        self.normal
    }

    #[inline]
    fn solid_angle_per_area(&self, point: DVec3) -> f64 {
        let distance2 = point.length_squared();
        self.exact_height / (distance2 * math::sqrt64(distance2))
    }

    fn irradiance(&self, scale: f32) -> f32 {
        let radiance = self.environment.map_or(1.0, |environment| {
            let [a, b, c] = self.vertices;
            let center = (a + b + c) * (1.0 / 3.0);
            let least = (self.height * self.height).max(f32::MIN_POSITIVE);
            let inverse = 1.0 / math::sqrt(center.length_squared().max(least));
            let cone = DirectionCone {
                direction: center * inverse,
                sin_radius: math::sqrt(self.radius2) * inverse,
                solid_angle: self.area * self.height * inverse * inverse * inverse,
            };
            environment.estimate_radiance(&cone).value
        });
        PI * self.root.average * scale * self.estimate(LatticeCell::whole()) * radiance
    }
}
