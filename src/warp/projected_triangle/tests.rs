//! The oracle is the map that is uniform in solid angle, with the cosine as a weight.

use alloc::vec;

use super::*;
use crate::testing::{Pcg32, chi_square, chi_square_limit};
use crate::warp::SphericalTriangle;

/// A triangle above the plane z = 0, in both forms.
fn triangle(corners: [DVec3; 3]) -> Option<(SphericalTriangle, ProjectedTriangle)> {
    let [a, b, c] = corners.map(|corner| DVec3::new(corner.x, corner.y, corner.z.abs()).normalize());
    let determinant = a.dot((b - a).cross(c - a));
    let corners = if determinant < 0.0 { [a, c, b] } else { [a, b, c] };
    let oracle = SphericalTriangle::new(corners, determinant.abs())?;
    Some((oracle, ProjectedTriangle::new(corners, DVec3::Z)?))
}

fn direction(pcg: &mut Pcg32) -> DVec3 {
    pcg.direction().as_dvec3()
}

/// Triangles of all sizes, slivers among them; one in three lies at the horizon, and one in four has a corner on it.
fn triangles(pcg: &mut Pcg32, count: usize) -> impl Iterator<Item = (SphericalTriangle, ProjectedTriangle)> {
    (0..count).filter_map(|i| {
        let sizes = [3.0, 0.1, 1e-2].map(f64::from);
        let (a, size, other) = (direction(pcg), sizes[pcg.below(3) as usize], sizes[pcg.below(3) as usize]);
        let mut corners = [a, a + direction(pcg) * size, a + direction(pcg) * other];
        if i % 3 == 0 {
            let flat = 0.1_f64.powi(pcg.below(6) as i32);
            corners = corners.map(|corner| corner * DVec3::new(1.0, 1.0, flat));
        }
        if i % 4 == 0 {
            corners[0].z = 0.0;
        }
        triangle(corners)
    })
}

/// Centers of the cells of a grid of the unit square.
fn grid(n: u32) -> impl Iterator<Item = [f64; 2]> {
    (0..n * n).map(move |i| [i % n, i / n].map(|k| (f64::from(k) + 0.5) / f64::from(n)))
}

#[test]
fn areas_are_integrals_of_the_cosine() {
    let mut pcg = Pcg32::new(1, 91);
    for (oracle, triangle) in triangles(&mut pcg, 2000).filter(|(oracle, _)| oracle.solid_angle() > 1e-6) {
        let n = 24;
        let sum: f64 = grid(n).map(|u| oracle.direction(u).z).sum();
        let area = sum * oracle.solid_angle() / f64::from(n * n);
        assert!((triangle.area() / area - 1.0).abs() < 0.02, "{triangle:?}: {area}");
    }
}

#[test]
fn directions_are_inside() {
    let mut pcg = Pcg32::new(2, 91);
    for (_, triangle) in triangles(&mut pcg, 2000).filter(|(oracle, _)| oracle.solid_angle() > 1e-6) {
        let ends = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0], [0.5, 0.0], [0.5, 1.0]];
        for u in grid(16).chain(ends) {
            let direction = triangle.direction(u);
            assert!((direction.length() - 1.0).abs() < 1e-9 && direction.z >= 0.0, "{triangle:?} {u:?}");
            assert!(triangle.sides.iter().all(|side| side.dot(direction) > -1e-7), "{triangle:?} {u:?}: {direction}");
        }
    }
}

/// Chi-square tests, each of a significance of 1e-4, against the integrals over the cells of the oracle.
#[test]
fn directions_follow_the_cosine() {
    let (mut scene, mut pcg) = (Pcg32::new(3, 91), Pcg32::new(5, 91));
    let (side, count) = (8_u32, 20_000);
    for (oracle, triangle) in triangles(&mut scene, 60).filter(|(oracle, _)| oracle.solid_angle() > 1e-6) {
        let place = |u: [f64; 2]| u.map(|x| ((x * f64::from(side)) as usize).min(side as usize - 1));
        let cells = (side * side) as usize;
        let (mut observed, mut expected) = (vec![0.0; cells], vec![0.0; cells]);
        for u in grid(16 * side) {
            let [x, y] = place(u);
            expected[y * side as usize + x] += oracle.direction(u).z;
        }
        let scale = f64::from(count) / expected.iter().sum::<f64>();
        expected.iter_mut().for_each(|expected| *expected *= scale);
        for _ in 0..count {
            let u = [0; 2].map(|_| f64::from(pcg.next_f32()));
            let [x, y] = place(oracle.invert(triangle.direction(u)));
            observed[y * side as usize + x] += 1.0;
        }
        let (statistic, degrees) = chi_square(&observed, &expected);
        assert!(statistic < chi_square_limit(degrees), "{triangle:?}: {statistic} of {degrees}");
    }
}
