//! Factors on the weights of a node's children that the oracle has learned: how much of what a child sends gets
//! through.
//!
//! They come after everything else that decides about a weight, and only where the oracle has any. No factor is zero,
//! so what is possible stays possible.

use super::factors::{FACTORS, factor};
use super::importance::{Estimates, LeafOracle};
use crate::math::only_if;
use crate::tlas::arity::Arity;
use crate::tlas::node::Node;
use crate::tlas::tree::{TlasView, WideTree, for_arity};
use crate::warp::within_range;

impl<const N: usize> Node<N> {
    /// Multiplies the weights by what is known of this node. Opened children are left to [`WideTree::inherited`].
    #[inline(always)]
    pub(super) fn dim(&self, index: usize, oracle: &impl LeafOracle, estimates: &mut Estimates<N>) {
        let Some(factors) = oracle.factors(index as u32) else { return };
        let mut largest = 0;
        for (weight, byte) in estimates.weights.iter_mut().zip(factors) {
            *weight = only_if(*weight > 0.0, within_range(*weight * factor(*byte)));
            largest = largest.max(weight.to_bits());
        }
        estimates.largest = largest;
    }
}

impl<const N: usize> WideTree<'_, N> {
    /// Returns the weight of an opened child, of which `sum` is that of its own children: these have their own factors,
    /// or all have that of the child.
    #[inline(never)]
    pub(super) fn inherited(&self, index: usize, lane: u32, child: usize, oracle: &impl LeafOracle, sum: f32) -> f32 {
        if oracle.factors(child as u32).is_some() {
            return sum;
        }
        let Some(factors) = oracle.factors(index as u32) else { return sum };
        only_if(sum > 0.0, within_range(sum * factor(factors[lane as usize % FACTORS])))
    }
}

impl TlasView<'_> {
    /// Returns the number of nodes.
    pub(crate) fn node_count(&self) -> usize {
        self.parents.len()
    }

    /// Calls `visit` for each node and lane on the way from a leaf to the root.
    pub(crate) fn visit_path(&self, leaf: u32, mut visit: impl FnMut(u32, u32)) {
        for_arity!(self, tree => tree.path(leaf).for_each(|(node, lane)| visit(node as u32, lane as u32)));
    }

    /// Returns the node and the lane that refer to a node, or `None` for the root.
    pub(crate) fn parent_of(&self, node: u32) -> Option<(u32, u32)> {
        for_arity!(self, tree => tree.parent(node as usize).map(|(node, lane)| (node as u32, lane as u32)))
    }
}
