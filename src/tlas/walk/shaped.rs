//! Children whose lights do not send over the hemisphere around their normal: in all directions, or into a narrow cone.
//!
//! The loop over all lanes takes every light for a surface. For these children it is no proof of darkness too many, but
//! asks about leaves that need not be asked about, and knows of no cone that is narrower than a hemisphere (θe below π/2:
//! Conty Estevez and Kulla 2018, section 4.1). This pass corrects both, and scenes of triangles alone do not run it.

use glam::Vec3;

use super::importance::Estimates;
use crate::geometry::HORIZON_ROUNDING;
use crate::math;
use crate::receiver::ReceiverLanes;
use crate::tlas::node::{Child, Node, WIDE, wide};

/// Rounding granted to the distance from a cone, relative to that of the cluster. *Proved*: covers the rounding of the axis to
/// ten bits a component, which is in the angle of the cone, and of the sums, 1e-6. A larger one culls less.
const CONE_ROUNDING: f32 = 1e-5;

impl<const N: usize> Node<N> {
    /// Returns the estimates, corrected for the children marked with [`LANE_SHAPED`](crate::tlas::node::LANE_SHAPED).
    #[inline(never)]
    pub(super) fn shaped(&self, x: &ReceiverLanes, mut estimates: Estimates<N>) -> Estimates<N> {
        let mut waiting = self.shaped_lanes();
        let origin = Vec3::from_array(self.origin) - x.position;
        let step = Vec3::from_array(self.steps.map(wide));
        let (centers, halves) = (self.centers, self.halves);
        while waiting != 0 {
            let lane = waiting.trailing_zeros() as usize;
            waiting &= waiting - 1;
            let bit = 1 << lane;
            let at = |codes: &[[u8; N]; 3]| Vec3::from_array([0, 1, 2].map(|axis| f32::from(codes[axis][lane])));
            let (center, half) = (origin + at(&centers) * step, 0.5 * at(&halves) * step);
            let distance = center.length();
            if self.tangents[lane] == WIDE {
                // No side is averted: what is left of the doubt is the horizon.
                let lowest = x.horizon.dot(center) + x.lift - x.horizon.abs().dot(half);
                let slack = HORIZON_ROUNDING * x.horizon.abs().element_sum() * (distance + 2.0 * half.length());
                if lowest > slack {
                    estimates.doubtful[0] &= !bit;
                }
                continue;
            }
            // Distance of the shading point from the cone, less the radius of the ball that holds all of its apexes.
            let (axis, [sin, cos], _) = self.cone(lane);
            let along = -axis.dot(center);
            let across = math::sqrt((distance * distance - along * along).max(0.0));
            if across * cos - along * sin > half.length() + CONE_ROUNDING * distance {
                estimates.weights[lane] = 0.0;
                estimates.doubtful.iter_mut().for_each(|set| *set &= !bit);
                estimates.opened &= !bit;
            } else if let (Child::Leaf(_), true) = (self.child(lane), estimates.weights[lane] > 0.0) {
                // Inside of the cone and outside, by its own falloff.
                estimates.doubtful.iter_mut().for_each(|set| *set |= bit);
            }
        }
        estimates.largest = estimates.weights.iter().fold(0, |largest, weight| largest.max(weight.to_bits()));
        estimates
    }
}
