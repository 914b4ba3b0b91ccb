//! From the binary tree to a wide one, whose nodes are cuts through the binary tree below them.

use alloc::vec::Vec;

use super::binary::BinaryNode;
use super::forest::{LaneCut, divisions};
use crate::tlas::arity::Arity;
use crate::tlas::node::{Node, Slot, Spread, words};
use crate::tlas::tree::Tlas;

/// Collapses a binary tree. Returns the wide tree, whose nodes have no bounds yet, with the lights in the order of its
/// leaves, which follows the tree, so that the lights of one node are neighbors in memory. So are the nodes below one
/// node; and what is below the first of them comes before what is below the second.
pub(super) fn collapse<const N: usize>(arity: Arity, binary: &[BinaryNode]) -> (Tlas, Vec<u32>) {
    let mut tlas = Tlas::empty(arity);
    let mut lights = Vec::with_capacity(binary.len() / 2 + 1);
    if let [leaf] = binary {
        tlas.leaves.push(Slot::ROOT);
        lights.push(leaf.link);
        return (tlas, lights);
    }
    let divisions = divisions::<N>(binary);
    push::<N>(&mut tlas, Slot::ROOT);
    // Wide nodes that wait for their children, each with its binary node.
    let mut pending = Vec::from([(0, 0)]);
    while let Some((index, root)) = pending.pop() {
        let cut = LaneCut::new(binary, &divisions, root);
        let members = || cut.members().iter().copied();
        let nodes = members().filter(|&below| binary[below].count > 1);
        let leaves = members().filter(|&below| binary[below].count == 1);
        let first = tlas.parents.len();
        for lane in 0..nodes.clone().count() {
            push::<N>(&mut tlas, Slot::new::<N>(index, lane));
        }
        let node_count = tlas.parents.len() - first;
        let node = Node::<N>::new(first, node_count, lights.len(), cut.members().len());
        bytemuck::cast_slice_mut(&mut tlas.nodes)[index] = node;
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

/// Appends a node whose children are not known yet.
fn push<const N: usize>(tlas: &mut Tlas, parent: Slot) {
    tlas.nodes.resize(tlas.nodes.len() + words::<N>(), 0);
    tlas.parents.push(parent);
    tlas.spreads.push(Spread::default());
}
