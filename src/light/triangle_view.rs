//! A triangle as seen from a shading point.

use glam::{DVec3, Vec3};

use super::{Illumination, LightKind, LightTriangle, MovingTriangle, PlacedTriangle};
use crate::blas::{CellNode, Lattice, Root};
use crate::env::EnvironmentView;
use crate::geometry;
use crate::math;
use crate::receiver::{Effort, Receiver, ReceiverKind, ShadingPoint};
use crate::warp::equal_area::sphere_to_square_quickly;

/// Largest coordinate of a shading point that anything arrives at. *Format*: documented at
/// [`ShadingPoint::position`](crate::ShadingPoint::position).
///
/// *Proved* to be small enough: squares of distances, 1e30, are finite, and so are their products with weights of up to
/// 1e8.
pub(crate) const FARTHEST_POINT: f32 = 1e15;

/// A triangle is close if its squared radius is more than this many times the squared distance from its plane.
///
/// Measured on star (docs/ACCURACY.md, "Where it is still weak"): it decides where the trees get a fifth of the samples
/// next to bright features. Larger values miss points close to a card, smaller ones waste samples at a distance.
const CLOSE_RATIO: f32 = 256.0;

/// Ratio of the height over a triangle to its radius from which the lattice resolves directions: 8 units of the
/// lattice. Chosen, not swept.
///
/// Larger: directions are drawn uniformly, with a relative deviation of 0.58, where they could be drawn by weight.
/// Smaller: rounding to the lattice would bias samples.
const RESOLVED_HEIGHT: f64 = 8.0 / 16_777_216.0;

/// How far rounding to the lattice moves a point along both edges, in units of the edges. *Proved*: half a unit of the
/// lattice, and one more next to the triangle's own edges.
///
/// Larger: points below the horizon would have a density. Smaller: points that were drawn would have none.
const LATTICE_ROUNDING: f64 = 2.0 / 16_777_216.0;

/// A light triangle seen from a shading point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangleView<'a> {
    pub(super) receiver: Receiver,
    /// Vertices relative to the shading point.
    pub(super) vertices: [Vec3; 3],
    /// Vertices relative to the shading point, in double precision.
    pub(super) exact_vertices: [DVec3; 3],
    /// Determinant of the vertices, by exact differences: negative in front, but for mirror images.
    pub(super) determinant: f64,
    /// Unit normal of the front side.
    pub(super) normal: Vec3,
    pub(super) area: f32,
    /// Distance of the shading point from the triangle's plane.
    pub(super) height: f32,
    /// Distance of the shading point from the triangle's plane, in double precision.
    pub(super) exact_height: f64,
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
    pub(crate) effort: Effort,
    /// The tree over the texture.
    pub(crate) root: Root,
    /// Nodes of the trees over textures.
    pub(crate) cells: &'a [CellNode],
}

impl<'a> TriangleView<'a> {
    /// Returns the view from a shading point, or `None` where nothing can arrive. `wrap` makes the view into what is
    /// wanted before it is written anywhere: a view is large.
    #[inline]
    pub(super) fn wrapped<V>(
        light: &LightTriangle,
        x: &ShadingPoint,
        illumination: Illumination,
        cells: &'a [CellNode],
        environment: Option<&'a EnvironmentView<'a>>,
        wrap: impl FnOnce(Self) -> V,
    ) -> Option<V> {
        let triangle = light.triangle();
        let relative = (triangle.exactly_relative_to(x.position), triangle.relative_to(x.position));
        Self::of_vertices(light, relative, triangle.double_area_vector(), x, illumination, cells, environment, wrap)
    }

    /// Returns the view of a triangle of an instance.
    pub(super) fn placed<V>(
        triangle: &PlacedTriangle<'_>,
        x: &ShadingPoint,
        illumination: Illumination,
        cells: &'a [CellNode],
        environment: Option<&'a EnvironmentView<'a>>,
        wrap: impl FnOnce(Self) -> V,
    ) -> Option<V> {
        let exact = triangle.exactly_relative_to(x.position);
        let relative = (exact, exact.map(|vertex| vertex.as_vec3()));
        let front = triangle.double_area_vector();
        // The order of the vertices is the object's own, whichever way it runs around the front.
        let turn = if triangle.is_mirrored() { -1.0 } else { 1.0 };
        let wrap = |view: Self| wrap(Self { determinant: turn * view.determinant, ..view });
        Self::of_vertices(triangle.record, relative, front, x, illumination, cells, environment, wrap)
    }

    /// Returns the view of a triangle at its time.
    pub(super) fn moving<V>(
        triangle: &MovingTriangle<'_>,
        x: &ShadingPoint,
        illumination: Illumination,
        cells: &'a [CellNode],
        environment: Option<&'a EnvironmentView<'a>>,
        wrap: impl FnOnce(Self) -> V,
    ) -> Option<V> {
        let exact = triangle.exactly_relative_to(x.position);
        let relative = (exact, exact.map(|vertex| vertex.as_vec3()));
        let front = triangle.double_area_vector();
        Self::of_vertices(triangle.record, relative, front, x, illumination, cells, environment, wrap)
    }

    /// Returns the view of a triangle by its vertices relative to the shading point and the normal of its front times
    /// twice its area.
    #[expect(clippy::too_many_arguments, reason = "a struct would be copied")]
    #[inline(always)]
    fn of_vertices<V>(
        light: &LightTriangle,
        (exact_vertices, vertices): ([DVec3; 3], [Vec3; 3]),
        cross: DVec3,
        x: &ShadingPoint,
        illumination: Illumination,
        cells: &'a [CellNode],
        environment: Option<&'a EnvironmentView<'a>>,
        wrap: impl FnOnce(Self) -> V,
    ) -> Option<V> {
        // NaN fails.
        let is_near = x.position.to_array().iter().all(|x| x.abs() <= FARTHEST_POINT);
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
        Some(wrap(Self {
            receiver: x.receiver,
            vertices,
            radius2: vertices.iter().fold(0.0, |r: f32, v| r.max((*v - center).length_squared())),
            receiver_normal,
            horizon: geometry::horizon(receiver_normal, &vertices),
            highest: vertices.iter().fold(0.0, |h: f32, v| h.max(receiver_normal.dot(*v).abs())),
            exact_vertices,
            determinant: side,
            normal,
            area,
            height: height as f32,
            exact_height: height,
            illumination,
            environment: environment.filter(|_| light.is_portal()),
            effort: x.effort,
            root: light.root,
            cells,
        }))
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

    /// Returns a point relative to the shading point, in double precision, as it may be much nearer than the vertices.
    #[inline]
    pub(crate) fn position(&self, point: Lattice) -> DVec3 {
        let [b1, b2] = point.to_barycentrics().map(f64::from);
        let [v0, v1, v2] = self.exact_vertices;
        v0 * (1.0 - b1 - b2) + v1 * b1 + v2 * b2
    }

    /// Whether what is seen through a portal is about constant over it.
    #[inline]
    pub(super) fn has_constant_radiance(&self, center: Vec3, distance2: f32) -> bool {
        self.followed_environment().is_none_or(|environment| {
            let inverse = 1.0 / math::sqrt(distance2);
            let solid_angle = self.area * self.height * (inverse * inverse * inverse);
            let direction = environment.local_direction(center * inverse);
            environment.is_about_constant(sphere_to_square_quickly(direction.to_array()), solid_angle)
        })
    }

    /// Whether a point is below the horizon, and not only by rounding to the lattice.
    #[inline(always)]
    pub(super) fn is_below_horizon(&self, point: DVec3) -> bool {
        let normal = self.receiver_normal.as_dvec3();
        let [a, b, c] = self.exact_vertices;
        let step = normal.dot(b - a).abs() + normal.dot(c - a).abs();
        self.receiver.has_horizon() && normal.dot(point) < -LATTICE_ROUNDING * step
    }

    /// What points are drawn by beside the triangle itself, if that depends on the direction.
    #[inline(always)]
    pub(super) fn followed_environment(&self) -> Option<&'a EnvironmentView<'a>> {
        self.environment.filter(|_| self.effort != Effort::Least)
    }

    /// Whether all directions to what is visible of a triangle without a texture are equally likely.
    #[inline(always)]
    pub(super) fn draws_uniformly(&self) -> bool {
        let is_even = matches!(self.receiver, Receiver::Volume) && self.environment.is_none();
        is_even || self.effort == Effort::Least || !self.resolves_directions()
    }

    /// Whether the lattice resolves directions.
    #[inline(always)]
    pub(super) fn resolves_directions(&self) -> bool {
        self.exact_height >= RESOLVED_HEIGHT * f64::from(math::sqrt(self.radius2))
    }
}
