//! All leaves whose boxes a ray crosses, so that the density of a direction can be summed without the host's
//! intersector.

use glam::Vec3;

use super::node::{Child, Node, TlasView};
use crate::math;

/// Relative widening of the interval that a ray spends in a box: covers the rounding of its two ends.
const WIDENING: f32 = 1e-5;

impl<const N: usize> TlasView<'_, N> {
    /// Calls `visit` for each leaf whose box the ray from `origin` along `direction` (need not be a unit vector)
    /// crosses.
    pub(crate) fn cross(&self, origin: Vec3, direction: Vec3, visit: impl FnMut(u32)) {
        let inverse = direction.recip();
        self.walk(|node, lane| node.is_crossed(lane, origin, inverse), visit);
    }

    /// Calls `visit` for each leaf whose box may hold a point in a cone around a unit vector, with an angular radius of
    /// this sine and cosine.
    pub(crate) fn meet(&self, origin: Vec3, axis: Vec3, [sin, cos]: [f32; 2], visit: impl FnMut(u32)) {
        self.walk(|node, lane| node.meets(lane, origin, axis, [sin, cos]), visit);
    }

    /// Visits the leaves below the lanes that `enters` lets pass. Walks on parent pointers, so that any depth needs no
    /// stack.
    #[inline(always)]
    fn walk(&self, enters: impl Fn(&Node<N>, usize) -> bool, mut visit: impl FnMut(u32)) {
        if self.nodes.is_empty() {
            (0..self.leaves.len() as u32).for_each(visit);
            return;
        }
        let (mut node, mut lane) = (0, 0);
        loop {
            if lane == N {
                let Some((parent, from)) = self.parents[node].get::<N>() else { return };
                (node, lane) = (parent, from + 1);
                continue;
            }
            match self.nodes[node].child(lane) {
                Child::Node(index) if enters(&self.nodes[node], lane) => (node, lane) = (index as usize, 0),
                Child::Leaf(leaf) if enters(&self.nodes[node], lane) => {
                    visit(leaf);
                    lane += 1;
                }
                _ => lane += 1,
            }
        }
    }
}

impl<const N: usize> Node<N> {
    /// Slab test. A ray in the plane of a slab gives NaN there, which `f32::min` and `max` pass over.
    #[inline(always)]
    fn is_crossed(&self, lane: usize, origin: Vec3, inverse: Vec3) -> bool {
        let (mut enter, mut leave) = (0.0f32, f32::INFINITY);
        let aabb = self.aabb(lane);
        for axis in 0..3 {
            let a = (aabb.min[axis] - origin[axis]) * inverse[axis];
            let b = (aabb.max[axis] - origin[axis]) * inverse[axis];
            let (near, far) = (a.min(b), a.max(b));
            // Each end moves outwards by its own rounding; an infinite one stays where it is.
            enter = enter.max(near * if near > 0.0 { 1.0 - WIDENING } else { 1.0 + WIDENING });
            leave = leave.min(far * if far > 0.0 { 1.0 + WIDENING } else { 1.0 - WIDENING });
        }
        enter <= leave
    }

    /// Whether the ball around a box reaches the cone: its centre's distance from the cone's surface, negative inside,
    /// against its radius.
    #[inline(always)]
    fn meets(&self, lane: usize, origin: Vec3, axis: Vec3, [sin, cos]: [f32; 2]) -> bool {
        let aabb = self.aabb(lane);
        // Relative to the origin before halving: far away the difference is what is exact.
        let (from, to) = (aabb.min - origin, aabb.max - origin);
        let center = 0.5 * (from + to);
        let along = center.dot(axis);
        let across = math::sqrt((center.length_squared() - along * along).max(0.0));
        let slack = 0.5 * (to - from).length() + WIDENING * center.length();
        along >= -slack && across * cos - along * sin <= slack
    }
}
