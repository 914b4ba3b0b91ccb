//! All leaves whose boxes a ray crosses, so that the density of a direction can be summed without the host's
//! intersector.

use glam::Vec3;

use super::node::{Child, Node, TlasView};

/// Relative widening of the interval that a ray spends in a box: covers the rounding of its two ends.
const WIDENING: f32 = 1e-5;

impl<const N: usize> TlasView<'_, N> {
    /// Calls `visit` for each leaf whose box the ray from `origin` along `direction` (need not be a unit vector)
    /// crosses. Walks on parent pointers, so that any depth needs no stack.
    pub(crate) fn cross(&self, origin: Vec3, direction: Vec3, mut visit: impl FnMut(u32)) {
        if self.nodes.is_empty() {
            (0..self.leaves.len() as u32).for_each(visit);
            return;
        }
        let inverse = direction.recip();
        let (mut node, mut lane) = (0, 0);
        loop {
            if lane == N {
                let Some((parent, from)) = self.parents[node].get::<N>() else { return };
                (node, lane) = (parent, from + 1);
                continue;
            }
            match self.nodes[node].child(lane) {
                Child::Node(index) if self.nodes[node].is_crossed(lane, origin, inverse) => {
                    (node, lane) = (index as usize, 0);
                }
                Child::Leaf(leaf) if self.nodes[node].is_crossed(lane, origin, inverse) => {
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
}
