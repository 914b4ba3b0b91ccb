//! Unit square to triangle.
//!
//! Heitz, "A Low-Distortion Map Between Triangle and Square", 2019. Area-preserving and continuous, so that
//! well-stratified points in the square stay well stratified in the triangle; no square root.

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

#[cfg(test)]
mod tests {
    use super::*;

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
