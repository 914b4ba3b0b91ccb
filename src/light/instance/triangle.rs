//! A triangle of an object in the place of one of its instances.

use core::f32::consts::PI;

use glam::{DVec3, Vec3};

use crate::blas::Lattice;
use crate::geometry::{self, ForwardMap};
use crate::light::{LightKind, LightTriangle, LocalPoint};
use crate::math;
use crate::receiver::{ReceiverKind, ShadingPoint};

/// A triangle of an object with the map to the world. Its vertices are mapped in double precision and never rounded, so
/// that far from the origin an instance keeps its shape.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedTriangle<'a> {
    pub(in crate::light) record: &'a LightTriangle,
    map: ForwardMap,
}

impl<'a> PlacedTriangle<'a> {
    #[inline(always)]
    pub(super) fn new(record: &'a LightTriangle, map: ForwardMap) -> Self {
        Self { record, map }
    }

    /// Returns the vertices relative to a point of the world, in the object's own order.
    pub(in crate::light) fn exactly_relative_to(&self, point: Vec3) -> [DVec3; 3] {
        self.record.triangle().0.map(|vertex| self.map.relative_to(point, vertex))
    }

    /// Returns the normal of the front side times twice the area.
    pub(in crate::light) fn double_area_vector(&self) -> DVec3 {
        let [a, b, c] = self.record.triangle().0.map(Vec3::as_dvec3);
        let cross = (self.map.linear * (b - a)).cross(self.map.linear * (c - a));
        if self.map.is_mirrored { -cross } else { cross }
    }

    /// Returns the unit normal of the front side and the area, or `None` where the area is zero.
    pub(in crate::light) fn normal_and_area(&self) -> Option<(Vec3, f32)> {
        let cross = self.double_area_vector();
        geometry::normal_and_area(cross, math::sqrt64(cross.length_squared()))
    }

    /// Whether vertices run around the front the other way.
    pub(in crate::light) fn is_mirrored(&self) -> bool {
        self.map.is_mirrored
    }

    /// Whether the environment shines in through the triangle.
    pub(crate) fn is_portal(&self) -> bool {
        self.record.is_portal()
    }

    /// Whether the point is on a side that emits, and some of the triangle is above its horizon.
    pub(crate) fn is_visible(&self, x: &ShadingPoint) -> bool {
        let vertices = self.exactly_relative_to(x.position);
        let side = self.double_area_vector().dot(vertices[0]);
        self.record.emits_to(side) && !x.receiver.is_dark(&vertices.map(|vertex| vertex.as_vec3()))
    }

    /// Returns the irradiance from the triangle at unit radiance, per area of it in the object's space.
    pub(super) fn irradiance_per_own_area(&self, x: &ShadingPoint) -> f32 {
        let vertices = self.exactly_relative_to(x.position).map(|vertex| vertex.as_vec3());
        let area = self.record.area();
        if area > 0.0 { PI * x.receiver.irradiance(&vertices) / area } else { 0.0 }
    }

    /// Returns the point where a ray crosses the triangle, if it does.
    pub(crate) fn intersect(&self, origin: Vec3, direction: Vec3) -> Option<LocalPoint> {
        let barycentrics = geometry::intersect(self.exactly_relative_to(origin), direction)?;
        Some(LocalPoint::on_triangle(Lattice::from_barycentrics(barycentrics)))
    }
}
