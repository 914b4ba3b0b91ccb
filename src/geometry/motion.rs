//! Vertices and maps that move linearly over an interval, and what bounds their normals and determinants in between.
//!
//! Products of two or three linear functions of the time are polynomials, and a polynomial lies in the convex hull of
//! its Bernstein coefficients (Farin 2002, section 4.3). So bounds over an interval are bounds of a few vectors or
//! numbers.

use glam::{DMat3, DVec3};

/// Returns what is at this share of the way from one end to the other: exact at both ends, and wherever both are equal.
#[inline]
pub(crate) fn between(start: DVec3, end: DVec3, time: f64) -> DVec3 {
    if time == 1.0 { end } else { start + (end - start) * time }
}

/// Returns the Bernstein coefficients of the cross product of two edges that move from the first pair to the second.
pub(crate) fn area_vectors([a, b]: [DVec3; 2], [c, d]: [DVec3; 2]) -> [DVec3; 3] {
    [a.cross(b), (a.cross(d) + c.cross(b)) * 0.5, c.cross(d)]
}

/// Returns the Bernstein coefficients of the matrix that maps area vectors, without its sign, where vectors are mapped
/// by a matrix that moves from the first to the second: that of cofactors.
pub(crate) fn cofactors(start: &DMat3, end: &DMat3) -> [DMat3; 3] {
    let middle = (mixed_cofactors(start, end) + mixed_cofactors(end, start)) * 0.5;
    [mixed_cofactors(start, start), middle, mixed_cofactors(end, end)]
}

fn mixed_cofactors(a: &DMat3, b: &DMat3) -> DMat3 {
    DMat3::from_cols(a.y_axis.cross(b.z_axis), a.z_axis.cross(b.x_axis), a.x_axis.cross(b.y_axis))
}

/// Returns the Bernstein coefficients of the determinant of a matrix that moves from the first to the second.
pub(crate) fn determinants(start: &DMat3, end: &DMat3) -> [f64; 4] {
    let product = |a: &DMat3, b: &DMat3| {
        let cofactors = mixed_cofactors(a, a);
        cofactors.x_axis.dot(b.x_axis) + cofactors.y_axis.dot(b.y_axis) + cofactors.z_axis.dot(b.z_axis)
    };
    let third = 1.0 / 3.0;
    [product(start, start) * third, product(start, end) * third, product(end, start) * third, product(end, end) * third]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Pcg32;

    fn matrix(pcg: &mut Pcg32) -> DMat3 {
        let mut column = || DVec3::from_array([0; 3].map(|_| f64::from(2.0 * pcg.next_f32() - 1.0)));
        DMat3::from_cols(column(), column(), column())
    }

    #[test]
    fn coefficients_are_those_of_the_polynomials() {
        let mut pcg = Pcg32::new(6, 61);
        for _ in 0..100 {
            let (start, end) = (matrix(&mut pcg), matrix(&mut pcg));
            let t = f64::from(pcg.next_f32());
            let s = 1.0 - t;
            let now = start * s + end * t;
            let [a, b, c] = cofactors(&start, &end);
            let sum = a * (s * s) + b * (2.0 * s * t) + c * (t * t);
            let expected = now.inverse().transpose() * now.determinant();
            assert!((sum - expected).to_cols_array().iter().all(|x| x.abs() < 1e-9), "{sum} {expected}");
            let [a, b, c, d] = determinants(&start, &end);
            let sum = a * s * s * s + 3.0 * (b * s * s * t + c * s * t * t) + d * t * t * t;
            assert!((sum - now.determinant()).abs() < 1e-12);
            let [a, b, c] = area_vectors([start.x_axis, start.y_axis], [end.x_axis, end.y_axis]);
            let sum = a * (s * s) + b * (2.0 * s * t) + c * (t * t);
            assert!((sum - now.x_axis.cross(now.y_axis)).length() < 1e-12);
        }
    }

    #[test]
    fn ends_are_exact() {
        let (start, end) = (DVec3::new(0.1, 1e9, -3.3), DVec3::new(1e9, -0.7, -3.3));
        assert_eq!([between(start, end, 0.0), between(start, end, 1.0)], [start, end]);
        assert_eq!(between(start, end, 0.3).z, -3.3);
    }
}
