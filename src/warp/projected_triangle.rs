//! Unit square to a spherical triangle above a plane, by the cosine to the plane's normal.
//!
//! A uniform point of the triangle's projection onto the plane is a direction with a density of its cosine (Nusselt),
//! so that a diffuse surface sees a constant light without noise (Arvo 2001, "Stratified Sampling of 2-Manifolds";
//! Peters 2021, "BRDF Importance Sampling for Polygonal Lights"). A great circle projects to an ellipse around the
//! origin. With its unit normal `m`, the plane's normal `n` and an azimuth `d` in the plane, its point has
//!
//! `r² = (m·n)² / ((m·n)² + (m·d)²)`,
//!
//! and the area between the origin and an arc of the angle τ is `τ m·n / 2` (Lambert). If the triangle holds the zenith,
//! an edge is chosen by that area, then a point of its arc and a radius. If not, the azimuth of one corner divides it
//! in two, each between two arcs that meet in a corner. The azimuth up to which the difference of their areas is the
//! part that a number asks for is found by Newton's method, within brackets; the square of the radius is uniform
//! between both arcs. The density is the cosine over the projected area.

use glam::DVec3;

use super::spherical_triangle::{angle, positive, sin_cos};
use crate::math::sqrt64;

/// Most steps of Newton's method. *Proved* by the tests: three to five suffice; a step that leaves the brackets is
/// replaced by a bisection.
///
/// Larger: time, where rounding keeps steps from becoming small. Smaller: directions that do not follow the density.
const MOST_STEPS: usize = 16;

/// Size of a step, relative to all azimuths, below which the next one makes no difference. Chosen: the method converges
/// quadratically, so that about its square is left.
///
/// Larger: directions that do not quite follow the density. Smaller: one more step.
const LEAST_AZIMUTH_STEP: f64 = 1e-4;

/// Least projected area. Chosen: of what is smaller, rounding of 1e-16 may be more than 1e-6.
///
/// Larger: more of what lies at the horizon is drawn without regard to the cosine. Smaller: directions next to the
/// triangle.
const LEAST_AREA: f64 = 1e-9;

/// A spherical triangle above a plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ProjectedTriangle {
    corners: [DVec3; 3],
    /// Unit normal of the plane.
    normal: DVec3,
    /// Unit normal of the great circle from each corner to the next, towards the triangle.
    sides: [DVec3; 3],
    /// Signed area between the origin and the projection of each side.
    areas: [f64; 3],
}

/// A part of a projection that is bounded by two arcs from a corner and by one azimuth.
struct Wedge {
    /// Azimuth of the corner, and the one a quarter turn on, towards the other end.
    frame: [DVec3; 2],
    /// Angle from the corner to the other end.
    turn: f64,
    /// What the corner has along its azimuth and along the normal.
    corner: [f64; 2],
    /// Both arcs, in any order.
    arcs: [Arc; 2],
    /// Area of all of it.
    area: f64,
}

/// A great circle through the corner of a wedge.
struct Arc {
    /// What its normal has along both azimuths of the frame, and along the normal of the plane, which is not negative.
    side: [f64; 3],
    /// Projection of the direction in it that is a quarter turn on from the corner.
    turned: [f64; 3],
}

impl Arc {
    /// Returns the angle from the corner to the azimuth of this sine and cosine.
    #[inline(always)]
    fn angle(&self, corner: [f64; 2], [sin, cos]: [f64; 2]) -> f64 {
        let ([_, _, tilt], [t0, t1, up]) = (self.side, self.turned);
        // The point of the great circle at the azimuth, of any length, has `tilt` along the azimuth and this upwards.
        let height = -self.along([sin, cos]);
        angle((tilt * (t0 * cos + t1 * sin) + height * up).abs(), tilt * corner[0] * cos + height * corner[1])
    }

    /// Returns the squared radius of the projection at an azimuth.
    #[inline(always)]
    fn radius2(&self, azimuth: [f64; 2]) -> f64 {
        let (tilt, along) = (self.side[2], self.along(azimuth));
        tilt * tilt / (tilt * tilt + along * along)
    }

    #[inline(always)]
    fn along(&self, [sin, cos]: [f64; 2]) -> f64 {
        self.side[0] * cos + self.side[1] * sin
    }
}

impl ProjectedTriangle {
    /// Returns the triangle with these unit directions as corners, in positive orientation as seen from the origin, none
    /// of them below the plane of a unit normal but by rounding. `None` where its projection is too small.
    #[inline]
    pub(crate) fn new(corners: [DVec3; 3], normal: DVec3) -> Option<Self> {
        let next = [corners[1], corners[2], corners[0]];
        let crosses = [0, 1, 2].map(|i| corners[i].cross(next[i]));
        let sines = crosses.map(|cross| sqrt64(cross.length_squared()));
        let sides = [0, 1, 2].map(|i| if sines[i] > 0.0 { crosses[i] * (1.0 / sines[i]) } else { DVec3::ZERO });
        let areas = [0, 1, 2].map(|i| 0.5 * angle(sines[i], corners[i].dot(next[i])) * sides[i].dot(normal));
        let triangle = Self { corners, normal, sides, areas };
        // NaN fails.
        (triangle.area() >= LEAST_AREA).then_some(triangle)
    }

    /// Returns the area of the projection: the integral of the cosine over the triangle.
    #[inline]
    pub(crate) fn area(&self) -> f64 {
        self.areas[0] + self.areas[1] + self.areas[2]
    }

    /// Maps `[v, u]` in `[0, 1]²` to a direction of the triangle with a density of the cosine over [`Self::area`]. `u`
    /// divides the projection by azimuths, `v` along an azimuth.
    pub(crate) fn direction(&self, [v, u]: [f64; 2]) -> DVec3 {
        let negative = self.areas.map(|area| area < 0.0);
        // The side whose sign is its own.
        let side = match negative {
            [false, false, false] | [true, true, true] => return self.around_zenith([v, u]),
            [true, false, false] | [false, true, true] => 0,
            [false, true, false] | [true, false, true] => 1,
            [false, false, true] | [true, true, false] => 2,
        };
        let (long, before, after) = (self.sides[side], self.sides[(side + 2) % 3], self.sides[(side + 1) % 3]);
        let (first, last) = (self.corners[side], self.corners[(side + 1) % 3]);
        let middle = self.corners[(side + 2) % 3];
        let [start, end] = [(first, before), (last, after)]
            .map(|(corner, short)| Wedge::new(corner, [long, short], middle, self.normal));
        let target = u * (start.area + end.area);
        // The second ends in its corner.
        if target < start.area {
            start.direction([v, target / start.area], self.normal)
        } else {
            end.direction([v, (start.area + end.area - target) / end.area], self.normal)
        }
    }

    /// [`Self::direction`] of a triangle that holds the zenith.
    fn around_zenith(&self, [v, u]: [f64; 2]) -> DVec3 {
        let mut target = u * self.area();
        let mut i = 0;
        while i < 2 && target >= self.areas[i] {
            target -= self.areas[i];
            i += 1;
        }
        // Half of the arc's angle is the area over the cosine of its tilt.
        let half = positive(target / self.sides[i].dot(self.normal)).min(core::f64::consts::FRAC_PI_2);
        let (sin, cos) = sin_cos(2.0 * half);
        let end = self.corners[i] * cos + self.sides[i].cross(self.corners[i]) * sin;
        self.within(end, v)
    }

    /// Returns the direction at a share of the squared radius of another.
    #[inline]
    fn within(&self, end: DVec3, v: f64) -> DVec3 {
        let across = end - self.normal * end.dot(self.normal);
        let across = across * sqrt64(v);
        across + self.normal * sqrt64(positive(1.0 - across.length_squared()))
    }
}

impl Wedge {
    #[inline]
    fn new(corner: DVec3, sides: [DVec3; 2], other: DVec3, normal: DVec3) -> Self {
        let across = |direction: DVec3| direction - normal * direction.dot(normal);
        let start = across(corner).normalize_or(normal.any_orthonormal_vector());
        let (end, turned) = (across(other), normal.cross(start));
        let sin = turned.dot(end);
        let frame = [start, if sin < 0.0 { -turned } else { turned }];
        let parts = |vector: DVec3| [frame[0].dot(vector), frame[1].dot(vector), normal.dot(vector)];
        let arcs = sides.map(|side| {
            let side = if side.dot(normal) < 0.0 { -side } else { side };
            Arc { side: parts(side), turned: parts(side.cross(corner)) }
        });
        let corner = [start.dot(corner), normal.dot(corner)];
        let wedge = Self { frame, turn: angle(sin.abs(), start.dot(end)), corner, arcs, area: 0.0 };
        Self { area: wedge.area_up_to(1.0).0, ..wedge }
    }

    /// Returns the area up to a share of the turn, and its derivative.
    #[inline]
    fn area_up_to(&self, share: f64) -> (f64, f64) {
        let (sin, cos) = sin_cos(self.turn * share);
        let [a, b] = &self.arcs;
        let azimuth = [sin, cos];
        let area = a.side[2] * a.angle(self.corner, azimuth) - b.side[2] * b.angle(self.corner, azimuth);
        (0.5 * area.abs(), 0.5 * self.turn * (a.radius2(azimuth) - b.radius2(azimuth)).abs())
    }

    /// Returns the direction at shares of the squared radius between both arcs, and of the area up to the azimuth.
    fn direction(&self, [v, share]: [f64; 2], normal: DVec3) -> DVec3 {
        // The area grows with the square of the turn, so that its root is about linear.
        let target = sqrt64(share);
        let (mut low, mut high, mut t) = (0.0, 1.0, target);
        for _ in 0..MOST_STEPS {
            let (area, slope) = self.area_up_to(t);
            let root = sqrt64(area / self.area);
            if root < target {
                low = t;
            } else {
                high = t;
            }
            let next = t - (root - target) * 2.0 * root * self.area / slope;
            // NaN fails.
            let next = if next > low && next < high { next } else { 0.5 * (low + high) };
            let step = next - t;
            t = next;
            if step.abs() < LEAST_AZIMUTH_STEP {
                break;
            }
        }
        let (sin, cos) = sin_cos(self.turn * t);
        let [a, b] = self.arcs.each_ref().map(|arc| arc.radius2([sin, cos]));
        let (inner, outer) = (a.min(b), a.max(b));
        let radius2 = inner + v * (outer - inner);
        (self.frame[0] * cos + self.frame[1] * sin) * sqrt64(radius2) + normal * sqrt64(positive(1.0 - radius2))
    }
}

#[cfg(test)]
mod tests;
