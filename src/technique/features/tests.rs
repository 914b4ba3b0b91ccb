//! Bright features through openings: areas are exact, and nothing that is seen is left out.

use super::opening::{Coverage, Opening};
use super::texel_cut::TexelCut;
use crate::env::{Environment, EnvironmentView};
use crate::record::Filter;
use crate::testing::Pcg32;
use crate::warp::Variate;
use crate::warp::equal_area::sphere_to_square;
use alloc::vec;
use alloc::vec::Vec;
use core::f32::consts::TAU;
use glam::{DVec3, Mat3, Quat, Vec3};

const SIZE: usize = 512;

fn any_rotation(pcg: &mut Pcg32) -> Mat3 {
    Mat3::from_quat(Quat::from_axis_angle(pcg.direction().normalize(), TAU * pcg.next_f32()))
}

/// Suns in the middle of a face of the octahedron, on its edges (the equator among them) and corners, and one of
/// more texels than are kept apart.
fn zoo(pcg: &mut Pcg32) -> Vec<Environment> {
    let places = [(150, 200, 3), (256, 256, 3), (80, 176, 3), (256, 80, 3), (2, 256, 3), (2, 2, 2), (200, 181, 17)];
    let sun = |(x, y, side): (usize, usize, usize)| {
        let mut image = vec![0.1; SIZE * SIZE];
        for (i, j) in (0..side * side).map(|k| (k % side, k / side)) {
            image[(y + j - side / 2) * SIZE + x + i - side / 2] = 1000.0 + 500.0 * i as f32;
        }
        let environment = Environment::from_equal_area(SIZE, &image, Filter::Nearest).unwrap();
        assert!(!environment.as_view().feature_nodes().is_empty(), "{x} {y}");
        environment.with_rotation(any_rotation(pcg)).unwrap()
    };
    places.into_iter().map(sun).collect()
}

/// A triangle with corners in and around a sun.
fn triangle(view: &EnvironmentView<'_>, pcg: &mut Pcg32) -> [DVec3; 3] {
    let (axis, radius) = (view.feature_axis(0), view.feature_nodes()[0].sin_radius);
    [0; 3].map(|_| {
        let offset = Vec3::from_array([0; 3].map(|_| 2.0 * pcg.next_f32() - 1.0));
        ((axis + 1.5 * radius * offset) * (1.0 + 3.0 * pcg.next_f32())).as_dvec3()
    })
}

/// Largest margin of a texel, as a share of its size. Where the map bends within a texel (next to its poles, and on
/// the equator) it is a tenth and more, elsewhere a hundredth.
fn margin(view: &EnvironmentView<'_>) -> f64 {
    view.feature_texels(0).iter().fold(0.0, |most, texel| f64::from(texel.margin / texel.radius).max(most))
}

fn variates(pcg: &mut Pcg32, salt: u64) -> [Variate; 2] {
    [Variate::new(pcg.next_f32(), salt), Variate::new(pcg.next_f32(), !salt)]
}

fn is_inside(triangle: [DVec3; 3], direction: Vec3) -> bool {
    crate::geometry::intersect(triangle, direction).is_some()
}

#[test]
fn what_is_seen_is_what_rays_find() {
    let mut pcg = Pcg32::new(5, 41);
    for environment in zoo(&mut pcg) {
        let view = environment.as_view();
        let power = view.feature_nodes()[0].power;
        for _ in 0..40 {
            let triangle = triangle(&view, &mut pcg);
            let share = f64::from(Opening::new(&view, triangle).power(&view, 0) / power);
            let n = 4000;
            let hits = (0..n).filter(|&i| is_inside(triangle, view.sample_feature(0, variates(&mut pcg, i)))).count();
            let found = hits as f64 / n as f64;
            let bound = 5.0 * (found.max(1e-3) / n as f64).sqrt();
            assert!(share > found - bound && share < found + 0.01 + margin(&view) + bound, "{share} {found}");
        }
    }
}

#[test]
fn nothing_that_is_seen_is_left_out() {
    let mut pcg = Pcg32::new(6, 41);
    for environment in zoo(&mut pcg) {
        let view = environment.as_view();
        let sun = view.feature_nodes()[0];
        for i in 0..20_000 {
            let triangle = triangle(&view, &mut pcg);
            let direction = view.sample_feature(0, variates(&mut pcg, i));
            if !is_inside(triangle, direction) {
                continue;
            }
            let opening = Opening::new(&view, triangle);
            assert!(opening.coverage(&sun) != Coverage::Nothing);
            let point = sphere_to_square(view.rotation().transpose() * direction);
            let (block, _) = view.feature_at(direction).expect("a block of the sun");
            let texel = &view.feature_texels(0)[block as usize];
            let place = (point * (1_u32 << texel.level) as f32).fract() - 0.5;
            match TexelCut::new(texel, &opening.planes) {
                TexelCut::Nothing => panic!("{direction} is seen"),
                TexelCut::All => {}
                TexelCut::Part(polygon, _) => assert!(polygon.holds(place.to_array(), 1e-3), "{polygon:?} {place}"),
            }
        }
    }
}

#[test]
fn directions_into_what_is_seen() {
    let mut pcg = Pcg32::new(7, 41);
    for environment in zoo(&mut pcg) {
        let view = environment.as_view();
        let (mut drawn, mut missed) = (0, 0);
        for i in 0..20_000 {
            let triangle = triangle(&view, &mut pcg);
            let opening = Opening::new(&view, triangle);
            let power = opening.power(&view, 0);
            if power < 0.05 * view.feature_nodes()[0].power {
                continue;
            }
            let direction = opening.sample(&view, 0, power, variates(&mut pcg, i));
            assert!(view.feature_at(direction).is_some());
            drawn += 1;
            missed += u32::from(!is_inside(triangle, direction));
        }
        let share = f64::from(missed) / f64::from(drawn);
        assert!(drawn > 5000 && share < 3.0 * margin(&view), "{missed} of {drawn}, {}", margin(&view));
    }
}
