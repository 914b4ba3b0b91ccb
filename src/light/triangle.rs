//! One light triangle, and the same as it is seen from a shading point.

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};

use super::illumination::{Illumination, horizon, is_below};
use crate::blas::{Lattice, Root};
use crate::env::EnvironmentView;
use crate::geometry::{self, Triangle};
use crate::math;
use crate::record::{Receiver, ShadingPoint};

/// Largest coordinate of a vertex: squares of squares of distances must not overflow where the tree is built.
pub(crate) const POSITION_LIMIT: f32 = 1e9;

/// Largest coordinate of a shading point that anything arrives at: squares of distances must not overflow.
const FAR: f32 = 1e15;

/// A triangle is close if its squared radius is more than so many times the squared distance from its plane.
const CLOSE: f32 = 256.0;

/// What is kept of every triangle that can send light.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct LightTriangle {
    /// Counter-clockwise around the front side.
    pub(crate) vertices: [[f32; 3]; 3],
    /// The tree over its texture.
    pub(crate) root: Root,
    /// Its number among all triangles that were added, and [`Self::TWO_SIDED`] and [`Self::PORTAL`].
    pub(crate) place_and_flags: u32,
}

const _: () = assert!(size_of::<LightTriangle>() == 48);

impl LightTriangle {
    /// Sends from its back as well.
    pub(crate) const TWO_SIDED: u32 = 1 << 31;
    /// Shows the environment behind it.
    pub(crate) const PORTAL: u32 = 1 << 30;

    #[inline]
    pub(crate) fn triangle(&self) -> Triangle {
        Triangle(self.vertices.map(Vec3::from))
    }

    /// Its number among all triangles that were added.
    pub(crate) fn place(&self) -> u32 {
        self.place_and_flags & !(Self::TWO_SIDED | Self::PORTAL)
    }

    pub(crate) fn is_two_sided(&self) -> bool {
        self.place_and_flags & Self::TWO_SIDED != 0
    }

    pub(crate) fn is_portal(&self) -> bool {
        self.place_and_flags & Self::PORTAL != 0
    }

    /// Whether the numbers, which may come from outside, are those of a triangle.
    pub(crate) fn is_valid(&self) -> bool {
        let in_range = self.vertices.as_flattened().iter().all(|x| x.abs() <= POSITION_LIMIT);
        in_range && self.root.average > 0.0
    }

    /// Whether anything can travel from the triangle to the shading point: the point is on a side that sends, and
    /// some of the triangle is above its horizon.
    #[inline]
    pub(crate) fn is_visible(&self, x: &ShadingPoint) -> bool {
        let triangle = self.triangle();
        let side = triangle.double_area_vector().dot(triangle.exactly_relative_to(x.position)[0]);
        self.sends_to(side) && is_above(&triangle.relative_to(x.position), x.receiver)
    }

    /// Whether it sends to points on a side. Negative is the front; anything but a number is no side.
    #[inline]
    fn sends_to(&self, side: f64) -> bool {
        side < 0.0 || (side > 0.0 && self.is_two_sided())
    }
}

/// Whether any of the vertices, which are relative to it, may be above a receiver's horizon.
#[inline]
fn is_above(vertices: &[Vec3; 3], receiver: Receiver) -> bool {
    match receiver {
        Receiver::Surface(normal) => !is_below(normal, vertices),
        Receiver::Transmissive(_) | Receiver::Volume => true,
    }
}

/// A light triangle seen from a shading point: the target that its cells are chosen by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lit<'a> {
    pub(super) receiver: Receiver,
    /// Relative to the shading point.
    pub(crate) vertices: [Vec3; 3],
    /// The same in double precision.
    exact_vertices: [DVec3; 3],
    /// Unit normal of the front side.
    pub(crate) normal: Vec3,
    pub(crate) area: f32,
    /// Distance of the shading point from the triangle's plane.
    pub(super) height: f32,
    /// The same in double precision.
    exact_height: f64,
    /// Squared distance of the farthest vertex from the centroid.
    pub(super) radius2: f32,
    /// The receiver's, if it has one.
    pub(super) normal_of_receiver: Vec3,
    /// See [`horizon`].
    pub(super) horizon: f32,
    /// Of the vertices over the receiver's plane.
    pub(super) highest: f32,
    pub(super) illumination: Illumination,
    /// What the triangle is a portal to, if that depends on the direction.
    pub(super) environment: Option<&'a EnvironmentView<'a>>,
}

impl<'a> Lit<'a> {
    /// The view from a shading point, or `None` where nothing can arrive.
    #[inline]
    pub(crate) fn new(
        light: &LightTriangle,
        x: &ShadingPoint,
        illumination: Illumination,
        environment: Option<&'a EnvironmentView<'a>>,
    ) -> Option<Self> {
        // NaN fails.
        let is_near = x.position.to_array().iter().all(|x| x.abs() <= FAR);
        let triangle = light.triangle();
        let (exact_vertices, vertices) = (triangle.exactly_relative_to(x.position), triangle.relative_to(x.position));
        let cross = triangle.double_area_vector();
        let side = cross.dot(exact_vertices[0]);
        if !(is_near && light.sends_to(side) && is_above(&vertices, x.receiver)) {
            return None;
        }
        let double_area = math::sqrt64(cross.length_squared());
        let (normal, area) = geometry::normal_and_area(cross, double_area)?;
        let height = side.abs() / double_area;
        let [a, b, c] = vertices;
        let center = (a + b + c) * (1.0 / 3.0);
        let normal_of_receiver = match x.receiver {
            Receiver::Surface(normal) | Receiver::Transmissive(normal) => normal,
            Receiver::Volume => Vec3::ZERO,
        };
        Some(Self {
            receiver: x.receiver,
            vertices,
            radius2: vertices.iter().fold(0.0, |r: f32, v| r.max((*v - center).length_squared())),
            normal_of_receiver,
            horizon: horizon(normal_of_receiver, &vertices),
            highest: vertices.iter().fold(0.0, |h: f32, v| h.max(normal_of_receiver.dot(*v).abs())),
            exact_vertices,
            normal,
            area,
            height: height as f32,
            exact_height: height,
            illumination,
            environment: environment.filter(|_| light.is_portal()),
        })
    }

    /// Whether the shading point is almost on the triangle's plane.
    pub(crate) fn is_close(&self) -> bool {
        self.radius2 > CLOSE * self.height * self.height
    }

    /// A point of the triangle relative to the shading point. In double precision, as the point may be much nearer
    /// than the vertices.
    #[inline]
    pub(crate) fn point(&self, point: Lattice) -> DVec3 {
        let [b1, b2] = point.to_barycentrics().map(f64::from);
        let [v0, v1, v2] = self.exact_vertices;
        v0 * (1.0 - b1 - b2) + v1 * b1 + v2 * b2
    }

    /// Barycentrics of the point where a ray from the shading point crosses the triangle.
    pub(crate) fn intersect(&self, direction: Vec3) -> Option<[f32; 2]> {
        geometry::intersect(self.exact_vertices, direction)
    }

    /// Solid angle at the shading point per area of the light at this place: `cos θl / d²`.
    #[inline]
    pub(crate) fn solid_angle_per_area(&self, point: DVec3) -> f64 {
        let distance2 = point.length_squared();
        self.exact_height / (distance2 * math::sqrt64(distance2))
    }

    /// Density per solid angle of a point with this density per area, at this place relative to the shading point:
    /// `p_A d² / cos θl`. `None` where it is not a positive number.
    #[inline]
    pub(crate) fn per_solid_angle(&self, pdf_area: f64, point: DVec3) -> Option<f64> {
        let pdf = pdf_area / self.solid_angle_per_area(point);
        (pdf > 0.0 && pdf.is_finite()).then_some(pdf)
    }
}
