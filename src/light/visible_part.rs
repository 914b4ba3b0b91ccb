//! What is above the horizon of a triangle, as one or two spherical triangles.

use glam::DVec3;

use crate::warp::SphericalTriangle;

/// The part of a triangle above a receiver's horizon, as a shading point sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct VisiblePart {
    /// Twice the same if there is one.
    triangles: [SphericalTriangle; 2],
    count: usize,
}

impl VisiblePart {
    /// Clips a triangle with these vertices, relative to the shading point, by the plane of a normal, if there is one.
    ///
    /// `determinant` is that of the vertices; see [`SphericalTriangle::new`]. `None` where nothing of the triangle is
    /// above the horizon, or its solid angle is too small for a double.
    #[inline(always)]
    pub(super) fn new(vertices: [DVec3; 3], determinant: f64, horizon: Option<DVec3>) -> Option<Self> {
        let [a, b, c] = vertices;
        let (vertices, determinant) =
            if determinant < 0.0 { ([a, c, b], -determinant) } else { (vertices, determinant) };
        let heights = vertices.map(|v| horizon.map_or(1.0, |normal| normal.dot(v)));
        let above = heights.map(|height| height > 0.0);
        let odd = match above {
            [true, true, true] => return SphericalTriangle::new(vertices, determinant).map(Self::one),
            // NaN is not above.
            [false, false, false] => return None,
            [true, false, false] | [false, true, true] => 0,
            [false, true, false] | [true, false, true] => 1,
            [false, false, true] | [true, true, false] => 2,
        };
        // Turned so that the one on the other side comes first.
        let turned = |values: [f64; 3]| [values[odd], values[(odd + 1) % 3], values[(odd + 2) % 3]];
        let [h0, h1, h2] = turned(heights);
        let [v0, v1, v2] = [vertices[odd], vertices[(odd + 1) % 3], vertices[(odd + 2) % 3]];
        // The horizon cuts the edges from it at these shares of their lengths.
        let (s, t) = (h0 / (h0 - h1), h0 / (h0 - h2));
        let (p, q) = (v0 + (v1 - v0) * s, v0 + (v2 - v0) * t);
        // Determinants of triangles in one plane are in proportion to their areas.
        if above[odd] {
            return SphericalTriangle::new([v0, p, q], determinant * s * t).map(Self::one);
        }
        let first = SphericalTriangle::new([p, v1, v2], determinant * (1.0 - s));
        let second = SphericalTriangle::new([p, v2, q], determinant * s * (1.0 - t));
        match (first, second) {
            (Some(first), Some(second)) => Some(Self { triangles: [first, second], count: 2 }),
            (first, second) => first.or(second).map(Self::one),
        }
    }

    #[inline(always)]
    fn one(triangle: SphericalTriangle) -> Self {
        Self { triangles: [triangle; 2], count: 1 }
    }

    #[inline(always)]
    pub(super) fn triangles(&self) -> &[SphericalTriangle; 2] {
        &self.triangles
    }

    /// Whether there are two spherical triangles.
    #[inline(always)]
    pub(super) fn is_split(&self) -> bool {
        self.count == 2
    }

    /// Returns the solid angle of all of it.
    #[inline(always)]
    pub(super) fn solid_angle(&self) -> f64 {
        let [first, second] = &self.triangles;
        first.solid_angle() + if self.is_split() { second.solid_angle() } else { 0.0 }
    }

    /// Returns the spherical triangle that a unit direction lies in, and the point of the unit square that maps to it.
    #[inline(always)]
    pub(super) fn locate(&self, direction: DVec3) -> (usize, [f64; 2]) {
        let first = &self.triangles[0];
        // They share the first's last side.
        let side = first.last_side();
        let index = usize::from(self.is_split() && side.dot(direction) * side.dot(first.pole()) < 0.0);
        (index, self.triangles[index].invert(direction))
    }
}
