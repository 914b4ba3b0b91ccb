use alloc::vec::Vec;

use glam::{Affine3A, DVec3, Mat3A, Vec3, Vec3A};

use super::{EndVertices, Motion, MotionCollection, MovingTriangle};
use crate::blas::Root;
use crate::bounds::{LightBounds, Moments};
use crate::light::{LightKind, LightTriangle};
use crate::testing::Pcg32;

fn vector(pcg: &mut Pcg32) -> Vec3 {
    Vec3::from_array([0; 3].map(|_| 2.0 * pcg.next_f32() - 1.0))
}

/// The angle between two directions, in double precision.
fn angle(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b))
}

/// A triangle that turns and moves, by a little or by much.
fn triangle(pcg: &mut Pcg32, round: usize) -> (LightTriangle, EndVertices) {
    let far = if round % 3 == 0 { 1e6 } else { 0.0 };
    let start = [(); 3].map(|()| vector(pcg));
    let turn = Mat3A::from_axis_angle(vector(pcg).normalize(), [0.1, 1.5, 3.0][round % 3]);
    let end = start.map(|p| Vec3::from(turn * Vec3A::from(p)) + [0.3, 2.0][round % 2] * vector(pcg));
    let [start, end] = [start, end].map(|vertices| vertices.map(|p| (p + Vec3::splat(far)).to_array()));
    (LightTriangle { vertices: start, root: Root::constant(1.0), index_and_flags: 5 }, end)
}

#[test]
fn bounds_hold_at_all_times_and_moments_are_means() {
    let mut pcg = Pcg32::new(1, 71);
    let mut narrow = 0;
    for round in 0..300 {
        let (record, end) = triangle(&mut pcg, round);
        let mut motion = MotionCollection::default();
        motion.set_mesh(3, [record.vertices; 2].into_iter().chain([end]).collect());
        let words = motion.pack();
        let at = |time: f32| MovingTriangle::new(&record, Motion(&words), time);
        let (bounds, moments): (LightBounds, Moments) = at(0.0).bounds(false, |area| area);
        narrow += i32::from(bounds.normals.theta < 1.5);
        let steps = 300;
        let (mut sum, mut mean, mut square) = (0.0, DVec3::ZERO, 0.0);
        let mut vectors = DVec3::ZERO;
        for i in 0..=steps {
            let moving = at(i as f32 / steps as f32);
            for vertex in moving.exactly_relative_to(Vec3::ZERO) {
                assert!(vertex.cmpge(bounds.aabb.min.as_dvec3() - 1e-9).all(), "{round} {i}");
                assert!(vertex.cmple(bounds.aabb.max.as_dvec3() + 1e-9).all(), "{round} {i}");
            }
            let front = moving.double_area_vector();
            let off = angle(front, bounds.normals.axis.as_dvec3());
            assert!(off <= f64::from(bounds.normals.theta) + 1e-9, "{round} {i}: {off} {:?}", bounds.normals);
            let [a, b, c] = moving.exactly_relative_to(moments.mean);
            let weight = if i == 0 || i == steps { 0.5 } else { 1.0 } / f64::from(steps);
            sum += weight * 0.5 * front.length();
            vectors += weight * 0.5 * front;
            mean += weight * (a + b + c) / 3.0;
            let squares = [a, b, c, a + b + c].map(DVec3::length_squared);
            square += weight * squares.iter().sum::<f64>() / 12.0;
        }
        let energy = f64::from(moments.energy);
        let size = f64::from(bounds.aabb.extent().length());
        // Every sixth moves a little. With the others, Simpson's rule is off where the area goes down to almost nothing
        // and up again.
        let granted = if round % 6 == 0 { 0.05 } else { 0.5 };
        assert!((energy - sum).abs() < granted * sum, "{round}: {energy}, not {sum}");
        assert!(mean.length() < 1e-3 * size + 0.2 * f64::from(u8::from(round % 3 == 0)), "{round}: {mean}");
        assert!((f64::from(moments.variance) - square).abs() < 1e-2 * size * size + 0.05, "{round}: {square}");
        let normal = (vectors / energy).clamp_length_max(1.0);
        assert!((normal - moments.normal.as_dvec3()).length() < 1e-2, "{round}: {normal} {}", moments.normal);
    }
    assert!(narrow > 100, "{narrow} of 300 cones are narrow");
}

#[test]
fn what_moves_is_found_by_its_number() {
    let ends = |first: f32, count: usize| (0..count).map(|i| [[first + i as f32; 3]; 3]).collect::<Vec<EndVertices>>();
    let mut motion = MotionCollection::default();
    motion.set_mesh(40, ends(40.0, 3));
    motion.set_mesh(2, ends(2.0, 5));
    motion.set_mesh(20, ends(20.0, 1));
    motion.set_mesh(20, Vec::new());
    for number in [9, 1, 700] {
        motion.set_instance(number, Some(Affine3A::from_translation(Vec3::splat(number as f32)).to_cols_array_2d()));
    }
    motion.set_instance(1, None);
    let words = motion.pack();
    assert_eq!(Motion(&words).validate(), Ok(()));
    for index in [2, 6, 40, 42] {
        assert_eq!(Motion(&words).end_of_triangle(index), Some(&[[index as f32; 3]; 3]));
    }
    assert_eq!([1, 43].map(|index| Motion(&words).end_of_triangle(index)), [None; 2]);
    for number in [9, 700] {
        assert_eq!(Motion(&words).end_of_instance(number).map(|columns| columns[3]), Some([number as f32; 3]));
    }
    assert_eq!([0, 1, 10].map(|number| Motion(&words).end_of_instance(number)), [None; 3]);
    assert_eq!(MotionCollection::of(Motion(&words)).pack(), words);
    assert!(MotionCollection::default().pack().is_empty());
    let mut cut = words.clone();
    cut.pop();
    assert!(Motion(&cut).validate().is_err());
}
