use alloc::vec::Vec;

use glam::{Mat3, Vec3, vec3};

use super::*;
use crate::blas::Root;
use crate::geometry;
use crate::testing::Pcg32;

/// A parallelogram of two triangles, with its front to `u × v`.
fn quad(corner: Vec3, u: Vec3, v: Vec3) -> Vec<LightTriangle> {
    let [a, b, c, d] = [corner, corner + u, corner + u + v, corner + v];
    [[a, b, c], [a, c, d]].map(triangle).to_vec()
}

fn triangle(vertices: [Vec3; 3]) -> LightTriangle {
    LightTriangle { vertices: vertices.map(|vertex| vertex.to_array()), root: Root::constant(1.0), index_and_flags: 0 }
}

fn two_sided(lights: Vec<LightTriangle>) -> Vec<LightTriangle> {
    let mark = |light: LightTriangle| LightTriangle {
        index_and_flags: light.index_and_flags | LightTriangle::TWO_SIDED,
        ..light
    };
    lights.into_iter().map(mark).collect()
}

/// Windows in two walls and the ceiling of a room, all facing in.
fn room() -> Vec<LightTriangle> {
    let mut lights = quad(vec3(0.0, 0.5, 1.0), Vec3::Y, Vec3::Z);
    lights.extend(quad(vec3(0.0, 2.5, 1.0), Vec3::Y, Vec3::Z));
    lights.extend(quad(vec3(4.0, 1.0, 1.0), Vec3::Z, Vec3::Y));
    lights.extend(quad(vec3(1.0, 1.0, 3.0), Vec3::Y, Vec3::X));
    lights
}

fn moved(lights: &[LightTriangle], rotation: Mat3, offset: Vec3) -> Vec<LightTriangle> {
    let change = |light: &LightTriangle| LightTriangle {
        vertices: light.vertices.map(|vertex| (rotation * Vec3::from(vertex) + offset).to_array()),
        ..*light
    };
    lights.iter().map(change).collect()
}

fn joined(mut lights: Vec<LightTriangle>, others: Vec<LightTriangle>) -> Vec<LightTriangle> {
    lights.extend(others);
    lights
}

#[test]
fn lights_side_by_side_are_crossed_once() {
    let window = quad(Vec3::ZERO, Vec3::X, Vec3::Y);
    assert!(is_crossed_once(&window));
    assert!(is_crossed_once(&two_sided(window.clone())));
    let neighbor = quad(vec3(1.0, 0.25, 0.0), Vec3::X, Vec3::Y);
    assert!(is_crossed_once(&joined(window.clone(), neighbor)));
    let back = quad(vec3(2.0, 0.0, 0.0), Vec3::Y, Vec3::X);
    assert!(is_crossed_once(&joined(window, back)));
    assert!(is_crossed_once(&[]));
}

#[test]
fn overlapping_lights_are_not() {
    let window = quad(Vec3::ZERO, Vec3::X, Vec3::Y);
    assert!(!is_crossed_once(&joined(window.clone(), window.clone())));
    assert!(!is_crossed_once(&joined(window.clone(), quad(vec3(0.99, 0.99, 0.0), Vec3::X, Vec3::Y))));
    // Small next to the rest of the wall.
    let small = quad(vec3(1e3, 0.0, 0.0), 1e-2 * Vec3::X, 1e-2 * Vec3::Y);
    assert!(is_crossed_once(&joined(window.clone(), small.clone())));
    assert!(!is_crossed_once(&joined(joined(window, small.clone()), small)));
}

#[test]
fn a_room_that_its_windows_face_is_crossed_once() {
    for (rotation, offset) in
        [(Mat3::IDENTITY, Vec3::ZERO), (Mat3::from_axis_angle(vec3(0.6, 0.8, 0.0), 1.1), vec3(30.0, -20.0, 7.0))]
    {
        assert!(is_crossed_once(&moved(&room(), rotation, offset)));
        // A lamp in its middle, a window that faces out, one that shines to both sides.
        let lamp = quad(vec3(2.0, 2.0, 2.0), 0.1 * Vec3::Y, 0.1 * Vec3::X);
        let outward = quad(vec3(4.0, 3.0, 1.0), 0.5 * Vec3::Y, Vec3::Z);
        let both = two_sided(quad(vec3(4.0, 3.0, 1.0), Vec3::Z, 0.5 * Vec3::Y));
        for other in [lamp, outward, both] {
            assert!(!is_crossed_once(&moved(&joined(room(), other), rotation, offset)));
        }
    }
}

#[test]
fn a_wall_of_many_windows_is_recognized() {
    let windows = |side: u32| -> Vec<LightTriangle> {
        let corner = |i: u32| vec3((i % side) as f32, 0.0, (i / side) as f32);
        (0..side * side).flat_map(|i| quad(corner(i), 0.5 * Vec3::X, 0.5 * Vec3::Z)).collect()
    };
    assert!(is_crossed_once(&windows(60)));
    let mut tilted = windows(10);
    tilted[7].vertices[0][1] += 0.01;
    assert!(!is_crossed_once(&tilted));
}

/// Rays between random points around the room meet at most one of its windows from the front.
#[test]
fn rays_agree() {
    let lights = room();
    let mut pcg = Pcg32::new(7, 1);
    let mut met = 0;
    for _ in 0..20_000 {
        let mut point = || Vec3::from([(); 3].map(|()| pcg.next_f32())).as_dvec3() * 8.0 - 2.0;
        let (from, to) = (point(), point());
        let direction = (to - from).as_vec3();
        let count = lights
            .iter()
            .filter(|light| {
                let triangle = light.triangle();
                let faces = triangle.double_area_vector().dot(direction.as_dvec3()) < 0.0;
                faces && geometry::intersect(triangle.exactly_relative_to(from.as_vec3()), direction).is_some()
            })
            .count();
        assert!(count <= 1, "{from} {to}");
        met += count;
    }
    assert!(met > 500, "{met}");
}
