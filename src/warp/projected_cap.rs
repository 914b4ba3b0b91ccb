//! Unit square to the part of a spherical cap above a plane, by the cosine to the plane's normal.
//!
//! A uniform point of the cap's projection onto the plane is a direction with a density of its cosine (Nusselt). A cap
//! that the plane does not cut projects to an ellipse. One that it cuts projects to what lies between the inner side of
//! that ellipse and the unit circle (after Peters and Dachsbacher 2019, "Sampling projected spherical caps in real
//! time"). Across the ellipse, the coordinate is drawn as for the whole ellipse; along it, uniformly. The density is
//! that of both: exactly the cosine's for a cap that is not cut, and near it for one that is. It changes gradually from
//! the one to the other.
//!
//! A cap of more than a hemisphere projects to the unit disk without what the rest of the sphere projects to.

use core::f32::consts::TAU;
use core::f64::consts::FRAC_2_PI;

use glam::DVec3;

use super::spherical_cap::SphericalCap;
use crate::math;

/// Least sine of the half angle of a cap that is projected. *Proved*: directions in single precision, 6e-8, resolve it
/// to a hundredth. Larger: caps of that size at the horizon are drawn below it as well. Smaller: densities of rounded
/// directions would be those of others.
const LEAST_SINE: f64 = 1e-5;

/// Least sine of the angle between the axis of a cap and the normal. *Proved*: rounding of 1e-16 turns a direction
/// found from a smaller sine by more than 1e-6. A larger one would move caps.
const LEAST_TILT: f64 = 1e-10;

/// Share of the cap's width that is kept off its two ends, where the density may be infinite, and least length of a
/// chord. *Chosen*: far above the rounding of double precision, 1e-16, and far below that of a direction, 6e-8.
///
/// Larger: directions next to the ends are never drawn. Smaller: rounding decides about the density there.
const END: f64 = 1e-12;

/// A spherical cap over a plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ProjectedCap {
    /// Unit vectors: along the projection of the cap's axis, across it, and normal to the plane.
    frame: [DVec3; 3],
    /// Sine and cosine of the angle between the axis and the normal.
    tilt: [f64; 2],
    /// Sine and cosine of the cap's half angle.
    half_angle: [f64; 2],
    /// Largest coordinate across the axis.
    width: f64,
}

/// What lies at one coordinate across the axis.
struct Chord {
    start: f64,
    /// Without the gap.
    length: f64,
    /// What is left out: at this place, and of this length.
    gap: [f64; 2],
    /// Density of the coordinate over the length.
    density: f64,
}

impl Chord {
    const WITHOUT_GAP: [f64; 2] = [f64::INFINITY, 0.0];

    /// Returns the coordinate at a share of the length.
    fn at(&self, share: f64) -> f64 {
        let place = self.start + share * self.length;
        if place > self.gap[0] { place + self.gap[1] } else { place }
    }
}

impl ProjectedCap {
    /// Returns the part of a cap above the plane of a unit normal; `None` for a cap that is too narrow.
    pub(crate) fn new(cap: &SphericalCap, normal: DVec3) -> Option<Self> {
        let holds_all = cap.cos < 0.0 && (cap.sin == 0.0 || cap.axis.dot(normal) >= cap.sin);
        let (axis, half_angle) = if holds_all { (normal, [1.0, 0.0]) } else { (cap.axis, [cap.sin, cap.cos]) };
        let cos = axis.dot(normal);
        let aside = axis - normal * cos;
        let sin = math::sqrt64(aside.length_squared());
        // What is left of a vector along the normal is rounding.
        let (sin, along) = if sin > LEAST_TILT { (sin, aside / sin) } else { (0.0, normal.any_orthonormal_vector()) };
        let [sine, cosine] = half_angle;
        // The root of one less the squared share of the width at which the rim meets the plane.
        let end = if cos < 0.0 { -cos * cosine / (sin * sine) } else { 0.0 };
        let width = if cosine < 0.0 { 1.0 } else { sine * math::sqrt64((1.0 - end * end).max(0.0)) };
        let is_resolved = width > LEAST_SINE;
        is_resolved.then(|| Self { frame: [along, normal.cross(along), normal], tilt: [sin, cos], half_angle, width })
    }

    /// Returns what lies at a share of the width, from -1 to 1.
    fn chord(&self, share: f64) -> Chord {
        let ([sin, cos], [sine, cosine]) = (self.tilt, self.half_angle);
        let across = math::sqrt64(1.0 - share * share);
        let y = self.width * share;
        // Half of the ellipse's chord is this times its half axis.
        let root = math::sqrt64((1.0 - (y / sine) * (y / sine)).max(0.0));
        let (middle, half) = (cosine * sin, sine * cos * root);
        if cosine < 0.0 {
            let edge = math::sqrt64(1.0 - y * y);
            // Both points of the rim, and whether they are above the plane.
            let (near, far) = (middle - half, middle + half);
            let [near_height, far_height] = [root, -root].map(|root| cosine * cos + sine * sin * root);
            let (start, gap) = if root > 0.0 && far_height > 0.0 {
                (-edge, [far, near - far])
            } else if root > 0.0 && near_height > 0.0 {
                (near, Chord::WITHOUT_GAP)
            } else {
                (-edge, Chord::WITHOUT_GAP)
            };
            let length = (edge - start - gap[1]).max(END);
            return Chord { start, length, gap, density: across / length };
        }
        let gap = Chord::WITHOUT_GAP;
        if cosine * cos >= sine * sin * root {
            return Chord { start: middle - half, length: 2.0 * half, gap, density: 0.5 / (sine * cos) };
        }
        let length = math::sqrt64(1.0 - y * y) - (middle - half);
        Chord { start: middle - half, length, gap, density: across / length }
    }

    /// Maps `u` in `[0, 1]²` to a direction.
    pub(crate) fn direction(&self, [u1, u2]: [f64; 2]) -> DVec3 {
        let (sin, cos) = math::sin_cos(TAU * u2 as f32);
        let radius = math::sqrt64(u1);
        // A point of the unit disk, and its place along its chord.
        let share = (radius * f64::from(sin)).clamp(END - 1.0, 1.0 - END);
        let place = 0.5 + 0.5 * radius * f64::from(cos) / math::sqrt64(1.0 - share * share);
        let chord = self.chord(share);
        let (x, y) = (chord.at(place.clamp(0.0, 1.0)), self.width * share);
        let [along, across, normal] = self.frame;
        along * x + across * y + normal * math::sqrt64((1.0 - x * x - y * y).max(0.0))
    }

    /// Returns the density per solid angle with which [`Self::direction`] maps uniform input to a direction of the cap.
    pub(crate) fn pdf(&self, direction: DVec3) -> f64 {
        let [_, across, normal] = self.frame;
        let share = (across.dot(direction) / self.width).clamp(END - 1.0, 1.0 - END);
        FRAC_2_PI / self.width * self.chord(share).density * normal.dot(direction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Integral of the cosine over a cap above the plane z = 0, and the relative deviation of cosine over density.
    fn measure(cap: &SphericalCap) -> Option<[f64; 3]> {
        let projected = ProjectedCap::new(cap, DVec3::Z)?;
        let (mut sum, mut square) = (0.0, 0.0);
        let n = 400;
        for i in 0..n * n {
            let u = [i % n, i / n].map(|i| (f64::from(i) + 0.5) / f64::from(n));
            let direction = projected.direction(u);
            assert!((direction.length() - 1.0).abs() < 1e-6 && direction.z >= 0.0);
            assert!(direction.dot(cap.axis) > cap.cos - 1e-6, "{cap:?}: {direction}");
            let value = direction.z / projected.pdf(direction);
            if value.is_finite() {
                (sum, square) = (sum + value, square + value * value);
            }
        }
        let mean = sum / f64::from(n * n);
        let exact = {
            let (s, t) = cap.axis.any_orthonormal_pair();
            let each = |i: i32| {
                let [u, v] = [i % n, i / n].map(|i| (f64::from(i) + 0.5) / f64::from(n));
                let height = u * (1.0 - cap.cos);
                let (sin, cos) = (core::f64::consts::TAU * v).sin_cos();
                let radius = (height * (2.0 - height)).sqrt();
                (cap.axis * (1.0 - height) + (s * cos + t * sin) * radius).z.max(0.0)
            };
            (0..n * n).map(each).sum::<f64>() / f64::from(n * n) * cap.solid_angle()
        };
        Some([mean, exact, (square / f64::from(n * n) / (mean * mean) - 1.0).max(0.0).sqrt()])
    }

    #[test]
    fn caps_are_covered_and_weighed_by_the_cosine() {
        let mut before: f64 = 0.0;
        for sin in [1e-3, 0.1f64, 0.5, 0.9, 0.999_999] {
            for step in 0..=60 {
                let tilt = f64::from(step) * 3.0f64.to_radians();
                let cap = SphericalCap {
                    axis: DVec3::new(tilt.sin() * 0.6, tilt.sin() * 0.8, tilt.cos()),
                    sin,
                    cos: (1.0 - sin * sin).sqrt(),
                };
                let Some([mean, exact, deviation]) = measure(&cap) else { continue };
                assert!((mean - exact).abs() < 0.01 * exact + 1e-12, "{sin} {step}: {mean} {exact}");
                let is_whole = tilt.cos() >= sin;
                assert!(if is_whole { deviation < 1e-3 } else { deviation < 0.5 }, "{sin} {step}: {deviation}");
                // Steps of three degrees are small for wide caps.
                let is_gradual = sin < 0.5 || (deviation - before).abs() < 0.1;
                assert!(is_gradual, "{sin} {step}: from {before} to {deviation}");
                before = deviation;
            }
            before = 0.0;
        }
    }

    #[test]
    fn caps_of_more_than_a_hemisphere_are_covered() {
        for angle in [1.58f64, 1.8, 2.2, 2.8, 3.1] {
            for step in 0..=30 {
                let tilt = f64::from(step) * 6.0f64.to_radians();
                let axis = DVec3::new(tilt.sin() * 0.6, tilt.sin() * 0.8, tilt.cos());
                let cap = SphericalCap { axis, sin: angle.sin(), cos: angle.cos() };
                let Some([mean, exact, deviation]) = measure(&cap) else { panic!("{angle} {step}") };
                assert!((mean - exact).abs() < 0.01 * exact + 1e-3, "{angle} {step}: {mean} {exact}");
                // Rows through the gap are drawn as often as others; a thin ring at the horizon is hardly lit.
                assert!(deviation < 1.0 || exact < 0.5, "{angle} {step}: {deviation}");
            }
        }
    }
}
