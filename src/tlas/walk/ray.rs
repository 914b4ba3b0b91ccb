//! All leaves whose boxes a ray crosses, so that the density of a direction can be summed without the host's
//! intersector.

use glam::Vec3;

use crate::math::{self, at_least, at_most};
use crate::simd::{InstructionSet, Kernel};
use crate::tlas::node::{Child, Node};
use crate::tlas::tree::WideTree;

/// Relative widening of the interval that a ray spends in a box. *Proved*: covers the rounding of its two ends, three
/// operations of 6e-8 each, fiftyfold. A larger one visits a few more leaves.
const RAY_WIDENING: f32 = 1e-5;

/// Number of levels whose waiting lanes are kept on the stack; below them they are computed again on the way back.
/// Affects time alone. Chosen: a balanced tree of 2^28 leaves has 14 levels even with four lanes.
const KEPT_LEVELS: usize = 24;

impl<const N: usize> WideTree<'_, N> {
    /// Calls `visit` for each leaf whose box the ray from `origin` along `direction` (need not be a unit vector)
    /// crosses.
    pub(crate) fn cross(&self, origin: Vec3, direction: Vec3, visit: impl FnMut(u32)) {
        let (level, inverse) = (InstructionSet::best(), direction.recip());
        self.walk(|node| level.run(Crossed::<N, false> { node, origin, inverse, margin: 0.0 }), visit);
    }

    /// Calls `visit` for each leaf whose box may hold a point in a cone around a unit vector, with an angular radius of
    /// this sine and cosine.
    pub(crate) fn meet(&self, origin: Vec3, axis: Vec3, cone: [f32; 2], visit: impl FnMut(u32)) {
        let level = InstructionSet::best();
        self.walk(|node| level.run(Met::<N, false> { node, origin, axis, cone, margin: 0.0 }), visit);
    }

    /// Visits the leaves in the lanes of each node, a set of bits, that `entered` tells. Walks on parent pointers, so
    /// that any depth needs no more than a fixed stack.
    #[inline]
    pub(super) fn walk(&self, entered: impl Fn(&Node<N>) -> u32, mut visit: impl FnMut(u32)) {
        if self.nodes.is_empty() {
            (0..self.leaves.len() as u32).for_each(visit);
            return;
        }
        let mut waiting = [0; KEPT_LEVELS];
        let (mut node, mut depth, mut lanes) = (0, 0, entered(&self.nodes[0]));
        loop {
            if lanes == 0 {
                let Some((parent, from)) = self.parent(node) else { return };
                (node, depth) = (parent, depth - 1);
                lanes = waiting
                    .get(depth)
                    .copied()
                    .unwrap_or_else(|| entered(&self.nodes[node]) & !(u32::MAX >> (31 - from)));
                continue;
            }
            let lane = lanes.trailing_zeros() as usize;
            lanes &= lanes - 1;
            match self.nodes[node].child(lane) {
                Child::Node(index) => {
                    if let Some(waiting) = waiting.get_mut(depth) {
                        *waiting = lanes;
                    }
                    (node, depth) = (index as usize, depth + 1);
                    lanes = entered(&self.nodes[node]);
                }
                Child::Leaf(leaf) => visit(leaf),
                Child::Empty => {}
            }
        }
    }
}

/// Lanes whose boxes a ray crosses; if `WIDENED`, boxes that are wider by a margin on all sides.
pub(in crate::tlas) struct Crossed<'a, const N: usize, const WIDENED: bool> {
    pub(in crate::tlas) node: &'a Node<N>,
    pub(in crate::tlas) origin: Vec3,
    pub(in crate::tlas) inverse: Vec3,
    pub(in crate::tlas) margin: f32,
}

impl<const N: usize, const WIDENED: bool> Kernel for Crossed<'_, N, WIDENED> {
    type Output = u32;
    const USES_512_BITS: bool = N >= 16;

    /// Slab test. A ray in the plane of a slab gives NaN there, which the comparisons pass over.
    #[inline(always)]
    fn run(self) -> u32 {
        let (low, high) = self.node.corners();
        let mut crossed = 0;
        for i in 0..N {
            let (mut enter, mut leave) = (0.0, f32::INFINITY);
            for axis in 0..3 {
                let (low, high) = (low[axis][i] - self.origin[axis], high[axis][i] - self.origin[axis]);
                let (low, high) = if WIDENED { (low - self.margin, high + self.margin) } else { (low, high) };
                let (a, b) = (low * self.inverse[axis], high * self.inverse[axis]);
                enter = at_least(at_most(b, a), enter);
                leave = at_most(at_least(a, b), leave);
            }
            // Each end moves outwards by its own rounding; an infinite one stays where it is.
            leave *= if leave > 0.0 { 1.0 + RAY_WIDENING } else { 1.0 - RAY_WIDENING };
            crossed |= u32::from(enter * (1.0 - RAY_WIDENING) <= leave) << i;
        }
        crossed & self.node.children()
    }
}

/// Lanes whose boxes, or the balls around them, reach a cone; if `WIDENED`, balls that are wider by a margin.
pub(in crate::tlas) struct Met<'a, const N: usize, const WIDENED: bool> {
    pub(in crate::tlas) node: &'a Node<N>,
    pub(in crate::tlas) origin: Vec3,
    pub(in crate::tlas) axis: Vec3,
    pub(in crate::tlas) cone: [f32; 2],
    pub(in crate::tlas) margin: f32,
}

impl<const N: usize, const WIDENED: bool> Kernel for Met<'_, N, WIDENED> {
    type Output = u32;
    const USES_512_BITS: bool = N >= 16;

    /// By the distance of a ball's center from the cone's surface, negative inside, against its radius.
    #[inline(always)]
    fn run(self) -> u32 {
        let (low, high) = self.node.corners();
        let [sin, cos] = self.cone;
        let mut met = 0;
        for i in 0..N {
            // Relative to the origin before halving: far away the difference is what is exact.
            let from = Vec3::new(low[0][i], low[1][i], low[2][i]) - self.origin;
            let to = Vec3::new(high[0][i], high[1][i], high[2][i]) - self.origin;
            let center = 0.5 * (from + to);
            let along = center.dot(self.axis);
            let distance2 = center.length_squared();
            let across = math::sqrt(at_least(distance2 - along * along, 0.0));
            let slack = 0.5 * math::sqrt((to - from).length_squared()) + RAY_WIDENING * math::sqrt(distance2);
            let slack = if WIDENED { slack + self.margin } else { slack };
            met |= u32::from((along >= -slack) & (across * cos - along * sin <= slack)) << i;
        }
        met & self.node.children()
    }
}
