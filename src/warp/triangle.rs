//! Unit square to triangle.
//!
//! Heitz, "A Low-Distortion Map Between Triangle and Square", 2019. Area-preserving and continuous, so that
//! well-stratified points in the square stay well stratified in the triangle; no square root.

use crate::math::sqrt64;

/// Maps `u` in `[0, 1]²` to the barycentric coordinates `[b1, b2]` of a point of the triangle `b1, b2 >= 0`,
/// `b1 + b2 <= 1`. Uniform input gives a uniform point.
#[inline]
pub(crate) fn square_to_triangle(u: [f64; 2]) -> [f64; 2] {
    let [x, y] = u;
    if y > x { [0.5 * x, y - 0.5 * x] } else { [x - 0.5 * y, 0.5 * y] }
}

/// The inverse of [`square_to_triangle`].
#[cfg_attr(not(test), expect(dead_code, reason = "the oracle of the tests"))]
#[inline]
pub(crate) fn triangle_to_square(b: [f64; 2]) -> [f64; 2] {
    let [b1, b2] = b;
    if b2 > b1 { [2.0 * b1, b1 + b2] } else { [b1 + b2, 2.0 * b2] }
}

/// Steps of Newton's method. *Proved* by the tests: a share of the area is off by less than 1e-9 for weights
/// of a ratio of up to 8 to either side.
///
/// Larger: time. Smaller: points that do not follow the density.
const NEWTON_STEPS: usize = 3;

/// Maps `u` in `[0, 1]²` to the barycentric coordinates `[b1, b2]` of a point of the triangle, so that uniform input
/// gives points of the density that is linear between these positive weights of the corners.
///
/// `u[0]` divides the triangle by lines parallel to the side across from the first corner, `u[1]` along a line.
#[inline]
pub(crate) fn square_to_linear_triangle([u, v]: [f64; 2], [w0, w1, w2]: [f64; 3]) -> [f64; 2] {
    // The share of the area next to the first corner, up to the line of b1 + b2 = s, is s² (b + a s), with a + b = 1.
    let b = 3.0 * w0 / (w0 + w1 + w2);
    let a = 1.0 - b;
    // The root of it is closer to linear: with a small a, it is s (1 - a (1 - s) / 2).
    let target = sqrt64(u);
    let mut s = target * (1.0 + 0.5 * a * (1.0 - target));
    for _ in 0..NEWTON_STEPS {
        let root = sqrt64(b + a * s);
        s -= (s * root - target) * root / (b + 1.5 * a * s);
        s = if s > 0.0 { s.min(1.0) } else { 0.0 };
    }
    // Along the line the density is linear between these.
    let (first, last) = (w0 * (1.0 - s) + w1 * s, w0 * (1.0 - s) + w2 * s);
    let t = v * (first + last) / (first + sqrt64(first * first + v * (last * last - first * first)));
    [s * (1.0 - t), s * t]
}

/// Returns the density of [`square_to_linear_triangle`] at `[b1, b2]`, relative to the uniform density.
#[inline]
pub(crate) fn linear_pdf([b1, b2]: [f64; 2], [w0, w1, w2]: [f64; 3]) -> f64 {
    3.0 * (w0 * (1.0 - b1 - b2) + w1 * b1 + w2 * b2) / (w0 + w1 + w2)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The points of a fine grid of the square fall into each of the cells of a coarse one of the triangle by its
    /// integral.
    #[test]
    fn linear_points_follow_their_density() {
        for weights in
            [[1.0, 1.0, 1.0], [8.0, 1.0, 1.0], [1.0, 8.0, 1.0], [1.0, 8.0, 8.0], [8.0, 1.0, 8.0], [3.0, 5.0, 4.0]]
        {
            let share = |s: f64| {
                let b = 3.0 * weights[0] / weights.iter().sum::<f64>();
                s * s * (b + (1.0 - b) * s)
            };
            for i in 0..=64 {
                let (u, v) = (f64::from(i) / 64.0, f64::from(i * 37 % 65) / 64.0);
                let [b1, b2] = square_to_linear_triangle([u, v], weights);
                assert!(b1 >= 0.0 && b2 >= 0.0 && b1 + b2 <= 1.0 + 1e-15);
                assert!((share(b1 + b2) - u).abs() < 1e-9, "{weights:?}, {u}: {}", share(b1 + b2));
            }
            // Moments against a quadrature of the density over the triangle.
            let n = 200;
            let (mut drawn, mut integrated) = ([0.0; 3], [0.0; 3]);
            let moments = |[b1, b2]: [f64; 2]| [b1, b2, b1 * b2];
            for i in 0..n {
                for j in 0..n {
                    let u = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(n));
                    let uniform = square_to_triangle(u);
                    let weight = linear_pdf(uniform, weights);
                    for k in 0..3 {
                        drawn[k] += moments(square_to_linear_triangle(u, weights))[k];
                        integrated[k] += weight * moments(uniform)[k];
                    }
                }
            }
            for k in 0..3 {
                let relative = drawn[k] / integrated[k] - 1.0;
                assert!(relative.abs() < 1e-4, "{weights:?}, moment {k}: {relative}");
            }
        }
    }

    #[test]
    fn corners_and_round_trip() {
        assert_eq!(square_to_triangle([0.0, 0.0]), [0.0, 0.0]);
        assert_eq!(square_to_triangle([1.0, 0.0]), [1.0, 0.0]);
        assert_eq!(square_to_triangle([0.0, 1.0]), [0.0, 1.0]);
        for i in 0..=16 {
            for j in 0..=16 {
                let u = [f64::from(i) / 16.0, f64::from(j) / 16.0];
                let [b1, b2] = square_to_triangle(u);
                assert!(b1 >= 0.0 && b2 >= 0.0 && b1 + b2 <= 1.0);
                assert_eq!(triangle_to_square([b1, b2]), u);
            }
        }
    }

    /// Each quarter of the triangle gets a quarter of the square.
    #[test]
    fn preserves_area() {
        let n = 512;
        let mut counts = [0u32; 4];
        for i in 0..n {
            for j in 0..n {
                let u = [(f64::from(i) + 0.5) / f64::from(n), (f64::from(j) + 0.5) / f64::from(n)];
                let [b1, b2] = square_to_triangle(u);
                let quarter = if b1 > 0.5 {
                    1
                } else if b2 > 0.5 {
                    2
                } else if b1 + b2 < 0.5 {
                    0
                } else {
                    3
                };
                counts[quarter] += 1;
            }
        }
        let expected = f64::from(n * n) / 4.0;
        for count in counts {
            assert!((f64::from(count) / expected - 1.0).abs() < 0.01, "{counts:?}");
        }
    }
}
