//! Writes bounds and moments of children into the few bits that a node has for them.

use core::f32::consts::FRAC_PI_2;

use glam::{DVec3, Vec3};

use crate::bounds::{LightBounds, Moments};
use crate::geometry::{Aabb, angle};
use crate::math;
use crate::tlas::node::{ALL, LANE_SHAPED, LANE_TWO_SIDED, MEAN_STEPS, NORMAL_STEPS, Node, TANGENT_STEPS, WIDE, wide};

/// Steps along each extent of a node. *Proved*: a box that fills the node has 253 halves of a step, the rounding of its
/// center adds one and the rounding up of the halves another, and 255 is the largest code. Fewer steps make all boxes
/// coarser.
const BOX_STEPS: f64 = 253.0;
/// Least widening of a box, in halves of a step. *Proved*: covers the rounding of what is computed from boxes
/// relative to their size, 2^-22 of 255 steps, hundredfold; rounding relative to the distance is granted by the tests
/// themselves. A larger one widens boxes without need.
const BOX_MARGIN: f64 = 1.0 / 32.0;
/// Least unit of the boxes. *Proved*: flat boxes divide by it, and any positive number keeps that from being 0 / 0. A
/// much larger one would widen the boxes of tiny scenes.
const LEAST_BOX_STEP: f64 = 1e-30;
/// Length of normals in steps: shorter than [`NORMAL_STEPS`], so that rounding by half a step in each component makes
/// no normal longer than one (*proved*: √3 / 2 is below 1). The test by the cone is then on the safe side.
const NORMAL_SCALE: f32 = NORMAL_STEPS - 1.0;
/// Widening of a cluster's cone of normals, in radians. Covers the rounding of its construction in `f32`,
/// about 1e-6 a union. A larger one culls a little less. Chosen with room; `what_is_culled_is_dark` looks for
/// counterexamples.
const CONE_MARGIN: f32 = 1e-4;
/// Widening of the tangent. Covers the rounding of the test, about 1e-6 of the distance. A larger one culls a little
/// less. Chosen with room; `what_is_culled_is_dark` looks for counterexamples.
const TANGENT_MARGIN: f32 = 2.5e-4;
/// Half angle in radians from which on a cone counts as a half-space. *Format*: its tangent, 12.5, must stay below the
/// largest that a code can hold. A smaller one culls less.
const WIDEST_STORED_CONE: f32 = FRAC_PI_2 - 0.08;

/// Least length of a mean normal that is a direction. Below it the axis of the cone stands in; the length itself is
/// then stored as zero, *format*: half a step of a byte is 2e-3.
const LEAST_NORMAL_LENGTH: f32 = 1e-3;

impl<const N: usize> Node<N> {
    /// Writes what is known of all children, in the order of the lanes.
    pub(super) fn set(&mut self, children: &[(LightBounds, Moments)]) {
        let whole = children.iter().fold(Aabb::EMPTY, |aabb, (bounds, _)| aabb.union(bounds.aabb));
        self.origin = whole.min.to_array();
        let extent = whole.max.as_dvec3() - whole.min.as_dvec3();
        self.steps = (extent / BOX_STEPS).to_array().map(|step| rounded_up(step.max(LEAST_BOX_STEP)));
        for (lane, (bounds, moments)) in children.iter().enumerate() {
            self.set_box(lane, &bounds.aabb, moments);
            self.set_cone(lane, bounds, moments);
            self.set_energy(lane, bounds);
        }
    }

    fn set_box(&mut self, lane: usize, aabb: &Aabb, moments: &Moments) {
        let (origin, steps) = (self.origin, self.steps);
        let mut half = DVec3::ZERO;
        for axis in 0..3 {
            let (step, origin) = (f64::from(wide(steps[axis])), f64::from(origin[axis]));
            let (low, high) = (f64::from(aabb.min[axis]) - origin, f64::from(aabb.max[axis]) - origin);
            // Casts saturate, and these truncate positive numbers.
            let center = (0.5 * (low + high) / step + 0.5) as u8;
            let middle = f64::from(center) * step;
            let halves = 2.0 * (high - middle).max(middle - low) / step + BOX_MARGIN;
            let code = (halves as u8).saturating_add(1);
            self.centers[axis][lane] = center;
            self.halves[axis][lane] = code;
            half[axis] = 0.5 * f64::from(code) * step;
            let mean = (f64::from(moments.mean[axis]) - origin - middle) / half[axis] * f64::from(MEAN_STEPS);
            self.means[axis][lane] = (mean + 0.5f64.copysign(mean)).clamp(-127.0, 127.0) as i8;
        }
        let deviation = math::sqrt64(f64::from(moments.variance) / half.length_squared());
        self.deviations[lane] = (255.0 * deviation + 0.5) as u8;
    }

    fn set_cone(&mut self, lane: usize, bounds: &LightBounds, moments: &Moments) {
        let length = moments.normal.length();
        let direction = if length > LEAST_NORMAL_LENGTH { moments.normal / length } else { bounds.normals.axis };
        let code = |value: f32| (value * NORMAL_SCALE + 0.5f32.copysign(value)) as i32;
        let [x, y, z] = direction.to_array().map(|value| code(value) as u32 & 0x3ff);
        let normal = x | y << 10 | z << 20;
        let side = if bounds.two_sided { LANE_TWO_SIDED } else { 0 };
        self.lengths[lane] = (255.0 * length + 0.5) as u8;
        let axis = Vec3::from_array([0, 1, 2].map(|axis| Self::component(normal, axis))).normalize_or_zero();
        let theta = bounds.normals.theta + angle(axis, bounds.normals.axis) + CONE_MARGIN;
        // What sends into less than a hemisphere has a cone of all directions that it sends in, if that is narrow.
        let (is_everywhere, is_focused) = (bounds.emission > FRAC_PI_2, theta + bounds.emission < WIDEST_STORED_CONE);
        let shape = if is_everywhere || is_focused { LANE_SHAPED } else { 0 };
        self.normals[lane] = normal | side | shape;
        let theta = if is_focused { theta + bounds.emission } else { theta };
        // One side of a two-sided light always faces the shading point.
        self.tangents[lane] = if bounds.two_sided || is_everywhere || !(theta < WIDEST_STORED_CONE) {
            WIDE
        } else {
            let (sin, cos) = math::sin_cos(theta);
            (TANGENT_STEPS * math::sqrt(sin / cos + TANGENT_MARGIN)) as u8 + 1
        };
    }

    fn set_energy(&mut self, lane: usize, bounds: &LightBounds) {
        let energy = bounds.energy();
        if energy == 0.0 {
            (self.energies[lane], self.portals[lane]) = (0, 0);
            return;
        }
        self.energies[lane] = nearest(energy);
        let share = (bounds.portal / energy * 255.0 + 0.5) as u8;
        self.portals[lane] = match (bounds.flux > 0.0, bounds.portal > 0.0) {
            (_, false) => 0,
            (false, true) => ALL,
            (true, true) => share.clamp(1, ALL - 1),
        };
    }
}

/// Returns the least number of two bytes that is not below a positive one.
fn rounded_up(value: f64) -> u16 {
    let bits = (value as f32).to_bits();
    let bits = (bits >> 16) as u16;
    if f64::from(wide(bits)) < value { bits + 1 } else { bits }
}

/// Returns the number of two bytes next to a positive and finite one, and positive as well.
fn nearest(value: f32) -> u16 {
    let bits = (value.to_bits() + 0x8000) >> 16;
    (bits as u16).clamp(1, 0x7f7f)
}

#[cfg(test)]
mod tests;
