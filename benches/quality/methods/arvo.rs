//! Uniform sampling of a spherical triangle (Arvo 1995), in the form of pbrt-v4 and in double precision.

use core::f64::consts::PI;

use glam::DVec3;

use crate::oracle::lambert::solid_angle;

/// Solid angles below which the sphere is flat and the area is sampled instead.
const SMALLEST: f64 = 1e-7;

/// A triangle that is seen from the origin.
pub(crate) struct SphericalTriangle {
    vertices: [DVec3; 3],
    pub(crate) solid_angle: f64,
}

impl SphericalTriangle {
    /// `None` if the solid angle is too small for the angles of the triangle to be told from those of a flat one.
    pub(crate) fn new(vertices: &[DVec3; 3]) -> Option<Self> {
        let solid_angle = solid_angle(vertices);
        (solid_angle > SMALLEST).then(|| Self { vertices: vertices.map(DVec3::normalize), solid_angle })
    }

    /// A uniform direction.
    pub(crate) fn sample(&self, u: [f64; 2]) -> DVec3 {
        let [a, b, c] = self.vertices;
        let (n_ab, n_ca) = (a.cross(b).normalize(), c.cross(a).normalize());
        let alpha = n_ab.angle_between(-n_ca);
        // The area of the part of the triangle up to the chosen arc, plus π.
        let area = PI + u[0] * self.solid_angle;
        let ((sin_alpha, cos_alpha), (sin_area, cos_area)) = (alpha.sin_cos(), area.sin_cos());
        let sin_phi = sin_area * cos_alpha - cos_area * sin_alpha;
        let cos_phi = cos_area * cos_alpha + sin_area * sin_alpha;
        let k1 = cos_phi + cos_alpha;
        let k2 = sin_phi - sin_alpha * a.dot(b);
        let cos_b = (k2 + (k2 * cos_phi - k1 * sin_phi) * cos_alpha) / ((k2 * sin_phi + k1 * cos_phi) * sin_alpha);
        let cos_b = if cos_b.is_nan() { 1.0 } else { cos_b.clamp(-1.0, 1.0) };
        let c_new = a * cos_b + (c - a * a.dot(c)).normalize_or_zero() * (1.0 - cos_b * cos_b).sqrt();
        let cos = 1.0 - u[1] * (1.0 - c_new.dot(b));
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        (b * cos + (c_new - b * b.dot(c_new)).normalize_or_zero() * sin).normalize()
    }
}

/// Barycentrics of the point of a triangle in a direction from the origin, clamped to the triangle.
pub(crate) fn barycentrics(vertices: &[DVec3; 3], direction: DVec3) -> [f64; 2] {
    let [a, b, c] = *vertices;
    let (e1, e2) = (b - a, c - a);
    let p = direction.cross(e2);
    let determinant = e1.dot(p);
    let q = (-a).cross(e1);
    let b1 = (-a.dot(p) / determinant).clamp(0.0, 1.0);
    let b2 = (direction.dot(q) / determinant).clamp(0.0, 1.0 - b1);
    [b1, b2]
}

/// Whether a ray from the origin crosses a triangle.
pub(crate) fn crosses(vertices: &[DVec3; 3], direction: DVec3) -> bool {
    let [a, b, c] = *vertices;
    let sides = [a.cross(b), b.cross(c), c.cross(a)].map(|n| n.dot(direction));
    let normal = (b - a).cross(c - a);
    normal.dot(direction) * normal.dot(a) > 0.0 && (sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0))
}
