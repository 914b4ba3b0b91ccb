//! Directions through a rectangle, uniform in solid angle (Ureña, Fajardo and King 2013, "An Area-Preserving
//! Parametrization for Spherical Rectangles").

use core::f64::consts::TAU;

use glam::{DVec3, Vec3};

use crate::geometry::Rectangle;

/// Solid angle below which a rectangle is not sampled, in steradians: less cannot be told from the rounding of its
/// angles.
const SMALLEST: f64 = 1e-9;

/// A rectangle as seen from a point. The names are those of the paper.
#[derive(Clone, Copy, Debug)]
pub(super) struct SphericalRectangle {
    axes: [DVec3; 3],
    x: [f64; 2],
    y: [f64; 2],
    z0: f64,
    b: [f64; 2],
    k: f64,
    solid_angle: f64,
}

impl SphericalRectangle {
    /// Projects a rectangle. `None` if next to nothing is seen of it.
    pub(super) fn new(rectangle: &Rectangle, point: Vec3) -> Option<Self> {
        let sides = rectangle.sides.map(Vec3::as_dvec3);
        let [width, height] = sides.map(DVec3::length);
        let (x, y) = (sides[0] / width, sides[1] / height);
        let mut z = x.cross(y);
        let corner = (rectangle.corner - point).as_dvec3();
        let mut z0 = corner.dot(z);
        if z0 > 0.0 {
            (z, z0) = (-z, -z0);
        }
        let (x0, y0) = (corner.dot(x), corner.dot(y));
        let (x1, y1) = (x0 + width, y0 + height);
        // Normals of the planes through the four edges.
        let normal = |a: f64, b: f64| DVec3::new(0.0, -z0, a).normalize() * b;
        let (bottom, top) = (normal(y0, -1.0), normal(y1, 1.0));
        let side = |a: f64, b: f64| DVec3::new(-z0, 0.0, a).normalize() * b;
        let (right, left) = (side(x1, 1.0), side(x0, -1.0));
        let angle = |a: DVec3, b: DVec3| (-a.dot(b)).clamp(-1.0, 1.0).acos();
        let g = [angle(bottom, right), angle(right, top), angle(top, left), angle(left, bottom)];
        let k = TAU - g[2] - g[3];
        let solid_angle = g[0] + g[1] - k;
        let is_seen = solid_angle > SMALLEST && z0 < 0.0;
        is_seen.then_some(Self { axes: [x, y, z], x: [x0, x1], y: [y0, y1], z0, b: [bottom.z, top.z], k, solid_angle })
    }

    /// In steradians.
    pub(super) const fn solid_angle(&self) -> f64 {
        self.solid_angle
    }

    /// Returns a unit direction through the rectangle.
    pub(super) fn direction(&self, [u, v]: [f32; 2]) -> Vec3 {
        let au = f64::from(u) * self.solid_angle + self.k;
        let fu = (au.cos() * self.b[0] - self.b[1]) / au.sin();
        let cu = (1.0 / (fu * fu + self.b[0] * self.b[0]).sqrt()).copysign(fu).clamp(-1.0, 1.0);
        let xu = (-(cu * self.z0) / (1.0 - cu * cu).max(1e-24).sqrt()).clamp(self.x[0], self.x[1]);
        let d_squared = xu * xu + self.z0 * self.z0;
        let [h0, h1] = self.y.map(|y| y / (d_squared + y * y).sqrt());
        let hv = h0 + f64::from(v) * (h1 - h0);
        let rest = 1.0 - hv * hv;
        let yv = if rest > 1e-12 { (hv * (d_squared / rest).sqrt()).clamp(self.y[0], self.y[1]) } else { self.y[1] };
        let [x, y, z] = self.axes;
        (xu * x + yv * y + self.z0 * z).normalize().as_vec3()
    }
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3, vec2, vec3};

    use super::SphericalRectangle;
    use crate::geometry::{Plane, Rectangle};
    use crate::random::Pcg32;

    /// Against points uniform in area, weighted: solid angle and mean direction.
    #[test]
    fn directions_are_uniform_in_solid_angle() {
        let rectangle = Rectangle::new(Plane::Y(5.0), vec2(1.0, 0.9), vec2(2.2, 2.1), Vec3::NEG_Y);
        for point in [vec3(2.0, 1.0, 0.0), vec3(1.6, 4.5, 1.5), vec3(5.9, 4.8, 2.0)] {
            let spherical = SphericalRectangle::new(&rectangle, point).expect("it is seen");
            let mut random = Pcg32::new(9, 1);
            let count = 100_000;
            let (mut by_area, mut by_angle, mut total) = (Vec3::ZERO, Vec3::ZERO, 0.0);
            for _ in 0..count {
                by_angle += spherical.direction(random.uniform2()) * spherical.solid_angle() as f32 / count as f32;
                let [u, v] = random.uniform2();
                let way = rectangle.corner + u * rectangle.sides[0] + v * rectangle.sides[1] - point;
                let weight = 1.44 * way.normalize().y / way.length_squared() / count as f32;
                by_area += way.normalize() * weight;
                total += f64::from(weight);
            }
            assert!((total / spherical.solid_angle() - 1.0).abs() < 0.02, "{total} {spherical:?}");
            assert!(by_area.distance(by_angle) < 0.02 * by_area.length(), "{by_area} {by_angle}");
        }
        let behind = Rectangle::new(Plane::Z(0.0), Vec2::ZERO, Vec2::ONE, Vec3::Z);
        assert!(SphericalRectangle::new(&behind, vec3(2.0, 0.5, 0.0)).is_none());
    }
}
