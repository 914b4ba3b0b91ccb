//! What is known of a node's children, in the few bits that a node has for it.

use core::f32::consts::FRAC_PI_2;

use glam::{DVec3, Vec3};

use crate::bounds::{LightBounds, Moments};
use crate::geometry::{Aabb, angle};
use crate::math;
use crate::tlas::node::{ALL, MEAN_STEPS, NORMAL_STEPS, Node, TANGENT_STEPS, TWO_SIDED, WIDE, wide};

/// Steps along the longest extent of a node. Fewer than a byte can count, as rounding moves centres and widens boxes.
const BOX_STEPS: f64 = 253.0;
/// Least widening of a box, in halves of a step: covers the rounding of all that is computed from boxes.
const BOX_MARGIN: f64 = 1.0 / 32.0;
/// Least unit of the boxes, so that products with it do not vanish.
const LEAST_STEP: f64 = 1e-30;
/// A little shorter than it could be, so that rounding makes no normal longer than one: the test by the cone is then
/// on the safe side.
const NORMAL_SCALE: f32 = NORMAL_STEPS - 1.0;
/// Widening of a cluster's cone of normals, in radians: covers the rounding of its construction in `f32`.
const CONE_MARGIN: f32 = 1e-4;
/// Widening of the tangent: covers the rounding of the test.
const TANGENT_MARGIN: f32 = 2.5e-4;
/// Half angle from which on a cone counts as a half-space.
const WIDEST_CONE: f32 = FRAC_PI_2 - 0.08;

impl<const N: usize> Node<N> {
    /// Writes what is known of all children, in the order of the lanes.
    pub(super) fn set(&mut self, children: &[(LightBounds, Moments)]) {
        let whole = children.iter().fold(Aabb::EMPTY, |aabb, (bounds, _)| aabb.union(bounds.aabb));
        self.origin = whole.min.to_array();
        let extent = whole.max.as_dvec3() - whole.min.as_dvec3();
        self.steps = (extent / BOX_STEPS).to_array().map(|step| rounded_up(step.max(LEAST_STEP)));
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
        let direction = if length > 1e-3 { moments.normal / length } else { bounds.normals.axis };
        let code = |value: f32| (value * NORMAL_SCALE + 0.5f32.copysign(value)) as i32;
        let [x, y, z] = direction.to_array().map(|value| code(value) as u32 & 0x3ff);
        let normal = x | y << 10 | z << 20;
        let side = if bounds.two_sided { TWO_SIDED } else { 0 };
        self.normals[lane] = normal | side;
        self.lengths[lane] = (255.0 * length + 0.5) as u8;
        let axis = Vec3::from_array([0, 1, 2].map(|axis| Self::component(normal, axis))).normalize_or_zero();
        let theta = bounds.normals.theta + angle(axis, bounds.normals.axis) + CONE_MARGIN;
        // Of a two-sided light one side always faces the shading point.
        self.tangents[lane] = if bounds.two_sided || !(theta < WIDEST_CONE) {
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

/// The least number of two bytes that is not below a positive one.
fn rounded_up(value: f64) -> u16 {
    let bits = (value as f32).to_bits();
    let bits = (bits >> 16) as u16;
    if f64::from(wide(bits)) < value { bits + 1 } else { bits }
}

/// The number of two bytes next to a positive and finite one, and positive as well.
fn nearest(value: f32) -> u16 {
    let bits = (value.to_bits() + 0x8000) >> 16;
    (bits as u16).clamp(1, 0x7f7f)
}

#[cfg(test)]
mod tests;
