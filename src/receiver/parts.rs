//! Sums over small parts of a triangle, for what a lobe scatters of it.

use glam::Vec3;

use super::lobe::SPREAD_OF_RADIUS2;
use crate::math::sqrt;

/// Points along an edge of a triangle whose irradiance is found by its parts.
///
/// Chosen. Larger: closer for narrow lobes next to large triangles, for a time in proportion to the square. Smaller:
/// the opposite.
const EDGE_PARTS: usize = 4;

/// Returns the mean over the directions to a triangle, whose vertices are relative to the shading point, of a function that is
/// evaluated at the center of each part: of the center, its distance, and the variance of the directions to the part. `None`
/// counts as zero.
#[inline(always)]
pub(super) fn mean_over_parts(vertices: &[Vec3; 3], value: impl Fn(Vec3, f32, f32) -> Option<f32>) -> f32 {
    let [a, b, c] = *vertices;
    let (e1, e2) = (b - a, c - a);
    let step = 1.0 / EDGE_PARTS as f32;
    let area = 0.5 * step * step * e1.cross(e2).length();
    let center = (a + b + c) * (1.0 / 3.0);
    let radius2 = vertices.iter().fold(0.0, |r: f32, v| r.max((*v - center).length_squared()));
    let variance = SPREAD_OF_RADIUS2 * step * step * radius2;
    let (mut sum, mut weight) = (0.0, 0.0);
    for i in 0..EDGE_PARTS {
        // Every second part is inverted, and the last of a row has no partner.
        for j in 0..2 * (EDGE_PARTS - i) - 1 {
            let inverted = 1.0 + (j % 2) as f32;
            let [b1, b2] = [i, j / 2].map(|k| (k as f32 + inverted * (1.0 / 3.0)) * step);
            let p = a + e1 * b1 + e2 * b2;
            let softened = p.length_squared() + 0.25 * area;
            let distance = sqrt(softened);
            // The area's height over the point is the same everywhere.
            let solid_angle = 1.0 / (softened * distance);
            weight += solid_angle;
            if let Some(value) = value(p, distance, variance / softened) {
                sum += solid_angle * value;
            }
        }
    }
    if weight > 0.0 { sum / weight } else { 0.0 }
}
