//! An affine map from the space of an object to the world, and what it does to directions, normals and balls.

use glam::{DMat3, DVec3, Vec3};

use super::motion::between;
use crate::math;

/// Rounding granted to a bound on the length of a vector that was mapped. *Proved*: a bound in double precision is off
/// by about 1e-14. Larger: bounds are wider without need.
const NORM_ROUNDING: f64 = 1e-9;

/// Largest relative difference of the squared lengths of a map's axes, and largest cosine between two of them, for
/// which the map counts as a rotation and a uniform scale. *Chosen*: products of single precision rotations are off by
/// some 1e-7, and weights by moments are far less exact than this.
///
/// Larger: the weights of clusters are those of the unscaled object where they need not be. Smaller: a rotation that
/// was rounded pays for a general map.
const SIMILARITY_ROUNDING: f64 = 1e-4;

/// An invertible affine map from an object's own space to the world.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    pub(crate) linear: DMat3,
    pub(crate) inverse: DMat3,
    translation: DVec3,
    /// Determinant of the linear part; negative for a mirror image.
    pub(crate) determinant: f64,
}

/// The way from an object's own space to the world alone, without the way back.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ForwardMap {
    pub(crate) linear: DMat3,
    translation: DVec3,
    /// Whether the map is a mirror image, so that vertices run around a triangle's front the other way.
    pub(crate) is_mirrored: bool,
}

impl ForwardMap {
    /// Returns a point in the world, relative to another point there.
    #[inline]
    pub(crate) fn relative_to(&self, origin: Vec3, point: Vec3) -> DVec3 {
        self.linear * point.as_dvec3() + (self.translation - origin.as_dvec3())
    }
}

impl Placement {
    /// Returns the map of these columns: three axes, and the image of the origin. They must be invertible.
    #[inline]
    pub(crate) fn new(columns: &[[f32; 3]; 4]) -> Self {
        Self::of_columns(Self::exactly(columns))
    }

    /// Returns columns in double precision.
    #[inline(always)]
    pub(crate) fn exactly(columns: &[[f32; 3]; 4]) -> [DVec3; 4] {
        columns.map(|column| Vec3::from(column).as_dvec3())
    }

    /// Returns the columns between two lists of columns, at this share of the way.
    pub(crate) fn columns_between(start: &[[f32; 3]; 4], end: &[[f32; 3]; 4], time: f64) -> [DVec3; 4] {
        let column = |i: usize| between(Vec3::from(start[i]).as_dvec3(), Vec3::from(end[i]).as_dvec3(), time);
        [column(0), column(1), column(2), column(3)]
    }

    /// Returns the map of these columns.
    #[inline(always)]
    pub(crate) fn of_columns([x, y, z, translation]: [DVec3; 4]) -> Self {
        let linear = DMat3::from_cols(x, y, z);
        // By the cross products of the axes, which are the rows of the inverse times the determinant.
        let determinant = x.dot(y.cross(z));
        let scale = 1.0 / determinant;
        let inverse = DMat3::from_cols(y.cross(z) * scale, z.cross(x) * scale, x.cross(y) * scale).transpose();
        Self { linear, inverse, translation, determinant }
    }

    /// Returns the way to the world alone.
    #[inline(always)]
    pub(crate) fn forward(&self) -> ForwardMap {
        ForwardMap { linear: self.linear, translation: self.translation, is_mirrored: self.is_mirrored() }
    }

    /// Returns a point in the world, relative to another point there.
    #[inline]
    pub(crate) fn relative_to(&self, origin: Vec3, point: Vec3) -> DVec3 {
        self.forward().relative_to(origin, point)
    }

    /// Returns a point of the world in the object's space.
    #[inline]
    pub(crate) fn own_point(&self, point: Vec3) -> DVec3 {
        self.inverse * (point.as_dvec3() - self.translation)
    }

    /// Whether the map is a mirror image, so that vertices run around a triangle's front the other way.
    #[inline]
    pub(crate) fn is_mirrored(&self) -> bool {
        self.determinant < 0.0
    }

    /// Returns the matrix that maps vectors whose length is an area along the normal of a front: the front of an object
    /// stays the front, in mirror images as well.
    #[inline]
    pub(crate) fn areas(&self) -> DMat3 {
        self.inverse.transpose() * self.determinant.abs()
    }

    /// Returns the mean squared length of what unit vectors are mapped to.
    #[inline]
    pub(crate) fn mean_scale2(&self) -> f64 {
        squared_length(&self.linear) * (1.0 / 3.0)
    }

    /// Whether the map keeps all angles: a rotation, a uniform scale and perhaps a mirror.
    #[inline]
    pub(crate) fn is_similarity(&self) -> bool {
        let DMat3 { x_axis: x, y_axis: y, z_axis: z } = self.linear;
        let most = SIMILARITY_ROUNDING * self.mean_scale2();
        let lengths = [x, y, z].map(|axis| (axis.length_squared() - self.mean_scale2()).abs());
        let products = [x.dot(y), y.dot(z), z.dot(x)].map(f64::abs);
        lengths.into_iter().chain(products).all(|difference| difference <= most)
    }

    /// Returns a bound on the ratio of the longest to the shortest image of a unit vector.
    pub(crate) fn condition(&self) -> f64 {
        norm(&self.linear) * norm(&self.inverse)
    }
}

/// Returns the sum of the squares of all elements.
fn squared_length(matrix: &DMat3) -> f64 {
    matrix.x_axis.length_squared() + matrix.y_axis.length_squared() + matrix.z_axis.length_squared()
}

/// Returns a bound on the length of what a matrix makes of a unit vector, exact for similarities.
///
/// The squared lengths are between the eigenvalues of `MᵀM`. With their mean m and `p² = ‖MᵀM - m‖² / 6`, the largest
/// is `m + 2 p cos φ` for some angle (the trigonometric solution of the cubic).
pub(crate) fn norm(matrix: &DMat3) -> f64 {
    let square = matrix.transpose() * *matrix;
    let mean = squared_length(matrix) * (1.0 / 3.0);
    let off = squared_length(&(square - DMat3::from_diagonal(DVec3::splat(mean))));
    math::sqrt64(mean + 2.0 * math::sqrt64(off * (1.0 / 6.0))) * (1.0 + NORM_ROUNDING)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Pcg32;

    #[test]
    fn a_bound_holds_and_is_close() {
        let mut pcg = Pcg32::new(4, 61);
        for _ in 0..200 {
            let mut column = || [0; 3].map(|_| 2.0 * pcg.next_f32() - 1.0);
            let placement = Placement::new(&[column(), column(), column(), column()]);
            let bound = norm(&placement.linear);
            let mut largest = 0.0f64;
            for _ in 0..400 {
                let v = Vec3::from_array([0; 3].map(|_| 2.0 * pcg.next_f32() - 1.0)).as_dvec3().normalize_or_zero();
                largest = largest.max((placement.linear * v).length());
                let back = placement.inverse * (placement.linear * v);
                assert!((back - v).length() < 1e-6 * placement.condition(), "{placement:?}");
            }
            assert!(largest <= bound && bound <= 1.3 * largest, "{largest} {bound}");
        }
    }

    #[test]
    fn similarities_are_known() {
        let (s, c) = (0.6, 0.8);
        let turned = [[2.0 * c, 2.0 * s, 0.0], [-2.0 * s, 2.0 * c, 0.0], [0.0, 0.0, -2.0], [1.0, 2.0, 3.0]];
        let placement = Placement::new(&turned);
        assert!(placement.is_similarity() && placement.is_mirrored());
        assert!((norm(&placement.linear) - 2.0).abs() < 1e-6);
        let mut sheared = turned;
        sheared[0][2] = 0.1;
        assert!(!Placement::new(&sheared).is_similarity());
    }
}
