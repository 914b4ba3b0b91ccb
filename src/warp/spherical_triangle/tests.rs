use alloc::vec::Vec;

use super::*;
use crate::testing::{Pcg32, chi_square, chi_square_limit};

fn triangle(corners: [DVec3; 3]) -> Option<SphericalTriangle> {
    let [a, b, c] = corners;
    let determinant = a.dot((b - a).cross(c - a));
    let corners = if determinant < 0.0 { [a, c, b] } else { corners };
    SphericalTriangle::new(corners, determinant.abs())
}

fn direction(pcg: &mut Pcg32) -> DVec3 {
    pcg.direction().as_dvec3().normalize()
}

/// Triangles of all sizes, slivers among them: by the size of two of the sides.
fn triangles(pcg: &mut Pcg32, count: usize, sizes: [f64; 2]) -> Vec<SphericalTriangle> {
    core::iter::repeat_with(|| {
        let a = direction(pcg);
        let (b, c) = (a + direction(pcg) * sizes[0], a + direction(pcg) * sizes[1]);
        triangle([a, b * 3.0, c * 0.5])
    })
    .flatten()
    .take(count)
    .collect()
}

#[test]
fn functions_are_those_of_the_library() {
    let mut pcg = Pcg32::new(1, 71);
    for i in 0..100_000 {
        let x = f64::from(pcg.next_f32()) * PI * [1.0, 1e-6][i % 2];
        let (sin, cos) = sin_cos(x);
        assert!((sin - x.sin()).abs() <= 1e-12 * x.min(1.0) && (cos - x.cos()).abs() < 1e-12, "{x}");
        let (y, x) = (f64::from(pcg.next_f32()) * [1.0, 1e-9, 1e9][i % 3], f64::from(pcg.next_f32()) - 0.5);
        let (found, exact) = (angle(y, x), y.atan2(x));
        assert!((found - exact).abs() <= 1e-11 * exact, "{y} {x}: {found} {exact}");
    }
}

#[test]
fn points_are_found_again() {
    let mut pcg = Pcg32::new(2, 71);
    for sizes in [[1.0, 1.0], [0.1, 0.1], [1e-3, 1e-3], [1.0, 1e-3], [1e-3, 2.0], [1.9, 1.9]] {
        for triangle in triangles(&mut pcg, 300, sizes) {
            if triangle.solid_angle() < 1e-8 {
                continue;
            }
            for _ in 0..100 {
                let [u, v] = [0; 2].map(|_| 1e-3 + 0.998 * f64::from(pcg.next_f32()));
                let direction = triangle.direction([u, v]);
                assert!((direction.length() - 1.0).abs() < 1e-9);
                let [found_u, found_v] = triangle.invert(direction);
                let error = (found_u - u).abs().max((found_v - v).abs());
                assert!(error < 1e-4, "{triangle:?} {u} {v}: {error}");
            }
        }
    }
}

#[test]
fn any_point_and_any_direction_are_safe() {
    let mut pcg = Pcg32::new(3, 71);
    for sizes in [[1.0, 1.0], [1e-3, 1e-7], [2.0, 2.0]] {
        for triangle in triangles(&mut pcg, 100, sizes) {
            for u in [0.0, 1e-300, 0.5, 1.0 - f64::EPSILON, 1.0] {
                for v in [0.0, 1e-300, 0.5, 1.0] {
                    let direction = triangle.direction([u, v]);
                    assert!(direction.is_finite() && (direction.length() - 1.0).abs() < 1e-6, "{triangle:?} {u} {v}");
                }
            }
            if triangle.solid_angle() < 1e-6 {
                continue;
            }
            for corner in [triangle.a, triangle.b, triangle.c] {
                let [u, v] = triangle.invert(corner);
                // At a corner of the triangle, whole rows meet: any of them, or none, is right.
                let is_safe = |v: f64| v.is_nan() || (-1e-3..=1.001).contains(&v);
                assert!(is_safe(u) && is_safe(v), "{triangle:?} {corner} {u} {v}");
            }
        }
    }
}

#[test]
fn equal_areas_are_equal_solid_angles() {
    let mut pcg = Pcg32::new(4, 71);
    for sizes in [[1.0, 1.0], [1.9, 1.9], [1.0, 0.3]] {
        for triangle in triangles(&mut pcg, 3, sizes) {
            // Directions uniform over the sphere that fall into the triangle.
            let SphericalTriangle { a, b, c, .. } = triangle;
            let sides = [a.cross(b), b.cross(c), c.cross(a)];
            let inside = |d: DVec3| sides.iter().all(|side| side.dot(d) > 0.0);
            let mut counts = [0.0; 64];
            let mut tried = 0.0;
            let total = 20_000.0;
            while counts.iter().sum::<f64>() < total && tried < 2e6 {
                tried += 1.0;
                let d = direction(&mut pcg);
                if inside(d) {
                    let [i, j] = triangle.invert(d).map(|x| ((x * 8.0) as usize).min(7));
                    counts[j * 8 + i] += 1.0;
                }
            }
            let found: f64 = counts.iter().sum();
            let share = triangle.solid_angle() / (4.0 * PI);
            let deviation = (share * (1.0 - share) * tried).sqrt();
            assert!((found - share * tried).abs() < 5.0 * deviation + 1.0, "{found} of {tried}: {share}");
            let (statistic, degrees) = chi_square(&counts, &[found / 64.0; 64]);
            assert!(statistic < chi_square_limit(degrees), "{triangle:?}: {statistic} of {degrees}");
        }
    }
}

#[test]
fn columns_are_those_of_single_directions() {
    let mut pcg = Pcg32::new(5, 71);
    for sizes in [[1.0, 1.0], [0.01, 0.01], [1.9, 1.9]] {
        for triangle in triangles(&mut pcg, 300, sizes) {
            if triangle.solid_angle() < 1e-6 {
                continue;
            }
            let mut columns = SphericalColumns::default();
            triangle.columns::<0, 4>(1.0 / 16.0, 1.0 / 8.0, &mut columns);
            triangle.columns::<4, 4>(9.0 / 16.0, 1.0 / 8.0, &mut columns);
            for i in 0..8 {
                let end = triangle.direction([(i as f64 + 0.5) / 8.0, 1.0]);
                let found = DVec3::from_array(columns.ends.map(|end| f64::from(end[i])));
                assert!((end - found).length() < 1e-4, "{triangle:?} {end} {found}");
                assert!((1.0 - end.dot(triangle.pole()) - f64::from(columns.versines[i])).abs() < 1e-4);
            }
        }
    }
}
