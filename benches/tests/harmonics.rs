//! Spherical harmonics of polygons, against quadrature.

#[path = "../quality/harmonics.rs"]
mod harmonics;

use core::f64::consts::TAU;

use glam::DVec3;
use harmonics::{Harmonics, MAX_DEGREE};

/// Directions on a grid of equal solid angles.
fn sphere(n: usize) -> impl Iterator<Item = DVec3> {
    let at = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
    (0..n).flat_map(move |i| {
        (0..2 * n).map(move |j| {
            let z = 1.0 - 2.0 * at(i, n);
            let (sine, cosine) = (TAU * at(j, 2 * n)).sin_cos();
            DVec3::new(cosine, sine, 0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z
        })
    })
}

/// A function of degree 3, times the direction of degree 4.
fn radiance(d: DVec3) -> f64 {
    2.0 + d.x - 0.5 * d.y * d.z + 1.5 * d.x * d.y * d.z
}

#[test]
fn a_polynomial_is_its_own_projection() {
    let harmonics = Harmonics::of_radiance(MAX_DEGREE, sphere(512).map(|d| (d, radiance(d))));
    for d in sphere(8) {
        let (found, expected) = (harmonics.at(d), d * radiance(d));
        assert!((found - expected).length() < 1e-3, "{found} instead of {expected}");
    }
}

#[test]
fn the_integral_over_a_polygon_is_that_of_its_points() {
    let corners =
        [DVec3::new(1.0, 0.1, -0.2), DVec3::new(0.3, 1.0, 0.1), DVec3::new(0.2, 0.3, 1.0)].map(DVec3::normalize);
    let is_inside = |d: DVec3| (0..3).all(|i| corners[i].cross(corners[(i + 1) % 3]).dot(d) > 0.0);
    // A sharp function, so that all degrees matter.
    let bright = |d: DVec3| f64::from(u8::from(d.dot(corners[0]) > 0.8));
    for degree in [1, 3, 5, MAX_DEGREE] {
        let harmonics = Harmonics::of_radiance(degree, sphere(128).map(|d| (d, bright(d))));
        let fine = 1024;
        let sum: DVec3 = sphere(fine).filter(|d| is_inside(*d)).map(|d| harmonics.at(d)).sum();
        let expected = sum * 2.0 * TAU / (2 * fine * fine) as f64;
        let found = harmonics.integral(&corners);
        assert!(
            (found - expected).length() < 1e-3 * expected.length(),
            "degree {degree}: {found} instead of {expected}"
        );
    }
}
