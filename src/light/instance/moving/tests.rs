use glam::{Mat3, Quat};

use super::super::Object;
use super::*;
use crate::testing::Pcg32;

fn vector(pcg: &mut Pcg32) -> Vec3 {
    Vec3::from_array([0; 3].map(|_| 2.0 * pcg.next_f32() - 1.0))
}

fn columns(linear: Mat3, translation: Vec3) -> EndColumns {
    Affine3A::from_mat3_translation(linear, translation).to_cols_array_2d()
}

/// An instance that turns and grows, by a little or by much, mirrored or not.
fn motion(pcg: &mut Pcg32, round: usize) -> (InstanceRecord, EndColumns) {
    let axis = vector(pcg).normalize();
    let turn = Mat3::from_quat(Quat::from_axis_angle(axis, [0.0, 0.2, 1.0, 2.5][round % 4]));
    let bend = Mat3::from_diagonal(Vec3::new(1.0, 0.4 + pcg.next_f32(), if round % 3 == 0 { -1.0 } else { 1.0 }));
    let start = Mat3::from_cols(Vec3::X, Vec3::new(0.3, 1.0, 0.0), Vec3::Z) * bend;
    let end = turn * start * (0.5 + pcg.next_f32());
    let record = InstanceRecord { columns: columns(start, vector(pcg)), object: 0, scale: 1.0, leaf: 0, number: 0 };
    (record, columns(end, vector(pcg)))
}

#[test]
fn cones_and_boxes_hold_at_all_times() {
    let mut pcg = Pcg32::new(1, 72);
    let (mut narrow, mut moving) = (0, 0);
    for round in 0..200 {
        let (record, end) = motion(&mut pcg, round);
        if record.check_motion(&end, [Vec3::NEG_ONE, Vec3::ONE]).is_err() {
            continue;
        }
        moving += 1;
        let at = |time: f32| PlacedObject { record: &record, object: Object::at(&[], 0), end: Some(&end), time };
        let (axis, theta) = (vector(&mut pcg).normalize(), [0.0, 0.3, 1.4][round % 3]);
        let cone = at(0.0).moving_cone(axis, theta).expect("it moves");
        narrow += i32::from(cone.theta < 1.5);
        let ends = at(0.0).ends();
        for i in 0..=64 {
            let placement = at(i as f32 / 64.0).placement();
            assert!(placement.determinant * ends[0].determinant > 0.0, "{round} {i}");
            assert!(placement.condition() <= 1.01 * LARGEST_CONDITION, "{round} {i}");
            let (s, t) = axis.any_orthonormal_pair();
            for k in 0..16 {
                let (sin, cos) = (0.4 * k as f32).sin_cos();
                let tilt = theta * [1.0, 0.5][k % 2];
                let normal = axis * tilt.cos() + (s * cos + t * sin) * tilt.sin();
                let mapped: DVec3 = placement.areas() * normal.as_dvec3();
                let off = mapped.angle_between(cone.axis.as_dvec3());
                assert!(off <= f64::from(cone.theta) + 1e-6, "{round} {i}: {off} {cone:?}");
            }
            let corner = placement.relative_to(Vec3::ZERO, Vec3::ONE);
            let between = ends.map(|end| end.relative_to(Vec3::ZERO, Vec3::ONE));
            let outside = (between[0].min(between[1]) - corner).max(corner - between[0].max(between[1]));
            assert!(outside.max_element() < 1e-12, "{round} {i}: {outside}");
        }
    }
    assert!(moving > 150 && narrow > 30, "{narrow} of {moving} cones are narrow");
}

#[test]
fn transforms_that_cannot_be_inverted_are_found() {
    let record =
        |linear| InstanceRecord { columns: columns(linear, Vec3::ZERO), object: 0, scale: 1.0, leaf: 0, number: 0 };
    let check = |start: Mat3, end: Mat3| {
        let fault = record(start).check_motion(&columns(end, Vec3::ZERO), [Vec3::ZERO, Vec3::ONE]);
        fault.map_err(|InstanceFault { value, .. }| value)
    };
    let scale = |x: f32, y: f32, z: f32| Mat3::from_diagonal(Vec3::new(x, y, z));
    assert_eq!(check(Mat3::IDENTITY, scale(1.0, -3.0, 1.0)), Err(0.25));
    assert_eq!(check(scale(1.0, -1.0, 1.0), Mat3::IDENTITY), Err(0.5));
    // Positive at both ends, and negative in between.
    assert!(check(Mat3::IDENTITY, scale(-1.0, -2.0, 1.0)).is_err_and(|time| (0.3..=0.5).contains(&time)));
    for angle in [0.1, 1.0, 2.0, 3.0, 3.1] {
        assert_eq!(check(Mat3::IDENTITY, Mat3::from_rotation_y(angle)), Ok(()), "{angle}");
    }
    let mut pcg = Pcg32::new(2, 72);
    for _ in 0..300 {
        let [start, end] = [(); 2].map(|()| Mat3::from_cols(vector(&mut pcg), vector(&mut pcg), vector(&mut pcg)));
        let least = (0..=200).fold(f32::INFINITY, |least, i| {
            let now: DMat3 = start.as_dmat3() + (end - start).as_dmat3() * f64::from(i) / 200.0;
            least.min((now.determinant() * start.as_dmat3().determinant().signum()) as f32)
        });
        match check(start, end) {
            Ok(()) => assert!(least > 0.0, "{start} {end}: {least}"),
            Err(_) => assert!(least < 1e-2, "{start} {end}: {least}"),
        }
    }
}
