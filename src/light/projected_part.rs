//! Points of a triangle that sends the same in all directions, drawn for a diffuse surface: by the cosine of their
//! directions, without noise, however near the triangle is.
//!
//! The part of the triangle above the horizon is one or two spherical triangles ([`VisiblePart`]), and a uniform point
//! of their projections onto the receiver's plane is a direction ([`ProjectedTriangle`]). The direction is rounded to a
//! point of the triangle's lattice, and the density is that of the rounded point.

use glam::DVec3;

use super::spherical_grid::LEAST_SOLID_ANGLE;
use super::triangle_view::TriangleView;
use super::visible_part::VisiblePart;
use super::{DrawnPoint, LocalPoint};
use crate::blas::Lattice;
use crate::geometry;
use crate::math::sqrt64;
use crate::warp::{ProjectedTriangle, Variate, pick_pair};

/// What is visible of a triangle, projected onto the plane of a diffuse surface.
pub(super) struct ProjectedPart {
    /// Unit normal of the surface.
    normal: DVec3,
    first: ProjectedTriangle,
    second: Option<ProjectedTriangle>,
    area: f64,
}

impl ProjectedPart {
    /// Returns the part of a triangle that a surface sees; `None` where there is nothing above the horizon, or too
    /// little of it.
    pub(super) fn new(view: &TriangleView<'_>) -> Option<Self> {
        let normal = view.receiver_normal.as_dvec3();
        let visible = VisiblePart::new(view.exact_vertices, view.determinant, Some(normal))?;
        let normal = normal * (1.0 / sqrt64(normal.length_squared()));
        if visible.solid_angle() < LEAST_SOLID_ANGLE {
            return None;
        }
        let [first, second] = visible.triangles();
        let first = ProjectedTriangle::new(first.corners(), normal)?;
        let second = if visible.is_split() { Some(ProjectedTriangle::new(second.corners(), normal)?) } else { None };
        let area = first.area() + second.map_or(0.0, |second| second.area());
        Some(Self { normal, first, second, area })
    }

    /// Draws a point.
    pub(super) fn sample(&self, view: &TriangleView<'_>, [v, mut u]: [Variate; 2]) -> Option<DrawnPoint> {
        let part = match &self.second {
            Some(second) if pick_pair([self.first.area() as f32, second.area() as f32], &mut u) == 1 => second,
            _ => &self.first,
        };
        let direction = part.direction([v.value(), u.value()]);
        let (barycentrics, _) = geometry::cross_plane(view.exact_vertices, direction)?;
        let point = Lattice::inside(barycentrics);
        let relative = view.position(point);
        Some(DrawnPoint { point: LocalPoint::on_triangle(point), relative, pdf: self.pdf(relative)? })
    }

    /// Returns the density per solid angle of a point relative to the shading point. `None` at and below the horizon.
    pub(super) fn pdf(&self, point: DVec3) -> Option<f64> {
        let height = self.normal.dot(point);
        let pdf = height / (self.area * sqrt64(point.length_squared()));
        (pdf > 0.0 && pdf.is_finite()).then_some(pdf)
    }
}
