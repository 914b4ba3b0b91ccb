//! Analytic irradiance of a polygon of radiance 1.

use core::f64::consts::FRAC_PI_2;

use glam::DVec3;

/// Irradiance from a triangle whose vertices are relative to the shading point: clipped to the horizon, then
/// Lambert's `1/2 Σ γ_i cos δ_i` over the edges.
pub(crate) fn irradiance(normal: DVec3, vertices: &[DVec3; 3]) -> f64 {
    let mut polygon = [DVec3::ZERO; 4];
    let mut count = 0;
    let mut push = |v: DVec3| {
        polygon[count] = v.normalize();
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
    let edge = |i: usize| {
        let (v, next) = (polygon[i], polygon[(i + 1) % count]);
        let cross = v.cross(next);
        let sine = cross.length();
        // γ / sin γ tends to 1 for short edges.
        let ratio = if sine < 1e-8 { 1.0 } else { angle(sine, v.dot(next)) / sine };
        ratio * normal.dot(cross)
    };
    0.5 * (0..count).map(edge).sum::<f64>().abs()
}

fn angle(sine: f64, cosine: f64) -> f64 {
    if cosine > 0.7 { sine.asin() } else { FRAC_PI_2 - cosine.atan2(sine) }
}

/// Solid angle of a triangle relative to the shading point (Van Oosterom and Strackee 1983).
pub(crate) fn solid_angle(vertices: &[DVec3; 3]) -> f64 {
    let [a, b, c] = vertices.map(DVec3::normalize);
    let numerator = a.dot((b - a).cross(c - a)).abs();
    2.0 * numerator.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
}
