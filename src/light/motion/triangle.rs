//! A triangle whose vertices move.

use core::f32::consts::{FRAC_PI_2, PI};

use alloc::vec::Vec;

use glam::{DVec3, Vec3};

use super::{EndVertices, Motion};
use crate::blas::Lattice;
use crate::bounds::{LightBounds, Moments, storable};
use crate::geometry::{self, Aabb, Cone, area_vectors, between};
use crate::light::{LightKind, LightTriangle, LocalPoint};
use crate::math;
use crate::receiver::{ReceiverKind, ShadingPoint};

/// Number of parts of the interval that cones of normals are found for, one by one. *Chosen*: a triangle that turns by
/// half a turn has a narrow cone in each.
///
/// Larger: fits take longer. Smaller: fast turns give cones that hold every direction.
pub(in crate::light) const SHUTTER_PARTS: usize = 8;

/// Widening of a cone of normals, in radians, for rounding. *Proved*: axes and angles in single precision are off by
/// about 1e-7 each, as those of the cones that are united. Larger: a little less is culled.
const UNITED_CONE_ROUNDING: f32 = 2e-6;

/// Returns the vertices of triangles at the end of the interval.
pub(in crate::light) fn end_vertices(positions: &[Vec3], indices: &[[u32; 3]]) -> Vec<EndVertices> {
    indices.iter().map(|triangle| triangle.map(|index| positions[index as usize].to_array())).collect()
}

/// Whether a triangle has an area at any time.
pub(in crate::light) fn has_area_between(start: &[Vec3], end: &[Vec3], indices: [u32; 3]) -> bool {
    let [start, end] = [start, end].map(|positions| indices.map(|index| positions[index as usize].to_array()));
    let record = LightTriangle { vertices: start, ..bytemuck::Zeroable::zeroed() };
    !record.never_has_an_area(Some(&end))
}

impl LightTriangle {
    /// Marks the triangle as one that moves if its vertices are elsewhere at the end of the interval, and as one that
    /// stands still otherwise.
    pub(in crate::light) fn mark_motion(&mut self, end: Option<&EndVertices>) {
        let mark = Self::LAMP | Self::MOVING;
        self.index_and_flags &= !mark;
        if end.is_some_and(|end| *end != self.vertices) {
            self.index_and_flags |= mark;
        }
    }

    /// Whether the area is zero at all times, by the vertices at the end of the interval.
    pub(in crate::light) fn never_has_an_area(&self, end: Option<&EndVertices>) -> bool {
        match end {
            None => self.triangle().normal_and_area().is_none(),
            Some(end) => MovingTriangle::between(self, end).has_no_area(),
        }
    }
}

/// A triangle at a time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MovingTriangle<'a> {
    pub(in crate::light) record: &'a LightTriangle,
    end: &'a EndVertices,
    time: f64,
}

impl<'a> MovingTriangle<'a> {
    /// Returns the triangle of a record at a time. One without an end stands still.
    pub(in crate::light) fn new(record: &'a LightTriangle, motion: Motion<'a>, time: f32) -> Self {
        let end = motion.end_of_triangle(record.index()).unwrap_or(&record.vertices);
        Self { record, end, time: time.into() }
    }

    /// Returns, at the start of the interval, the triangle that moves from the vertices of a record to these.
    pub(in crate::light) fn between(record: &'a LightTriangle, end: &'a EndVertices) -> Self {
        Self { record, end, time: 0.0 }
    }

    /// Returns the same triangle at another time.
    fn at(self, time: f64) -> Self {
        Self { time, ..self }
    }

    fn vertex(&self, i: usize, origin: Vec3) -> DVec3 {
        let relative = |vertex: [f32; 3]| Vec3::from(vertex).as_dvec3() - origin.as_dvec3();
        between(relative(self.record.vertices[i]), relative(self.end[i]), self.time)
    }

    /// Returns the vertices relative to a point.
    pub(in crate::light) fn exactly_relative_to(&self, point: Vec3) -> [DVec3; 3] {
        [self.vertex(0, point), self.vertex(1, point), self.vertex(2, point)]
    }

    /// Returns two edges: their differences are taken before anything is interpolated.
    fn edges(&self) -> [DVec3; 2] {
        let edge = |vertices: &[[f32; 3]; 3], i: usize| {
            Vec3::from(vertices[i]).as_dvec3() - Vec3::from(vertices[0]).as_dvec3()
        };
        [1, 2].map(|i| between(edge(&self.record.vertices, i), edge(self.end, i), self.time))
    }

    /// Returns the normal of the front side times twice the area.
    pub(in crate::light) fn double_area_vector(&self) -> DVec3 {
        let [a, b] = self.edges();
        a.cross(b)
    }

    /// Returns the unit normal of the front side and the area, or `None` where the area is zero.
    pub(in crate::light) fn normal_and_area(&self) -> Option<(Vec3, f32)> {
        let cross = self.double_area_vector();
        geometry::normal_and_area(cross, math::sqrt64(cross.length_squared()))
    }

    /// Whether the area is zero at all times: at three, as twice its vector is a polynomial of the second degree.
    fn has_no_area(&self) -> bool {
        [0.0, 0.5, 1.0].into_iter().all(|time| self.at(time).normal_and_area().is_none())
    }

    /// Returns a cone that holds the normals at all times: in each part of the interval they lie between the
    /// coefficients of the area's vector.
    fn normals(&self) -> Cone {
        let edges = |i: usize| self.at(i as f64 / SHUTTER_PARTS as f64).edges();
        let all = (0..SHUTTER_PARTS).map(|i| convex_cone(area_vectors(edges(i), edges(i + 1)).map(direction)));
        widened(all.flatten().reduce(Cone::union))
    }
}

/// Returns the cone of a single direction; `None` for no direction.
fn direction(vector: DVec3) -> Option<Cone> {
    vector.try_normalize().map(|unit| Cone::single(unit.as_vec3()))
}

/// Returns a cone that holds some cones and all that lies between them; `None` if there are none.
pub(in crate::light) fn convex_cone(cones: [Option<Cone>; 3]) -> Option<Cone> {
    let cone = cones.into_iter().flatten().reduce(Cone::union)?;
    // A cone is convex up to a right angle.
    Some(if cone.theta < FRAC_PI_2 - 2.0 * UNITED_CONE_ROUNDING { cone } else { Cone { axis: cone.axis, theta: PI } })
}

/// Returns a cone a little wider than one that has been united from others.
pub(in crate::light) fn widened(cone: Option<Cone>) -> Cone {
    cone.map_or(Cone { axis: Vec3::Z, theta: PI }, |Cone { axis, theta }| Cone {
        axis,
        theta: (theta + UNITED_CONE_ROUNDING).min(PI),
    })
}

/// Returns the mean over the interval of a function that changes smoothly, by Simpson's rule: exact up to the third
/// degree.
pub(in crate::light) fn simpson(at: impl Fn(f64) -> f64) -> f64 {
    (at(0.0) + 4.0 * at(0.5) + at(1.0)) * (1.0 / 6.0)
}

impl LightKind for MovingTriangle<'_> {
    fn is_portal(&self) -> bool {
        self.record.is_portal()
    }

    fn is_two_sided(&self) -> bool {
        self.record.is_two_sided()
    }

    fn weight(&self) -> f32 {
        self.record.weight()
    }

    /// Returns the mean area over the interval.
    fn area(&self) -> f32 {
        storable(simpson(|time| self.at(time).normal_and_area().map_or(0.0, |(_, area)| f64::from(area))))
    }

    /// Bounds hold at all times; moments are means over the interval.
    fn bounds(&self, directional: bool, energy: impl FnOnce(f32) -> f32) -> (LightBounds, Moments) {
        let area = self.area();
        let energy = energy(area);
        let ends = [&self.record.vertices, self.end].map(|vertices| vertices.map(Vec3::from));
        let aabb = Aabb::around(&ends[0]).union(Aabb::around(&ends[1]));
        let bounds = LightBounds {
            aabb,
            normals: self.normals(),
            emission: FRAC_PI_2,
            flux: if directional { 0.0 } else { energy },
            portal: if directional { energy } else { 0.0 },
            two_sided: self.is_two_sided(),
        };
        let centroids =
            ends.map(|vertices| vertices.iter().map(|vertex| vertex.as_dvec3()).sum::<DVec3>() * (1.0 / 3.0));
        let within = simpson(|time| {
            let [a, b] = self.at(time).edges();
            (a.length_squared() + b.length_squared() + (b - a).length_squared()) * (1.0 / 36.0)
        });
        // The centroid moves evenly along a stretch.
        let variance = within + (centroids[1] - centroids[0]).length_squared() * (1.0 / 12.0);
        let vector = |time: f64| self.at(time).double_area_vector() * 0.5;
        let mean_vector = (vector(0.0) + 4.0 * vector(0.5) + vector(1.0)) * (1.0 / 6.0);
        let normal = mean_vector / f64::from(area).max(f64::MIN_POSITIVE);
        let mean = ((centroids[0] + centroids[1]) * 0.5).as_vec3().clamp(aabb.min, aabb.max);
        let normal = normal.clamp_length_max(1.0);
        let normal = if normal.is_finite() { normal.as_vec3() } else { Vec3::Z };
        (bounds, Moments { energy, mean, variance: variance as f32, normal })
    }

    fn is_visible(&self, x: &ShadingPoint) -> bool {
        let vertices = self.exactly_relative_to(x.position);
        let side = self.double_area_vector().dot(vertices[0]);
        self.record.emits_to(side) && !x.receiver.is_dark(&vertices.map(|vertex| vertex.as_vec3()))
    }

    /// Returns the irradiance at the triangle's time per mean area.
    fn irradiance_per_area(&self, x: &ShadingPoint) -> f32 {
        let vertices = self.exactly_relative_to(x.position).map(|vertex| vertex.as_vec3());
        self.normal_and_area().map_or(0.0, |_| PI * x.receiver.irradiance(&vertices) / self.area())
    }

    fn intersect(&self, origin: Vec3, direction: Vec3) -> Option<LocalPoint> {
        let barycentrics = geometry::intersect(self.exactly_relative_to(origin), direction)?;
        Some(LocalPoint::on_triangle(Lattice::from_barycentrics(barycentrics)))
    }
}
