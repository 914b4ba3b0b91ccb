//! Children whose lights do not send over the hemisphere around their normal: in all directions, or into a narrow cone.
//!
//! The loop over all lanes takes every light for a surface. For these children it is no proof of darkness too many, but
//! asks about leaves that need not be asked about, and knows of no cone that is narrower than a hemisphere (θe below
//! π/2: Conty Estevez and Kulla 2018, section 4.1). This pass corrects both, and scenes of triangles alone do not run
//! it.

use glam::Vec3;

use super::importance::Estimates;
use crate::math;
use crate::receiver::{Lobe, ReceiverLanes};
use crate::simd::{InstructionSet, Kernel};
use crate::tlas::node::{Child, LANE_TWO_SIDED, Node, WIDE, wide};

/// Rounding granted to the distance from a cone, relative to that of the cluster. *Proved*: covers the rounding of the
/// axis to ten bits a component, which is in the angle of the cone, and of the sums, 1e-6. A larger one culls less.
const CLUSTER_CONE_ROUNDING: f32 = 1e-5;

impl<const N: usize> Node<N> {
    /// Returns the estimates, corrected for the children marked with
    /// [`LANE_SHAPED`](crate::tlas::node::LANE_SHAPED).
    #[inline(never)]
    pub(super) fn shaped(&self, x: &ReceiverLanes<impl Lobe>, mut estimates: Estimates<N>) -> Estimates<N> {
        let [shaped, everywhere, above] = InstructionSet::best().run(LaneSets { node: self, x });
        // No side is averted of what sends everywhere: what is left of the doubt is the horizon.
        estimates.doubtful[0] &= !(shaped & everywhere & above);
        // What sends everywhere, but unevenly, is asked what it sends: it has two sides or a mean normal.
        let uneven = shaped & everywhere & self.uneven_leaves();
        estimates.doubtful.iter_mut().for_each(|set| *set |= uneven);
        let mut waiting = shaped & !everywhere;
        if waiting == 0 {
            return estimates;
        }
        while waiting != 0 {
            let lane = waiting.trailing_zeros() as usize;
            waiting &= waiting - 1;
            self.focus(lane, x, &mut estimates);
        }
        estimates.largest = estimates.weights.iter().fold(0, |largest, weight| largest.max(weight.to_bits()));
        estimates
    }

    /// Returns the lanes of leaves that are two-sided or have a mean normal, and may send something, as a set of bits.
    #[inline]
    fn uneven_leaves(&self) -> u32 {
        let (normals, lengths, energies) = (self.normals, self.lengths, self.energies);
        let is_uneven = |lane: usize| (normals[lane] & LANE_TWO_SIDED != 0) | (lengths[lane] != 0);
        let of = |lane: usize| u32::from(is_uneven(lane) & (energies[lane] != 0)) << lane;
        (usize::from(self.node_count)..usize::from(self.width).min(N)).fold(0, |set, lane| set | of(lane))
    }

    /// Corrects the estimates of a child that sends into a narrow cone.
    fn focus(&self, lane: usize, x: &ReceiverLanes<impl Lobe>, estimates: &mut Estimates<N>) {
        let bit = 1 << lane;
        let step = Vec3::from_array(self.steps.map(wide));
        let (centers, halves) = (self.centers, self.halves);
        let at = |codes: &[[u8; N]; 3]| Vec3::from_array([0, 1, 2].map(|axis| f32::from(codes[axis][lane])));
        let center = Vec3::from_array(self.origin) - x.position + at(&centers) * step;
        let (distance, radius) = (center.length(), 0.5 * (at(&halves) * step).length());
        // Distance of the shading point from the cone, less the radius of the ball that holds all of its apexes.
        let (axis, [sin, cos], _) = self.cone(lane);
        let along = -axis.dot(center);
        let across = math::sqrt((distance * distance - along * along).max(0.0));
        if across * cos - along * sin > radius + CLUSTER_CONE_ROUNDING * distance {
            estimates.weights[lane] = 0.0;
            estimates.doubtful.iter_mut().for_each(|set| *set &= !bit);
            estimates.opened &= !bit;
        } else if let (Child::Leaf(_), true) = (self.child(lane), estimates.weights[lane] > 0.0) {
            // Inside of the cone and outside, by its own falloff.
            estimates.doubtful.iter_mut().for_each(|set| *set |= bit);
        }
    }
}

/// Finds three sets of bits: children that are marked, children some of which send everywhere, and children above the
/// horizon for certain.
struct LaneSets<'a, const N: usize, L> {
    node: &'a Node<N>,
    x: &'a ReceiverLanes<L>,
}

impl<const N: usize, L: Lobe> Kernel for LaneSets<'_, N, L> {
    type Output = [u32; 3];
    const USES_512_BITS: bool = N >= 16;

    #[inline(always)]
    fn run(self) -> [u32; 3] {
        let Self { node, x } = self;
        let origin = Vec3::from_array(node.origin) - x.position;
        let step = Vec3::from_array(node.steps.map(wide));
        let (centers, halves, tangents) = (node.centers, node.halves, node.tangents);
        let (horizon, absolute_horizon) = (x.horizon, x.horizon.abs());
        let (mut everywhere, mut above) = (0, 0);
        for i in 0..N {
            let half = Vec3::new(f32::from(halves[0][i]), f32::from(halves[1][i]), f32::from(halves[2][i]));
            let center = Vec3::new(f32::from(centers[0][i]), f32::from(centers[1][i]), f32::from(centers[2][i]));
            let (half, center) = (0.5 * half * step, origin + center * step);
            let lowest = horizon.dot(center) + x.lift - absolute_horizon.dot(half);
            let slack = x.slack * (math::sqrt(center.length_squared()) + 2.0 * math::sqrt(half.length_squared()));
            above |= u32::from(lowest > slack) << i;
            everywhere |= u32::from(tangents[i] == WIDE) << i;
        }
        [node.shaped_lanes(), everywhere, above]
    }
}
