//! The equal-area octahedral map between the unit square and the unit sphere.
//!
//! Clarberg, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD", Journal of Graphics Tools 13(3), 2008, in
//! the orientation of pbrt-v4: the center of the square is `+z`, its corners are `-z`, the inscribed diamond is
//! the upper hemisphere, and the square's axes run along `x` and `y`. Equal areas of the square `[0, 1]²` are
//! equal solid angles, 4π for all of it.
//!
//! Only additions, multiplications, divisions and square roots are used, so that the results do not depend on
//! the library that the float functions come from.

use crate::math::{at_least, at_most, limit, sqrt};
use core::f32::consts::{FRAC_1_SQRT_2, TAU};
use glam::{Vec2, Vec3};

/// Returns the unit direction of a point of the unit square. The point is clamped to the square.
///
/// Within 2.5e-7 of the exact map, and within 2.5e-7 of unit length.
#[inline]
pub(crate) fn square_to_sphere(point: Vec2) -> Vec3 {
    let (x, y) = (limit(point.x, 1.0), limit(point.y, 1.0));
    // Distances from the center lines and from the nearest edges, in units of half the side. None of them
    // cancels: 2x - 1 rounds at most once, 1 - x is exact where x > 1/2.
    let (u, v) = ((2.0 * x - 1.0).abs(), (2.0 * y - 1.0).abs());
    let (to_edge_u, to_edge_v) = (2.0 * x.min(1.0 - x), 2.0 * y.min(1.0 - y));
    // Positive on the upper hemisphere, with the size of the distance from the equator's diamond.
    let height = 1.0 - u - v;
    // The lower hemisphere's corner is the upper one's, mirrored at the diamond.
    let (a, b) = if height >= 0.0 { (u, v) } else { (to_edge_v, to_edge_u) };
    let r = a + b;
    // Azimuth in the octant, in quarter turns: measured from the nearer axis so that the small component keeps
    // its relative precision.
    let swap = b > a;
    let minor = if swap { a } else { b };
    let quarter = if r > 0.0 { minor / r } else { 0.0 };
    let (sin, cos) = sin_cos_eighth(quarter);
    let (sin_phi, cos_phi) = if swap { (cos, sin) } else { (sin, cos) };
    // z = 1 - r² above and r² - 1 below; its sine follows without cancellation.
    let z = height.abs().min(1.0) * (1.0 + r);
    let radius = r * sqrt((2.0 - r * r).max(0.0));
    Vec3::new((radius * cos_phi).copysign(x - 0.5), (radius * sin_phi).copysign(y - 0.5), z.copysign(height))
}

/// Returns the point of the unit square that a unit direction maps to, within 2.5e-7 of the exact map.
///
/// Any vector gives a point of the square; it is meaningful only for unit vectors.
#[inline(always)]
pub(crate) fn sphere_to_square(direction: Vec3) -> Vec2 {
    let (x, y, z) = (direction.x.abs(), direction.y.abs(), direction.z.abs());
    // 1 - |z| = (x² + y²) / (1 + |z|): no cancellation near the poles.
    let r = limit(sqrt((x * x + y * y) / (1.0 + z)), 1.0);
    let minor = quarter_of_eighth(x.min(y), x.max(y)) * r;
    let major = r - minor;
    let (a, b) = if y > x { (minor, major) } else { (major, minor) };
    // Distances from the center lines; the lower hemisphere is mirrored at the diamond.
    let (u, v) = if direction.z < 0.0 { (1.0 - b, 1.0 - a) } else { (a, b) };
    let place = |distance: f32, side: f32| limit(0.5 + 0.5 * distance.copysign(side), 1.0);
    Vec2::new(place(u, direction.x), place(v, direction.y))
}

/// Largest coordinate that [`sphere_to_square_quickly`] returns. *Proved*: it is in the last texel of every level that
/// a pyramid may have, 2^13 texels a side.
///
/// Larger than 1 - 2^-13 only: points at the edge would lie in no texel. Smaller: more points are moved.
const LAST: f32 = 1.0 - 1.0 / 131_072.0;

/// Bound on how far a point of [`sphere_to_square_quickly`] is from the exact map, by coordinate. *Measured* over 2e7
/// directions: 3.7e-6 of the polynomial, to which [`LAST`] adds 7.6e-6; the rest is for the rounding of directions.
///
/// Larger: coarser bounds of small regions. Smaller: a lit texel could be missed.
pub(crate) const QUICK_ERROR: f32 = 2e-5;

/// Returns the point of the unit square that a unit direction maps to: quicker than [`sphere_to_square`], and within
/// [`QUICK_ERROR`] of the exact map. Coordinates are in `[0, 1)`.
#[inline(always)]
pub(crate) fn sphere_to_square_quickly([x, y, z]: [f32; 3]) -> [f32; 2] {
    let (ax, ay) = (x.abs(), y.abs());
    let r = sqrt((x * x + y * y) / (1.0 + z.abs()));
    let (small, large) = (at_most(ax, ay), at_least(ax, ay));
    let t = small / at_least(large, f32::MIN_POSITIVE);
    let s = t * t;
    // The arc tangent in quarter turns.
    let angle = t * (0.636_534_5 + s * (-0.210_275_2 + s * (0.114_681_3 + s * (-0.054_197_4 + s * 0.013_264_0))));
    let minor = angle * r;
    let major = r - minor;
    let (a, b) = if ay > ax { (minor, major) } else { (major, minor) };
    let (u, v) = if z < 0.0 { (1.0 - b, 1.0 - a) } else { (a, b) };
    let place = |distance: f32, side: f32| at_least(at_most(0.5 + 0.5 * distance.copysign(side), LAST), 0.0);
    [place(u, x), place(v, y)]
}

/// Sine and cosine of `quarter` quarter turns, for `quarter` in `[0, 1/2]`. Relative error below 1e-7.
#[inline]
fn sin_cos_eighth(quarter: f32) -> (f32, f32) {
    let s = quarter * quarter;
    // Interpolants at Chebyshev nodes of s, rounded to `f32`: 3.6e-8 and 1e-8 before evaluation.
    let sin = quarter * ((1.570_796_4 - 0.645_963_5 * s) + (s * s) * (0.079_680_22 - 0.004_602_149 * s));
    let cos = 1.0 - s * (1.233_700_5 - s * (0.253_669_2 - s * (0.020_860_07 - 0.000_903_628_07 * s)));
    (sin, cos)
}

/// Angle whose tangent is `minor / major`, in quarter turns, for `0 <= minor <= major`. In `[0, 1/2]`.
#[inline(always)]
fn quarter_of_eighth(minor: f32, major: f32) -> f32 {
    // tan(π/8) = √2 - 1. Above it, atan(t) = π/4 - atan((1 - t) / (1 + t)).
    let steep = minor > (2.0 * FRAC_1_SQRT_2 - 1.0) * major;
    let (numerator, denominator) = if steep { (major - minor, major + minor) } else { (minor, major) };
    let t = if denominator > 0.0 { numerator / denominator } else { 0.0 };
    let s = t * t;
    // Interpolant at Chebyshev nodes of s, rounded to `f32`: 4e-8 before evaluation.
    let high = 0.127_158_96 - 0.088_162_22 * s + 0.050_778_642 * (s * s);
    let angle = t * ((0.636_619_75 - 0.212_203_1 * s) + (s * s) * high);
    if steep { 0.5 - angle } else { angle }
}

/// Bound on how far one coordinate of the unit square moves per radian on the sphere. *Proved*:
///
/// With r = √2 sin(θ/2) and f = 2φ/π, a coordinate in `[-1, 1]` is `r f` or `r (1 - f)` up to sign and mirror
/// image; its gradient is at most √(r'² + (r f')²) = √(c²/2 + 2/(π c)²) with c = cos(θ/2) in `[√½, 1]`, which is
/// largest at the pole: 0.8383, half of it for the unit square. Rounded up.
///
/// Larger: coarser bounds of a region's radiance. Smaller: a lit texel could be missed.
pub(crate) const STRETCH: f32 = 0.43;

/// Solid angle of the whole square, 4π steradians. *Proved*: the area of the unit sphere.
pub(crate) const SPHERE: f32 = 2.0 * TAU;

/// Returns the texel of an `n` x `n` equal-area image that lies at a place of the tiled plane.
///
/// Beyond an edge the image continues as its copy, rotated by half a turn about the edge's midpoint, so copies
/// whose tile coordinates add up to an odd number are rotated. A path on the sphere that crosses an edge of the
/// square goes on straight in the plane. `n` is in `1..=2^30`.
#[inline]
pub(crate) fn wrap_texel(x: i32, y: i32, n: i32) -> (u32, u32) {
    let odd = (x.div_euclid(n) ^ y.div_euclid(n)) & 1 != 0;
    let (x, y) = (x.rem_euclid(n), y.rem_euclid(n));
    let (x, y) = if odd { (n - 1 - x, n - 1 - y) } else { (x, y) };
    (x as u32, y as u32)
}

/// [`wrap_texel`] for an image of `2^log2` texels a side, without divisions. `log2` is at most 30.
#[inline]
pub(crate) fn wrap_texel_log2(x: i32, y: i32, log2: u32) -> (u32, u32) {
    let mask = (1 << log2) - 1;
    let odd = ((x >> log2) ^ (y >> log2)) & 1;
    // n - 1 - x is the complement of x in the mask.
    let flip = -odd & mask;
    (((x & mask) ^ flip) as u32, ((y & mask) ^ flip) as u32)
}

#[cfg(test)]
mod tests;
