//! A triangle of an emissive mesh or of a portal.

use core::f32::consts::{FRAC_PI_2, PI};

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::{LightKind, LocalPoint};
use crate::blas::{Lattice, Root};
use crate::bounds::{LightBounds, Moments};
use crate::geometry::{self, Aabb, Cone, Triangle};
use crate::receiver::{ReceiverKind, ShadingPoint};

/// Largest coordinate of a vertex.
///
/// Proved: fourth powers of distances, which the build forms, stay below the largest `f32`, 3e38.
pub(crate) const POSITION_LIMIT: f32 = 1e9;

/// What is kept of every triangle that can emit light.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct LightTriangle {
    /// Vertices, counter-clockwise around the front side.
    pub(crate) vertices: [[f32; 3]; 3],
    /// The tree over its texture.
    pub(crate) root: Root,
    /// Number among all triangles that were added, and [`Self::TWO_SIDED`] and [`Self::PORTAL`]. With [`Self::LAMP`],
    /// all of this is the record of a lamp, but with [`Self::MOVING`] as well, that of a triangle whose vertices move.
    pub(crate) index_and_flags: u32,
}

const _: () = assert!(size_of::<LightTriangle>() == 48);

impl LightTriangle {
    /// Marks a triangle that emits from its back as well. *Format.*
    pub(crate) const TWO_SIDED: u32 = 1 << 31;
    /// Marks a triangle that shows the environment behind it. *Format.*
    pub(crate) const PORTAL: u32 = 1 << 30;
    /// Marks the record of a lamp, which is as large as that of a triangle. *Format*: numbers of lights stay below it.
    pub(crate) const LAMP: u32 = 1 << 29;
    /// Marks, together with [`Self::LAMP`], a triangle whose vertices move. *Format*: numbers of lights stay below it.
    pub(crate) const MOVING: u32 = 1 << 28;

    #[inline]
    pub(crate) fn triangle(&self) -> Triangle {
        Triangle(self.vertices.map(Vec3::from))
    }

    /// Returns the triangle's number among all that were added.
    #[inline]
    pub(super) fn index(&self) -> u32 {
        self.index_and_flags & (Self::MOVING - 1)
    }

    /// Whether the numbers, which may come from outside, are those of a triangle.
    pub(super) fn is_valid(&self) -> bool {
        let in_range = self.vertices.as_flattened().iter().all(|x| x.abs() <= POSITION_LIMIT);
        in_range && self.root.average > 0.0
    }

    /// Whether the triangle emits to points on a side. Negative is the front; NaN is neither side.
    #[inline]
    pub(super) fn emits_to(&self, side: f64) -> bool {
        side < 0.0 || (side > 0.0 && self.is_two_sided())
    }
}

impl LightKind for LightTriangle {
    #[inline]
    fn is_portal(&self) -> bool {
        self.index_and_flags & Self::PORTAL != 0
    }

    #[inline]
    fn is_two_sided(&self) -> bool {
        self.index_and_flags & Self::TWO_SIDED != 0
    }

    #[inline]
    fn weight(&self) -> f32 {
        self.root.average
    }

    #[inline]
    fn area(&self) -> f32 {
        self.triangle().normal_and_area().map_or(0.0, |(_, area)| area)
    }

    #[inline]
    fn bounds(&self, directional: bool, energy: impl FnOnce(f32) -> f32) -> (LightBounds, Moments) {
        let triangle = self.triangle();
        let (normal, area) = triangle.normal_and_area().unwrap_or((Vec3::Z, 0.0));
        let energy = energy(area);
        let bounds = LightBounds {
            aabb: Aabb::around(&triangle.0),
            normals: Cone::single(normal),
            emission: FRAC_PI_2,
            flux: if directional { 0.0 } else { energy },
            portal: if directional { energy } else { 0.0 },
            two_sided: self.is_two_sided(),
        };
        let (mean, variance) = triangle.mean_and_variance();
        (bounds, Moments { energy, mean, variance, normal })
    }

    /// Whether the point is on a side that emits, and some of the triangle is above its horizon.
    #[inline]
    fn is_visible(&self, x: &ShadingPoint) -> bool {
        let triangle = self.triangle();
        let side = triangle.double_area_vector().dot(triangle.exactly_relative_to(x.position)[0]);
        self.emits_to(side) && !x.receiver.is_dark(&triangle.relative_to(x.position))
    }

    fn irradiance_per_area(&self, x: &ShadingPoint) -> f32 {
        let triangle = self.triangle();
        let irradiance = x.receiver.irradiance(&triangle.relative_to(x.position));
        triangle.normal_and_area().map_or(0.0, |(_, area)| PI * irradiance / area)
    }

    #[inline]
    fn intersect(&self, origin: Vec3, direction: Vec3) -> Option<LocalPoint> {
        let vertices = self.triangle().exactly_relative_to(origin);
        geometry::intersect(vertices, direction).map(|b| LocalPoint::on_triangle(Lattice::from_barycentrics(b)))
    }
}
