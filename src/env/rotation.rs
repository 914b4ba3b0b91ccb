//! How the environment stands in the world.

use crate::error::{Error, ErrorKind};
use glam::{DMat3, Mat3, Vec3};

/// Largest deviation of a rotation from orthonormal that is accepted. *Format*: part of the interface.
///
/// Larger: skewed matrices pass as rotations. Smaller: products of many rotations are refused.
const ROTATION_TOLERANCE: f64 = 1e-4;

/// Largest deviation from orthonormal that rounding to `f32` leaves. *Proved*: each dot product of two columns is
/// off by at most 4 half units in the last place, 2.4e-7, rounded up.
///
/// Larger: less exact rotations are left as they are. Smaller: a rotation could change when it is set again.
const ROTATION_EXACT: f64 = 5e-7;

/// World direction of a direction in the environment's frame.
#[inline]
pub(super) fn to_world(rotation: &[[f32; 3]; 3], local: Vec3) -> Vec3 {
    Mat3::from_cols_array_2d(rotation) * local
}

/// Direction in the environment's frame of a world direction.
#[inline(always)]
pub(super) fn to_local(rotation: &[[f32; 3]; 3], world: Vec3) -> Vec3 {
    let [x, y, z] = rotation.map(Vec3::from_array);
    Vec3::new(x.dot(world), y.dot(world), z.dot(world))
}

/// Checks a rotation, and re-orthonormalizes it, so that its transpose is its inverse to `f32` precision.
///
/// A matrix that is that exact already is returned as it is.
pub(super) fn checked(rotation: Mat3) -> Result<[[f32; 3]; 3], Error> {
    let m: DMat3 = rotation.as_dmat3();
    let determinant = m.determinant();
    let deviation = m.transpose() * m - DMat3::IDENTITY;
    let largest = deviation.to_cols_array().into_iter().fold(0.0, |a: f64, b| if b.abs() <= a { a } else { b.abs() });
    // Negated comparisons, so that NaN fails too.
    if !(largest <= 2.0 * ROTATION_TOLERANCE && (determinant - 1.0).abs() <= ROTATION_TOLERANCE) {
        return Err(Error(ErrorKind::Rotation { determinant: determinant as f32 }));
    }
    if largest <= ROTATION_EXACT {
        return Ok(rotation.to_cols_array_2d());
    }
    let x = m.x_axis.normalize();
    let y = (m.y_axis - x * x.dot(m.y_axis)).normalize();
    Ok([x, y, x.cross(y)].map(|column| column.as_vec3().to_array()))
}
