//! Environments of all sorts, put to the promises of the module.

mod building;
mod bytes;
mod features;
mod sampling;

use super::Environment;
use crate::record::Filter;
use crate::testing::Pcg32;
use alloc::vec;
use alloc::vec::Vec;
use core::f32::consts::{PI, TAU};
use glam::{Mat3, Quat, Vec3};

/// Direction of a point of a latitude-longitude image in the environment's own frame.
fn lat_long_direction(u: f32, v: f32) -> Vec3 {
    let ((sin_phi, cos_phi), (sin, cos)) = ((TAU * u).sin_cos(), (PI * v).sin_cos());
    Vec3::new(cos_phi * sin, -sin_phi * sin, cos)
}

/// Random luminance over many orders of magnitude, a tenth of the texels black.
pub(super) fn noise(count: usize, seed: u64) -> Vec<f32> {
    let mut pcg = Pcg32::new(seed, 1);
    (0..count).map(|_| if pcg.next_f32() < 0.1 { 0.0 } else { (12.0 * pcg.next_f32() - 6.0).exp() }).collect()
}

/// An image with one lit texel.
pub(super) fn one_lit(width: usize, height: usize, x: usize, y: usize) -> Vec<f32> {
    let mut image = vec![0.0; width * height];
    image[y * width + x] = 1.0;
    image
}

pub(super) fn any_rotation(pcg: &mut Pcg32) -> Mat3 {
    Mat3::from_quat(Quat::from_axis_angle(pcg.direction().normalize(), TAU * pcg.next_f32()))
}

/// A few environments that have little in common.
pub(super) fn zoo() -> Vec<Environment> {
    let mut pcg = Pcg32::new(77, 1);
    let mut sun = vec![0.01; 64 * 32];
    sun[5 * 64 + 13] = 1e10;
    vec![
        Environment::from_equal_area(16, &noise(256, 1), Filter::Nearest).unwrap(),
        Environment::from_lat_long(40, 20, &noise(800, 2), Filter::Bilinear).unwrap(),
        Environment::from_lat_long(64, 32, &sun, Filter::Nearest).unwrap(),
        Environment::from_lat_long(16, 8, &one_lit(16, 8, 3, 0), Filter::Bilinear).unwrap(),
        Environment::from_equal_area(7, &noise(49, 3), Filter::Bilinear).unwrap(),
        Environment::from_equal_area(64, &one_lit(64, 64, 63, 0), Filter::Nearest).unwrap(),
        Environment::from_equal_area(2, &[1.0, 0.0, 1e-20, 1e20], Filter::Nearest).unwrap(),
    ]
    .into_iter()
    .map(|e| e.with_rotation(any_rotation(&mut pcg)).unwrap())
    .collect()
}
