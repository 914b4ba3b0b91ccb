//! One triangle, seen from a point.

use glam::{DVec3, Vec3};

use crate::math;

/// Vertices in world space, counter-clockwise around the front side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Triangle(pub(crate) [Vec3; 3]);

impl Triangle {
    /// Returns the triangle of three of these positions. Panics if there is no such position.
    pub(crate) fn of(positions: &[Vec3], indices: [u32; 3]) -> Self {
        Self(indices.map(|index| positions[index as usize]))
    }

    /// Cross product of two edges: normal of the front side times twice the area. In double precision, where the
    /// differences of coordinates of like size are exact, so that slivers keep their direction.
    #[inline]
    pub(crate) fn double_area_vector(&self) -> DVec3 {
        let [a, b, c] = self.0.map(Vec3::as_dvec3);
        (b - a).cross(c - a)
    }

    /// Unit normal of the front side and area, or `None` where the area is zero.
    pub(crate) fn normal_and_area(&self) -> Option<(Vec3, f32)> {
        let cross = self.double_area_vector();
        normal_and_area(cross, math::sqrt64(cross.length_squared()))
    }

    /// Mean position, and mean squared distance from it.
    pub(crate) fn mean_and_variance(&self) -> (Vec3, f32) {
        let [a, b, c] = self.0;
        let edges = (b - a).length_squared() + (c - b).length_squared() + (a - c).length_squared();
        (a + ((b - a) + (c - a)) * (1.0 / 3.0), edges * (1.0 / 36.0))
    }

    /// The vertices relative to a point, in double precision.
    #[inline]
    pub(crate) fn exactly_relative_to(&self, point: Vec3) -> [DVec3; 3] {
        self.0.map(|vertex| vertex.as_dvec3() - point.as_dvec3())
    }

    /// The vertices relative to a point.
    #[inline]
    pub(crate) fn relative_to(&self, point: Vec3) -> [Vec3; 3] {
        self.0.map(|vertex| vertex - point)
    }
}

/// Unit normal and area of a triangle by its [`Triangle::double_area_vector`] and the length of that, or `None` where
/// the area is zero.
#[inline]
pub(crate) fn normal_and_area(cross: DVec3, double_area: f64) -> Option<(Vec3, f32)> {
    let area = (0.5 * double_area) as f32;
    (area > 0.0 && area.is_finite()).then(|| ((cross / double_area).as_vec3(), area))
}

/// Barycentrics `b1`, `b2` of the point where the ray from the origin along `direction` crosses the triangle with
/// these vertices, or `None` if it does not. After Möller and Trumbore (1997).
pub(crate) fn intersect(vertices: [DVec3; 3], direction: Vec3) -> Option<[f32; 2]> {
    let ([b1, b2], t) = cross_plane(vertices, direction.as_dvec3())?;
    (b1 >= 0.0 && b2 >= 0.0 && b1 + b2 <= 1.0 && t > 0.0).then_some([b1 as f32, b2 as f32])
}

/// Returns the barycentrics `b1`, `b2` of the point where the line from the origin along `direction` crosses the plane
/// of a triangle, and the point's distance in units of `direction`. `None` where they are parallel.
#[inline(always)]
pub(crate) fn cross_plane(vertices: [DVec3; 3], direction: DVec3) -> Option<([f64; 2], f64)> {
    let [a, b, c] = vertices;
    let (e1, e2) = (b - a, c - a);
    let p = direction.cross(e2);
    let determinant = e1.dot(p);
    if determinant == 0.0 {
        return None;
    }
    let q = (-a).cross(e1);
    Some(([-a.dot(p) / determinant, direction.dot(q) / determinant], e2.dot(q) / determinant))
}

/// Returns the barycentrics `b1`, `b2` of a point in the plane of a triangle, or of the point of the plane nearest to it.
pub(crate) fn barycentrics_of(vertices: [DVec3; 3], point: DVec3) -> [f64; 2] {
    let [a, b, c] = vertices;
    let (e1, e2) = (b - a, c - a);
    let normal = e1.cross(e2);
    let scaled = normal / normal.length_squared();
    [(point - a).cross(e2).dot(scaled), e1.cross(point - a).dot(scaled)]
}

/// Returns the barycentrics `[b1, b2]` of the centers of the `n²` congruent triangles that a triangle is divided into.
pub(crate) fn subdivision_centers(n: u32) -> impl Iterator<Item = [f64; 2]> {
    let center = move |i: u32| f64::from(i) / f64::from(3 * n);
    (0..n).flat_map(move |i| {
        (0..n - i).flat_map(move |j| {
            // The last of a row has no inverted one beside it.
            let thirds = if i + j == n - 1 { 1 } else { 2 };
            (1..=thirds).map(move |third| [center(3 * i + third), center(3 * j + third)])
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_side_of_a_point_is_a_sign() {
        let triangle =
            Triangle([Vec3::new(1e3, 1e3, 1e3), Vec3::new(1e3 + 1.0, 1e3, 1e3), Vec3::new(1e3, 1e3 + 1.0, 1e3)]);
        let side = |x, y, z| triangle.double_area_vector().dot(triangle.exactly_relative_to(Vec3::new(x, y, z))[0]);
        assert!(side(1000.25, 1000.25, 1000.0001) < 0.0);
        assert!(side(1000.25, 1000.25, 999.9999) > 0.0);
        assert_eq!(side(1000.25, 1000.75, 1000.0), 0.0);
        assert_eq!(triangle.normal_and_area(), Some((Vec3::Z, 0.5)));
    }

    #[test]
    fn a_triangle_without_area_has_no_normal() {
        assert_eq!(Triangle([Vec3::X, Vec3::X, Vec3::Y]).normal_and_area(), None);
        assert_eq!(Triangle([Vec3::ZERO, Vec3::X, Vec3::X * 2.0]).normal_and_area(), None);
    }

    #[test]
    fn rays_find_the_barycentrics() {
        let vertices = [DVec3::new(-1.0, -1.0, 2.0), DVec3::new(3.0, -1.0, 2.0), DVec3::new(-1.0, 3.0, 2.0)];
        let [b1, b2] = intersect(vertices, Vec3::Z).expect("the ray crosses");
        assert!((b1 - 0.25).abs() < 1e-7 && (b2 - 0.25).abs() < 1e-7);
        assert_eq!(intersect(vertices, Vec3::NEG_Z), None);
        assert_eq!(intersect(vertices, Vec3::X), None);
    }
}
