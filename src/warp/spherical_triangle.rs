//! The equal-area map between the unit square and a spherical triangle.
//!
//! Arvo, "Stratified Sampling of Spherical Triangles", SIGGRAPH 1995, rearranged so that nothing cancels at small or
//! large angles. With the corners `a`, `b`, `c`, the angle α at `a` and the side `c` from `a` to `b`, the part of the
//! triangle that an arc from `b` to the side across from it cuts off has the excess `x = u Ω` where the arc ends at the
//! distance `b'` from `a`, with
//!
//! `tan(b'/2) = sin(x/2) / (tan(c/2) sin(α - x/2))`.
//!
//! Along that arc equal steps of `1 - cos θ`, with θ counted from `b`, are equal areas, and `1 - cos θ = |e - b|² / 2`
//! at its end `e`. The trigonometric functions are polynomials of this file, so that the bits of a result do not depend
//! on the library that the float functions come from.

use core::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use glam::DVec3;

use crate::math::{at_least, sqrt, sqrt64};

/// Least sum of squares that columns divide by. *Proved*: it is a normal `f32`, and below what any triangle of a solid
/// angle of 1e-8 has.
///
/// Larger: columns of small triangles would be wrong. Smaller: a quotient could be infinite.
const LEAST_SQUARE: f32 = 1e-36;

/// Most columns of cells that are found at once: lanes of a vector.
pub(crate) const COLUMNS: usize = 8;

/// A spherical triangle around the origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SphericalTriangle {
    /// Unit direction of the corner that angles are counted at.
    a: DVec3,
    /// Unit direction of the corner that all arcs start from.
    b: DVec3,
    /// Unit direction of the third corner.
    c: DVec3,
    /// Unit vector perpendicular to `a`, on the side of `c` in their plane.
    across: DVec3,
    solid_angle: f64,
    sin_alpha: f64,
    cos_alpha: f64,
    /// Tangent of half the side from `a` to `b`.
    tan_half: f64,
}

/// What all points of each column of cells share.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SphericalColumns {
    /// Ends of the arcs through the centers of the columns, by coordinate.
    pub(crate) ends: [[f32; COLUMNS]; 3],
    /// Unit vectors perpendicular to the common start of the arcs, towards their ends, by coordinate.
    pub(crate) toward: [[f32; COLUMNS]; 3],
    /// `1 - cos θ` at the ends.
    pub(crate) versines: [f32; COLUMNS],
}

impl SphericalTriangle {
    /// Returns the triangle that is seen of a flat one with these corners, of any distance from the origin.
    ///
    /// `determinant` is that of the corners, positive. It is passed in because it cannot be computed from the corners
    /// without cancellation where the origin is almost in the triangle's plane. `None` where the solid angle is not
    /// positive.
    #[inline(always)]
    pub(crate) fn new(corners: [DVec3; 3], determinant: f64) -> Option<Self> {
        let inverse = corners.map(|corner| 1.0 / sqrt64(corner.length_squared()));
        let [a, b, c] = [corners[0] * inverse[0], corners[1] * inverse[1], corners[2] * inverse[2]];
        let triple = determinant * (inverse[0] * inverse[1] * inverse[2]);
        // Van Oosterom and Strackee 1983.
        let cos_ac = a.dot(c);
        let solid_angle = 2.0 * angle(triple, 1.0 + a.dot(b) + b.dot(c) + cos_ac);
        // sin α |a x b| |a x c| is the triple product, cos α the same with the dot product of the normals.
        let cos = a.cross(b).dot(a.cross(c));
        let radius2 = triple * triple + cos * cos;
        let inverse = 1.0 / sqrt64(radius2);
        let across = c - a * cos_ac;
        let tan_half = sqrt64((a - b).length_squared() / (a + b).length_squared());
        let across = across * (1.0 / sqrt64(across.length_squared()));
        let (sin_alpha, cos_alpha) = (triple * inverse, cos * inverse);
        // NaN and infinity fail.
        let is_valid = solid_angle > 0.0 && tan_half < f64::INFINITY && sin_alpha > 0.0 && across.is_finite();
        is_valid.then_some(Self { a, b, c, across, solid_angle, sin_alpha, cos_alpha, tan_half })
    }

    #[inline(always)]
    pub(crate) fn solid_angle(&self) -> f64 {
        self.solid_angle
    }

    /// Returns the unit directions of the corners, in positive orientation as seen from the origin.
    #[inline(always)]
    pub(crate) fn corners(&self) -> [DVec3; 3] {
        [self.a, self.b, self.c]
    }

    /// Returns the unit direction of the corner that all columns meet in.
    #[inline(always)]
    pub(crate) fn pole(&self) -> DVec3 {
        self.b
    }

    /// Returns a normal of the plane of the first and the third corner.
    #[inline(always)]
    pub(crate) fn last_side(&self) -> DVec3 {
        self.a.cross(self.c)
    }

    /// Returns the direction of a point of the unit square. `u` divides the triangle into columns, `v` a column into
    /// rows.
    #[inline(always)]
    pub(crate) fn direction(&self, [u, v]: [f64; 2]) -> DVec3 {
        let (s, k) = sin_cos(0.5 * u * self.solid_angle);
        let d = self.tan_half * positive(self.sin_alpha * k - self.cos_alpha * s);
        // tan(b'/2) = s / d.
        let q = 1.0 / (d * d + s * s);
        let end = self.a * ((d * d - s * s) * q) + self.across * (2.0 * s * d * q);
        let arc = end - self.b;
        let versine = 0.5 * arc.length_squared();
        let toward = arc + self.b * versine;
        let m = v * versine;
        let sin = sqrt64(positive(m * (2.0 - m)) / toward.length_squared());
        let direction = self.b * (1.0 - m) + toward * sin;
        // In the corner itself the quotient is not a number.
        if direction.is_finite() { direction } else { self.b }
    }

    /// Returns the point of the unit square of a unit direction. Outside of the triangle it is outside of the square,
    /// or near its edge.
    #[inline(always)]
    pub(crate) fn invert(&self, direction: DVec3) -> [f64; 2] {
        // The great circle through b and the direction crosses that of a and c in a x + across y, up to the sign.
        let normal = self.b.cross(direction);
        let (x, y) = (normal.dot(self.across), -normal.dot(self.a));
        let side = x * (1.0 + self.a.dot(self.c)) + y * self.across.dot(self.c);
        let (x, y) = if side < 0.0 { (-x, -y) } else { (x, y) };
        let r = sqrt64(x * x + y * y);
        let end = (self.a * x + self.across * y) * (1.0 / r);
        let tan = if x < 0.0 { (r - x) / y } else { y / (r + x) };
        let k = self.tan_half * tan;
        let (sin, cos) = (k * self.sin_alpha, 1.0 + k * self.cos_alpha);
        // A direction on the far side of the first edge: no more than rounding.
        let u = if sin > 0.0 { 2.0 * angle(sin, cos) / self.solid_angle } else { 0.0 };
        let v = (direction - self.b).length_squared() / (end - self.b).length_squared();
        [u, v]
    }

    /// Writes `COUNT` columns from the column `START` on, whose centers have the `u` of `first`, `first + step`, and so
    /// on.
    #[inline(always)]
    pub(crate) fn columns<const START: usize, const COUNT: usize>(
        &self,
        first: f64,
        step: f64,
        columns: &mut SphericalColumns,
    ) {
        let (sin_step, cos_step) = sin_cos(0.5 * self.solid_angle * step);
        let (mut sin, mut cos) = sin_cos(0.5 * self.solid_angle * first);
        let (mut sines, mut cosines) = ([0.0; COUNT], [0.0; COUNT]);
        for i in 0..COUNT {
            (sines[i], cosines[i]) = (sin as f32, cos as f32);
            (sin, cos) = (sin * cos_step + cos * sin_step, cos * cos_step - sin * sin_step);
        }
        let (sin_alpha, cos_alpha, tan_half) = (self.sin_alpha as f32, self.cos_alpha as f32, self.tan_half as f32);
        let (a, b, across) = (self.a.as_vec3(), self.b.as_vec3(), self.across.as_vec3());
        let SphericalColumns { ends, toward, versines } = columns;
        // As in `direction`.
        for i in 0..COUNT {
            let s = sines[i];
            let d = tan_half * at_least(sin_alpha * cosines[i] - cos_alpha * s, 0.0);
            let (d2, s2) = (d * d, s * s);
            let q = 1.0 / at_least(d2 + s2, LEAST_SQUARE);
            let (k, l) = ((d2 - s2) * q, 2.0 * s * d * q);
            let (ex, ey, ez) = (a.x * k + across.x * l, a.y * k + across.y * l, a.z * k + across.z * l);
            let (dx, dy, dz) = (ex - b.x, ey - b.y, ez - b.z);
            let m = 0.5 * (dx * dx + dy * dy + dz * dz);
            let (px, py, pz) = (dx + b.x * m, dy + b.y * m, dz + b.z * m);
            let r = 1.0 / sqrt(at_least(px * px + py * py + pz * pz, LEAST_SQUARE));
            (ends[0][START + i], ends[1][START + i], ends[2][START + i]) = (ex, ey, ez);
            (toward[0][START + i], toward[1][START + i], toward[2][START + i]) = (px * r, py * r, pz * r);
            versines[START + i] = m;
        }
    }
}

/// The number, or zero where it is negative or NaN.
#[inline(always)]
pub(super) fn positive(x: f64) -> f64 {
    if x > 0.0 { x } else { 0.0 }
}

/// Returns sine and cosine of an angle in `[0, π]`, within 1e-12; the sine of a small angle to the same relative error.
#[inline(always)]
pub(super) fn sin_cos(angle: f64) -> (f64, f64) {
    // Reciprocal factorials.
    const S3: f64 = -1.0 / 6.0;
    const S5: f64 = -S3 / 20.0;
    const S7: f64 = -S5 / 42.0;
    const S9: f64 = -S7 / 72.0;
    const S11: f64 = -S9 / 110.0;
    const S13: f64 = -S11 / 156.0;
    const C2: f64 = 1.0 / 2.0;
    const C4: f64 = -C2 / 12.0;
    const C6: f64 = -C4 / 30.0;
    const C8: f64 = -C6 / 56.0;
    const C10: f64 = -C8 / 90.0;
    const C12: f64 = -C10 / 132.0;
    const C14: f64 = -C12 / 182.0;
    // The series of a quarter of the angle, doubled twice.
    let h = 0.25 * angle;
    let q = h * h;
    let sin = h * (1.0 + q * (S3 + q * (S5 + q * (S7 + q * (S9 + q * (S11 + q * S13))))));
    let versine = q * (C2 + q * (C4 + q * (C6 + q * (C8 + q * (C10 + q * (C12 + q * C14))))));
    let cos = 1.0 - versine;
    let (sin, cos) = (2.0 * sin * cos, 1.0 - 2.0 * sin * sin);
    (2.0 * sin * cos, 1.0 - 2.0 * sin * sin)
}

/// Returns the angle of the point `(x, y)` in `[0, π]` for `y >= 0`, within a relative error of 1e-12.
#[inline(always)]
pub(super) fn angle(y: f64, x: f64) -> f64 {
    let size = x.abs();
    let is_steep = y > size;
    let (minor, major) = if is_steep { (size, y) } else { (y, size) };
    // tan(π/8) = √2 - 1. Above it, atan(t) = π/4 - atan((1 - t) / (1 + t)).
    let is_wide = minor > (core::f64::consts::SQRT_2 - 1.0) * major;
    let (numerator, denominator) = if is_wide { (major - minor, major + minor) } else { (minor, major) };
    let t = numerator / denominator;
    let s = t * t;
    // Interpolant of atan(t) / t at Chebyshev nodes of t² in [0, tan²(π/8)]: 7.6e-13.
    let (s2, s4) = (s * s, (s * s) * (s * s));
    let low = (0.999_999_999_999_244_7 - 0.333_333_332_769_224_94 * s)
        + s2 * (0.199_999_930_535_558_15 - 0.142_853_865_537_521_39 * s);
    let high = (0.111_034_569_089_474_64 - 0.089_925_529_061_509_12 * s)
        + s2 * (0.069_741_976_865_952_65 - 0.037_655_106_012_914_02 * s);
    let angle = t * (low + s4 * high);
    let angle = if is_wide { FRAC_PI_4 - angle } else { angle };
    let angle = if is_steep { FRAC_PI_2 - angle } else { angle };
    if x < 0.0 { PI - angle } else { angle }
}

#[cfg(test)]
mod tests;
