//! Exact irradiance and solid angle of a triangle, as far as `f32` goes.

use core::f32::consts::FRAC_1_PI;

use glam::Vec3;

use crate::math;

/// Returns Lambert's formula for the polygon that is left of a triangle above the horizon, the irradiance over π:
/// `1 / 2π Σ γ_i cos δ_i`, with γ the angle of an edge and δ the angle between its plane's normal and the receiver's
/// (Lambert 1760; Arvo 1995, "Analytic methods for simulated light transport", section 3).
pub(super) fn lambert(normal: Vec3, vertices: &[Vec3; 3]) -> f32 {
    let mut polygon = [Vec3::ZERO; 4];
    let mut count = 0;
    let mut push = |v: Vec3| {
        polygon[count] = v.normalize_or_zero();
        count += 1;
    };
    for i in 0..3 {
        let (v, next) = (vertices[i], vertices[(i + 1) % 3]);
        let (height, next_height) = (normal.dot(v), normal.dot(next));
        if height >= 0.0 {
            push(v);
        }
        if (height >= 0.0) != (next_height >= 0.0) {
            push(v + (next - v) * (height / (height - next_height)));
        }
    }
    let edges = (0..count).map(|i| {
        let (v, next) = (polygon[i], polygon[(i + 1) % count]);
        math::acos(v.dot(next)) * normal.dot(v.cross(next).normalize_or_zero())
    });
    0.5 * FRAC_1_PI * edges.sum::<f32>().abs()
}

/// Returns the solid angle of a triangle (Van Oosterom and Strackee 1983).
pub(super) fn solid_angle(vertices: &[Vec3; 3]) -> f32 {
    let [a, b, c] = vertices.map(|v| v.normalize_or_zero());
    let numerator = a.dot(b.cross(c)).abs();
    let denominator = 1.0 + a.dot(b) + b.dot(c) + c.dot(a);
    2.0 * math::atan2(numerator, denominator)
}
