//! Which side of a receiver's plane a triangle is on, proof against rounding.

use glam::Vec3;

/// Relative error granted to the dot products that decide about the horizon.
///
/// Proved: a dot product of three terms in `f32` is off by less than 8 units in the last place of the sum of the terms'
/// sizes, 1e-6; this is ten times that. A larger value keeps more of what is dark, a smaller one than 1e-6 could lose
/// light.
pub(crate) const HORIZON_ROUNDING: f32 = 1e-5;

/// Returns the height over the receiver's plane below which a vertex is certain to be, whatever rounding has done to
/// the heights of cells of the triangle with these vertices.
#[inline]
pub(crate) fn horizon(normal: Vec3, vertices: &[Vec3; 3]) -> f32 {
    let largest = vertices.iter().fold(0.0, |largest: f32, v| largest.max(normal.abs().dot(v.abs())));
    -HORIZON_ROUNDING * largest
}

/// Whether all vertices lie below the horizon of a normal, and not only by rounding.
#[inline]
pub(crate) fn is_below(normal: Vec3, vertices: &[Vec3; 3]) -> bool {
    vertices.iter().all(|v| normal.dot(*v) < -HORIZON_ROUNDING * normal.abs().dot(v.abs()))
}
