//! Exact irradiance and solid angle of a triangle, as far as `f32` goes.

use glam::Vec3;

use crate::math;

/// Least squared sine of an obtuse edge's angle. *Proved*: rounding of unit vectors leaves 1e-7 of uncertainty in it. A
/// larger one would show where a point is that close to an edge, a smaller one would divide by zero.
const LEAST_SINE2: f32 = 1e-7;

/// Returns Lambert's formula for the polygon that is left of a triangle above the horizon, the irradiance over π:
/// `1 / 2π Σ γ_i cos δ_i`, with γ the angle of an edge and δ the angle between its plane's normal and the receiver's
/// (Lambert 1760; Arvo 1995, "Analytic methods for simulated light transport", section 3).
pub(super) fn lambert(normal: Vec3, vertices: &[Vec3; 3]) -> f32 {
    let heights = vertices.map(|v| normal.dot(v));
    let [a, b, c] = heights.map(|height| height >= 0.0);
    if a & b & c {
        let [a, b, c] = vertices.map(|v| v.normalize_or_zero());
        return normal.dot(edge(a, b) + edge(b, c) + edge(c, a)).abs();
    }
    if a | b | c { normal.dot(clipped(vertices, heights)).abs() } else { 0.0 }
}

/// Returns the sum over the edges of what is left of a triangle above the horizon.
fn clipped(vertices: &[Vec3; 3], heights: [f32; 3]) -> Vec3 {
    let mut polygon = [Vec3::ZERO; 4];
    let mut count = 0;
    let mut push = |v: Vec3| {
        polygon[count] = v.normalize_or_zero();
        count += 1;
    };
    for i in 0..3 {
        let j = (i + 1) % 3;
        let (v, next, height, next_height) = (vertices[i], vertices[j], heights[i], heights[j]);
        if height >= 0.0 {
            push(v);
        }
        if (height >= 0.0) != (next_height >= 0.0) {
            push(v + (next - v) * (height / (height - next_height)));
        }
    }
    (0..count).map(|i| edge(polygon[i], polygon[(i + 1) % count])).sum()
}

/// Returns the normal of an edge's plane, times the edge's angle over 2π.
///
/// The cross product has the sine as its length. The quotient of an angle and its sine is a smooth function of the
/// cosine, here as a rational one within 1.5e-6 (Hill and Heitz 2016, "Real-time area lighting: a journey from research
/// to production"); unlike an arccosine, it is as good for short edges.
#[inline(always)]
fn edge(v: Vec3, next: Vec3) -> Vec3 {
    let cosine = v.dot(next);
    let x = cosine.abs();
    let acute = (0.854_398_5 + (0.496_515_5 + 0.014_520_6 * x) * x) / (3.417_594 + (4.161_672_4 + x) * x);
    let per_sine =
        if cosine > 0.0 { acute } else { 0.5 / math::sqrt((1.0 - cosine * cosine).max(LEAST_SINE2)) - acute };
    v.cross(next) * per_sine
}

/// Returns the solid angle of a triangle (Van Oosterom and Strackee 1983).
pub(super) fn solid_angle(vertices: &[Vec3; 3]) -> f32 {
    let [a, b, c] = vertices.map(|v| v.normalize_or_zero());
    let numerator = a.dot(b.cross(c)).abs();
    let denominator = 1.0 + a.dot(b) + b.dot(c) + c.dot(a);
    2.0 * math::atan2(numerator, denominator)
}
