//! An edited tree in the order of a built one: without free places, and every node after its parent.

use alloc::vec::Vec;

use crate::tlas::arity::Arity;
use crate::tlas::node::{Node, Slot, words};
use crate::tlas::tree::{Tlas, TlasView, WideTree, for_arity};

/// Returns the tree in the order of a build, with the nodes and the leaves of the edited one in that order.
pub(crate) fn relayout(tlas: &TlasView<'_>) -> (Tlas, Vec<u32>, Vec<u32>) {
    for_arity!(tlas, tree => tree.relayout(tlas.arity))
}

impl<const N: usize> WideTree<'_, N> {
    fn relayout(&self, arity: Arity) -> (Tlas, Vec<u32>, Vec<u32>) {
        let mut to = Tlas::empty(arity);
        let (mut nodes, mut leaves) = (Vec::new(), Vec::new());
        if self.nodes.is_empty() {
            to.leaves.extend_from_slice(self.leaves);
            return (to, nodes, (0..self.leaves.len() as u32).collect());
        }
        nodes.push(0);
        to.parents.push(Slot::ROOT);
        let mut pending = Vec::from([0]);
        while let Some(index) = pending.pop() {
            let mut node = self.nodes[nodes[index] as usize];
            let (first, first_leaf) = (nodes.len(), leaves.len());
            for lane in 0..u32::from(node.width) {
                let slot = Slot::new::<N>(index, lane as usize);
                if lane < u32::from(node.node_count) {
                    nodes.push(node.first_node + lane);
                    to.parents.push(slot);
                } else {
                    leaves.push(node.first_leaf + lane - u32::from(node.node_count));
                    to.leaves.push(slot);
                }
            }
            (node.first_node, node.first_leaf) = (first as u32, first_leaf as u32);
            to.nodes.resize((nodes.len() * words::<N>()).max(to.nodes.len()), 0);
            let all: &mut [Node<N>] = bytemuck::cast_slice_mut(&mut to.nodes);
            all[index] = node;
            // Last in, first out: the first child comes next.
            pending.extend((first..nodes.len()).rev());
        }
        to.spreads = nodes.iter().map(|&node| self.spreads[node as usize]).collect();
        if !self.groups.is_empty() {
            let lanes = |&node: &u32| &self.groups[node as usize * N..(node as usize + 1) * N];
            to.groups = nodes.iter().flat_map(lanes).copied().collect();
        }
        (to, nodes, leaves)
    }
}
