//! The map against an independent one in double precision (pbrt-v4's formulas).

use super::*;
use crate::testing::Pcg32;
use core::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use glam::{DVec2, DVec3};

fn reference_to_sphere(p: DVec2) -> DVec3 {
    let (u, v) = (2.0 * p.x - 1.0, 2.0 * p.y - 1.0);
    let distance = 1.0 - (u.abs() + v.abs());
    let r = 1.0 - distance.abs();
    let phi = if r == 0.0 { 1.0 } else { (v.abs() - u.abs()) / r + 1.0 } * FRAC_PI_4;
    let z = (1.0 - r * r).copysign(distance);
    let radius = r * (2.0 - r * r).sqrt();
    DVec3::new((radius * phi.cos()).copysign(u), (radius * phi.sin()).copysign(v), z)
}

fn reference_to_square(d: DVec3) -> DVec2 {
    let r = ((d.x * d.x + d.y * d.y) / (1.0 + d.z.abs())).sqrt();
    let phi = d.y.abs().atan2(d.x.abs()) / FRAC_PI_2;
    let (u, v) = (r * (1.0 - phi), r * phi);
    let (u, v) = if d.z < 0.0 { (1.0 - v, 1.0 - u) } else { (u, v) };
    DVec2::new(0.5 + 0.5 * u.copysign(d.x), 0.5 + 0.5 * v.copysign(d.y))
}

/// Dense and random points of the square: grid points hit seams, axes and poles, the rest hits neighborhoods.
fn points() -> impl Iterator<Item = Vec2> {
    let grid = (0..=512).flat_map(|j| (0..=512).map(move |i| Vec2::new(i as f32, j as f32) / 512.0));
    let mut pcg = Pcg32::new(3, 3);
    let random = (0..1_000_000).map(move |_| Vec2::new(pcg.next_f32(), pcg.next_f32()));
    let special = [Vec2::new(0.5, 0.5), Vec2::new(0.0, 0.0), Vec2::new(1.0, 0.5), Vec2::new(0.25, 0.25)];
    let near = special.into_iter().flat_map(|p| {
        (0..120).flat_map(move |e| {
            let offset = 0.8_f32.powi(e);
            (0..16).map(move |k| {
                let (sin, cos) = (TAU * k as f32 / 16.0).sin_cos();
                (p + offset * Vec2::new(cos, sin)).clamp(Vec2::ZERO, Vec2::ONE)
            })
        })
    });
    grid.chain(random).chain(near)
}

#[test]
fn square_to_sphere_is_accurate() {
    let (mut worst, mut length) = (0.0_f64, 0.0_f64);
    for p in points() {
        let d = square_to_sphere(p).as_dvec3();
        worst = worst.max((d - reference_to_sphere(p.as_dvec2())).length());
        length = length.max((d.length() - 1.0).abs());
    }
    assert!(worst < 2.5e-7 && length < 2.5e-7, "{worst:e}, length {length:e}");
}

#[test]
fn sphere_to_square_is_accurate() {
    let mut worst = 0.0_f64;
    let directions = points().map(|p| reference_to_sphere(p.as_dvec2()).as_vec3());
    let mut pcg = Pcg32::new(4, 3);
    for d in directions.chain((0..1_000_000).map(|_| pcg.direction())) {
        // Rounding may have moved the vector off the sphere or across a seam: compare on the sphere.
        let unit = d.as_dvec3().normalize();
        let back = reference_to_sphere(sphere_to_square(d).as_dvec2());
        worst = worst.max((back - unit).length());
        let exact = reference_to_square(unit);
        let on_seam = d.z.abs() < 1e-6 || d.z < 0.0 && d.x.abs().min(d.y.abs()) < 1e-6;
        if !on_seam {
            assert!((sphere_to_square(d).as_dvec2() - exact).length() < 2.5e-7, "{d}");
        }
    }
    // An error of the square, stretched by up to 6.2.
    assert!(worst < 6e-7, "{worst:e}");
}

#[test]
fn round_trips() {
    let (mut on_sphere, mut on_square) = (0.0_f32, 0.0_f32);
    for p in points() {
        let d = square_to_sphere(p);
        let back = sphere_to_square(d);
        on_sphere = on_sphere.max((square_to_sphere(back) - d).length());
        // On the outermost seam the mirrored point is as good; skip what rounding can take across it.
        if p.min_element() > 1e-6 && p.max_element() < 1.0 - 1e-6 {
            on_square = on_square.max((back - p).abs().max_element());
        }
    }
    assert!(on_sphere < 1e-6 && on_square < 5e-7, "sphere {on_sphere:e}, square {on_square:e}");
}

#[test]
fn poles_and_axes_are_exact() {
    assert_eq!(square_to_sphere(Vec2::new(0.5, 0.5)), Vec3::Z);
    for corner in [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE] {
        assert_eq!(square_to_sphere(corner), Vec3::NEG_Z);
        assert!(sphere_to_square(Vec3::new(corner.x - 0.5, corner.y - 0.5, -1e30)).is_finite());
    }
    assert_eq!(sphere_to_square(Vec3::Z), Vec2::new(0.5, 0.5));
    assert_eq!(sphere_to_square(Vec3::X), Vec2::new(1.0, 0.5));
    assert_eq!(sphere_to_square(Vec3::NEG_Y), Vec2::new(0.5, 0.0));
}

#[test]
fn directions_next_to_the_poles_keep_their_azimuth() {
    for z in [1.0, -1.0] {
        for e in 1..30 {
            let d = Vec3::new(3.0 * 0.1_f32.powi(e), 1.0 * 0.1_f32.powi(e), z).normalize();
            let exact = reference_to_square(d.as_dvec3().normalize());
            let pole = DVec2::splat(if z > 0.0 { 0.5 } else { 1.0 });
            let error = (sphere_to_square(d).as_dvec2() - exact).length();
            assert!(error < 1.3e-7 && (exact - pole).length() < 0.5, "{d}: {error:e}");
        }
    }
}

#[test]
fn any_vector_gives_a_point_of_the_square() {
    let values = [0.0, -0.0, 1.0, -1.0, 1e-45, 1e30, -3e38, f32::INFINITY, f32::NEG_INFINITY, f32::NAN];
    for x in values {
        for y in values {
            for z in values {
                let p = sphere_to_square(Vec3::new(x, y, z));
                assert!((0.0..=1.0).contains(&p.x) && (0.0..=1.0).contains(&p.y), "{x} {y} {z}: {p}");
            }
            let d = square_to_sphere(Vec2::new(x, y));
            assert!((d.length() - 1.0).abs() < 1e-6, "{x} {y}: {d}");
        }
    }
}

#[test]
fn wrapped_neighbors_are_neighbors_on_the_sphere() {
    for n in [1, 2, 5, 16, 64] {
        let center = |(x, y): (u32, u32)| square_to_sphere((Vec2::new(x as f32, y as f32) + 0.5) / n as f32);
        for y in -3 * n..4 * n {
            for x in -3 * n..4 * n {
                let here = center(wrap_texel(x, y, n));
                for (dx, dy) in [(1, 0), (0, 1)] {
                    let next = center(wrap_texel(x + dx, y + dy, n));
                    // Two centers are a texel's side apart in the plane; a unit of the square is up to 6.2 radians
                    // (at the equator, on the axes).
                    let limit = 6.3 / n as f32;
                    assert!(here.angle_between(next) < limit, "{n}: ({x}, {y}) + ({dx}, {dy})");
                }
                if n & (n - 1) == 0 {
                    assert_eq!(wrap_texel(x, y, n), wrap_texel_log2(x, y, n.trailing_zeros()));
                }
            }
        }
        assert_eq!(wrap_texel(n / 2, n - 1, n), (n as u32 / 2, n as u32 - 1));
    }
    // Any offset, without overflow.
    for n in [1, 3, 1 << 13] {
        for offset in [i32::MIN, i32::MIN + 1, i32::MAX] {
            let (x, y) = wrap_texel(offset, offset, n);
            assert!((x as i32) < n && (y as i32) < n);
        }
    }
}

#[test]
fn no_path_moves_faster_than_the_stretch() {
    let mut pcg = Pcg32::new(9, 9);
    let mut worst = 0.0_f64;
    for _ in 0..1_000_000 {
        let d = pcg.direction().as_dvec3().normalize();
        let step = 1e-5 * pcg.direction().as_dvec3().cross(d);
        let e = (d + step).normalize();
        if d.x * e.x < 0.0 || d.y * e.y < 0.0 || d.z * e.z < 0.0 {
            continue;
        }
        let moved = (reference_to_square(d) - reference_to_square(e)).abs().max_element();
        let angle = d.cross(e).length();
        if angle > 1e-8 {
            worst = worst.max(moved / angle);
        }
    }
    assert!(worst > 0.4 && worst < 0.98 * f64::from(STRETCH), "{worst}");
}
