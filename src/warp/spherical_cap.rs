//! Unit square to a cap of the unit sphere: the directions of a cone.

use core::f32::consts::TAU;
use core::f64::consts::TAU as TAU64;

use glam::DVec3;

use crate::math;

/// The directions within an angle of an axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SphericalCap {
    /// Unit vector.
    pub(crate) axis: DVec3,
    /// Sine of the half angle.
    pub(crate) sin: f64,
    /// Cosine of the half angle.
    pub(crate) cos: f64,
}

impl SphericalCap {
    /// Returns the whole sphere.
    pub(crate) const fn whole() -> Self {
        Self { axis: DVec3::Z, sin: 0.0, cos: -1.0 }
    }

    /// One less the cosine of the half angle, without loss for narrow caps.
    fn height(&self) -> f64 {
        if self.cos > 0.0 { self.sin * self.sin / (1.0 + self.cos) } else { 1.0 - self.cos }
    }

    /// Returns the solid angle.
    pub(crate) fn solid_angle(&self) -> f64 {
        TAU64 * self.height()
    }

    /// Maps `u` in `[0, 1]²` to a direction. Uniform input gives a uniform direction.
    pub(crate) fn direction(&self, [u1, u2]: [f64; 2]) -> DVec3 {
        let height = u1 * self.height();
        let radius = math::sqrt64((height * (2.0 - height)).max(0.0));
        let (sin, cos) = math::sin_cos(TAU * u2 as f32);
        let (s, t) = self.axis.any_orthonormal_pair();
        s * (radius * f64::from(cos)) + t * (radius * f64::from(sin)) + self.axis * (1.0 - height)
    }
}

/// Maps `u` in `[0, 1]²` to a direction of the whole sphere.
pub(crate) fn uniform_direction(u: [f64; 2]) -> DVec3 {
    SphericalCap::whole().direction(u)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_in_the_cap() {
        let axis = DVec3::new(0.6, 0.0, -0.8);
        for sin in [1e-12, 1e-3, 0.5, 0.999_999] {
            let cap = SphericalCap { axis, sin, cos: (1.0 - sin * sin).sqrt() };
            let flat = core::f64::consts::PI * sin * sin;
            assert!((cap.solid_angle() / flat - 1.0).abs() < 1.01 && cap.solid_angle() >= flat);
            for i in 0..=64 {
                let u = [f64::from(i % 8) / 7.0, f64::from(i / 8) / 8.0];
                let direction = cap.direction(u);
                assert!((direction.length() - 1.0).abs() < 1e-6);
                assert!(direction.cross(axis).length() <= sin * (1.0 + 1e-6), "{sin} {u:?}");
            }
        }
    }
}
