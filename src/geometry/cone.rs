//! Cones of directions, which bound the normals of a cluster.

use core::f32::consts::PI;

use glam::Vec3;

use crate::math;

/// Angle in radians (and its sine) between two axes below which they have no plane in common that could be relied on:
/// *proved*, the error of the plane is below 1e-7 / 0.01 radians. The cone is then widened without a turn, by at most
/// this angle, so that a larger value gives wider cones.
const LEAST_ANGLE: f32 = 0.01;

/// All directions within the half angle `theta` (radians, `[0, π]`) of a unit axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cone {
    pub(crate) axis: Vec3,
    pub(crate) theta: f32,
}

impl Cone {
    /// The cone that holds a single direction.
    pub(crate) const fn single(axis: Vec3) -> Self {
        Self { axis, theta: 0.0 }
    }

    /// A cone that holds both (Conty Estevez and Kulla 2018, algorithm 1).
    pub(crate) fn union(self, other: Self) -> Self {
        let (wide, narrow) = if self.theta >= other.theta { (self, other) } else { (other, self) };
        let between = angle(wide.axis, narrow.axis);
        if between + narrow.theta <= wide.theta {
            return wide;
        }
        let theta = 0.5 * (wide.theta + between + narrow.theta);
        let turn = theta - wide.theta;
        // Towards the narrow axis, in the plane of both; axes that are nearly equal or opposite have no such
        // plane.
        let side = narrow.axis - wide.axis * wide.axis.dot(narrow.axis);
        let length = math::sqrt(side.length_squared());
        if between < LEAST_ANGLE {
            return Self { axis: wide.axis, theta: between + narrow.theta };
        }
        if theta >= PI || length < LEAST_ANGLE {
            return Self { axis: wide.axis, theta: PI };
        }
        let (sin, cos) = math::sin_cos(turn);
        Self { axis: (wide.axis * cos + side * (sin / length)).normalize_or(wide.axis), theta }
    }
}

/// Angle between unit vectors, accurate for small and for nearly straight ones as well.
pub(crate) fn angle(a: Vec3, b: Vec3) -> f32 {
    if a == b {
        // As what follows would find, and so it is for all lamps that send in all directions.
        0.0
    } else if a.dot(b) >= 0.0 {
        2.0 * math::asin(0.5 * math::sqrt((a - b).length_squared()))
    } else {
        PI - 2.0 * math::asin(0.5 * math::sqrt((a + b).length_squared()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contains(cone: &Cone, direction: Vec3) -> bool {
        angle(cone.axis, direction) <= cone.theta + 1e-5
    }

    #[test]
    fn a_union_holds_both_cones() {
        let directions =
            [Vec3::X, Vec3::Y, Vec3::NEG_X, Vec3::new(0.6, 0.0, 0.8), Vec3::new(1.0, 1e-4, 0.0).normalize()];
        for a in directions {
            for b in directions {
                let both = Cone::single(a).union(Cone::single(b));
                assert!(contains(&both, a) && contains(&both, b), "{a} {b} {both:?}");
                for c in directions {
                    let all = both.union(Cone::single(c));
                    assert!(contains(&all, a) && contains(&all, b) && contains(&all, c), "{a} {b} {c} {all:?}");
                }
            }
        }
    }

    #[test]
    fn equal_directions_stay_narrow() {
        let axis = Vec3::new(0.3, -0.4, 0.5).normalize();
        assert_eq!(Cone::single(axis).union(Cone::single(axis)).theta, 0.0);
    }
}
