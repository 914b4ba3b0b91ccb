//! From the binary tree to a wide one, whose nodes are cuts through the binary tree below them.

use alloc::vec::Vec;

use super::binary::BinaryNode;
use super::forest::{LaneCut, forests};
use crate::tlas::node::{Node, Slot, Spread, Tlas};

/// Collapses a binary tree. Returns the wide tree, whose nodes have no bounds yet, with the lights in the order of its
/// leaves, which follows the tree, so that the lights of one node are neighbours in memory. So are the nodes below one
/// node; and what is below the first of them comes before what is below the second.
pub(super) fn collapse<const N: usize>(binary: &[BinaryNode]) -> (Tlas<N>, Vec<u32>) {
    let mut tlas = Tlas { nodes: Vec::new(), parents: Vec::new(), spreads: Vec::new(), leaves: Vec::new() };
    let mut lights = Vec::with_capacity(binary.len() / 2 + 1);
    if let [leaf] = binary {
        tlas.leaves.push(Slot::ROOT);
        lights.push(leaf.link);
        return (tlas, lights);
    }
    let forests = forests::<N>(binary);
    tlas.push(Slot::ROOT);
    // Wide nodes that wait for their children, each with its binary node.
    let mut pending = Vec::from([(0, 0)]);
    while let Some((index, root)) = pending.pop() {
        let cut = LaneCut::new(binary, &forests, root);
        let members = || cut.members().iter().copied();
        let nodes = members().filter(|&below| binary[below].count > 1);
        let leaves = members().filter(|&below| binary[below].count == 1);
        let first = tlas.nodes.len();
        for lane in 0..nodes.clone().count() {
            tlas.push(Slot::new::<N>(index, lane));
        }
        let node_count = tlas.nodes.len() - first;
        tlas.nodes[index] = Node::new(first, node_count, lights.len(), cut.members().len());
        for (lane, below) in (node_count..).zip(leaves) {
            tlas.leaves.push(Slot::new::<N>(index, lane));
            lights.push(binary[below].link);
        }
        // Last in, first out: the first child comes next.
        let waiting = pending.len();
        pending.extend((first..).zip(nodes));
        pending[waiting..].reverse();
    }
    (tlas, lights)
}

impl<const N: usize> Tlas<N> {
    fn push(&mut self, parent: Slot) {
        self.nodes.push(Node::new(0, 0, 0, 0));
        self.parents.push(parent);
        self.spreads.push(Spread::default());
    }
}
