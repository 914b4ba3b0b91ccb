//! Unit square to a spherical ellipse: the directions of an elliptic cone, such as those to a disk.
//!
//! With tangents a and b of the half angles along two axes, the rim of the cone is `(a cos ψ, b sin ψ, 1)`. In the
//! angle ψ and the cosine to the axis, the solid angle is `a b / s (s + 1) dψ`, where `s² = 1 + a² cos² ψ + b² sin² ψ`,
//! times the share of the cosine. Angles are drawn by `1 / (A cos² ψ + B sin² ψ)`, whose integral is an arc tangent,
//! with A and B the values of `s (s + 1)` on the axes. The two differ by a factor from 0.82 to 1, so the density is
//! nearly uniform, however flat or wide the cone; for round cones and for narrow ones it is uniform.

use core::f32::consts::TAU;

use glam::DVec3;

use crate::math;

/// The directions of an elliptic cone.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SphericalEllipse {
    /// Unit vectors along both axes of the ellipse, and along the axis of the cone.
    pub(crate) axes: [DVec3; 3],
    /// Tangents of the half angles along both axes; positive.
    pub(crate) tangents: [f64; 2],
}

impl SphericalEllipse {
    /// Returns `s (s + 1)` on both axes.
    fn ends(&self) -> [f64; 2] {
        self.tangents.map(|t| {
            let s = math::sqrt64(1.0 + t * t);
            s * (s + 1.0)
        })
    }

    /// Maps `u` in `[0, 1]²` to a direction.
    pub(crate) fn direction(&self, [u1, u2]: [f64; 2]) -> DVec3 {
        let [a, b] = self.tangents;
        let [first, second] = self.ends();
        let (sin, cos) = math::sin_cos(TAU * u2 as f32);
        // On the unit circle, then on the rim.
        let (x, y) = (f64::from(cos) * math::sqrt64(second), f64::from(sin) * math::sqrt64(first));
        let length = math::sqrt64(x * x + y * y);
        let (x, y) = (a * x / length, b * y / length);
        let rim2 = x * x + y * y;
        let s = math::sqrt64(1.0 + rim2);
        // One less the cosine to the axis.
        let height = u1 * rim2 / (s * (s + 1.0));
        let radius = math::sqrt64((height * (2.0 - height)).max(0.0) / rim2);
        let [e, f, axis] = self.axes;
        e * (x * radius) + f * (y * radius) + axis * (1.0 - height)
    }

    /// Returns the density per solid angle with which [`Self::direction`] maps uniform input to a direction of the
    /// cone.
    pub(crate) fn pdf(&self, direction: DVec3) -> f64 {
        let [a, b] = self.tangents;
        let [first, second] = self.ends();
        let [e, f, _] = self.axes;
        let (x, y) = (direction.dot(e) / a, direction.dot(f) / b);
        let length2 = x * x + y * y;
        let share = if length2 > 0.0 { x * x / length2 } else { 1.0 };
        let s = math::sqrt64(1.0 + a * a * share + b * b * (1.0 - share));
        let uniform = math::sqrt64(first) / a * (math::sqrt64(second) / b);
        let by_angle = s * (s + 1.0) / (first * share + second * (1.0 - share));
        uniform * by_angle / core::f64::consts::TAU
    }

    /// Returns the solid angle, to within a fifth.
    pub(crate) fn solid_angle(&self) -> f64 {
        let [a, b] = self.tangents;
        let [first, second] = self.ends();
        core::f64::consts::TAU * (a / math::sqrt64(first)) * (b / math::sqrt64(second))
    }

    /// Returns the sine of the larger half angle.
    pub(crate) fn sin_reach(&self) -> f64 {
        let [a, b] = self.tangents;
        let t = if a > b { a } else { b };
        t / math::sqrt64(1.0 + t * t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean of the inverse density, which is the solid angle, and the range of the density relative to it.
    fn measure(tangents: [f64; 2]) -> [f64; 3] {
        let ellipse = SphericalEllipse { axes: [DVec3::X, DVec3::Y, DVec3::Z], tangents };
        let (mut sum, mut low, mut high) = (0.0, f64::INFINITY, 0.0f64);
        let n = 512;
        for i in 0..n * n {
            let u = [i % n, i / n].map(|i| (f64::from(i) + 0.5) / f64::from(n));
            let direction = ellipse.direction(u);
            assert!((direction.length() - 1.0).abs() < 1e-6);
            let [x, y] = [direction.x / direction.z / tangents[0], direction.y / direction.z / tangents[1]];
            assert!(direction.z > 0.0 && x * x + y * y < 1.0 + 1e-6);
            let pdf = ellipse.pdf(direction);
            (sum, low, high) = (sum + 1.0 / pdf, low.min(pdf), high.max(pdf));
        }
        let angle = sum / f64::from(n * n);
        [angle, low * angle, high * angle]
    }

    #[test]
    fn densities_are_nearly_uniform_however_flat_the_cone() {
        for a in [1e-9, 1e-3, 0.5, 3.0, 100.0, 1e6] {
            for b in [1e-9, 1e-3, 0.5, 3.0, 100.0, 1e6] {
                let [angle, low, high] = measure([a, b]);
                assert!(low > 0.8 && high < 1.25, "{a} {b}: {low} {high}");
                assert!(angle < 2.0 * core::f64::consts::PI * (1.0 + 1e-6));
                if a < 0.01 && b < 0.01 {
                    assert!((angle / (core::f64::consts::PI * a * b) - 1.0).abs() < 1e-5);
                }
                if a == b {
                    let exact =
                        2.0 * core::f64::consts::PI * a * a / ((1.0 + a * a).sqrt() * ((1.0 + a * a).sqrt() + 1.0));
                    assert!((angle / exact - 1.0).abs() < 1e-6 && high < 1.0 + 1e-6);
                }
            }
        }
    }
}
