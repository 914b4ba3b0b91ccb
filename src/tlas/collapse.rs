//! From the binary tree to a wide one, whose nodes are cuts through the binary tree below them.

use alloc::vec::Vec;

use super::build::BinaryNode;
use super::forest::{Cut, forests};
use super::node::{Node, Slot, Spread, Tlas};

/// Collapses a binary tree. Returns the wide tree with the lights in the order of its leaves, which follows the
/// tree, so that the lights of one node are neighbours in memory. So are the nodes below one node; and what is below
/// the first of them comes before what is below the second.
pub(super) fn collapse<const N: usize>(binary: &[BinaryNode]) -> (Tlas<N>, Vec<u32>) {
    let mut tlas = Tlas { nodes: Vec::new(), parents: Vec::new(), spreads: Vec::new(), leaves: Vec::new() };
    let mut lights = Vec::with_capacity(binary.len() / 2 + 1);
    if let [leaf] = binary {
        tlas.leaves.push(Slot::ROOT);
        lights.push(leaf.link);
        return (tlas, lights);
    }
    let total = binary[0].bounds.energy();
    let energies = leaf_moments(binary, total);
    let forests = forests::<N>(binary);
    tlas.push(Slot::ROOT, energies[0]);
    // Wide nodes that wait for their children, each with its binary node.
    let mut pending = Vec::from([(0, 0)]);
    while let Some((index, root)) = pending.pop() {
        let cut = Cut::new(binary, &forests, root);
        let members = || cut.members().iter().copied();
        let nodes = members().filter(|&below| binary[below].count > 1);
        let leaves = members().filter(|&below| binary[below].count == 1);
        let first = tlas.nodes.len();
        for (lane, below) in nodes.clone().enumerate() {
            tlas.push(Slot::new::<N>(index, lane), energies[below]);
        }
        let node_count = tlas.nodes.len() - first;
        tlas.nodes[index] = Node::new(first, node_count, lights.len(), cut.members().len());
        let mut known = [(binary[root].bounds, binary[root].moments); N];
        for (lane, below) in nodes.clone().chain(leaves.clone()).enumerate() {
            known[lane] = (binary[below].bounds, binary[below].moments);
        }
        tlas.nodes[index].set(&known[..cut.members().len()]);
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
    fn push(&mut self, parent: Slot, spread: Spread) {
        self.nodes.push(Node::new(0, 0, 0, 0));
        self.parents.push(parent);
        self.spreads.push(spread);
    }
}

/// Count, mean and variance of the leaves' energies, relative to `total`, below every binary node.
fn leaf_moments(binary: &[BinaryNode], total: f32) -> Vec<Spread> {
    // Sum and sum of squares, children before parents: a child always lies behind its parent.
    let mut sums = Vec::from_iter(binary.iter().map(|node| {
        let energy = f64::from(node.bounds.energy()) / f64::from(total);
        (energy, energy * energy)
    }));
    for i in (0..binary.len()).rev().filter(|&i| binary[i].count > 1) {
        let (left, right) = (sums[i + 1], sums[i + binary[i].link as usize]);
        sums[i] = (left.0 + right.0, left.1 + right.1);
    }
    let spread = |(node, &(sum, squares)): (&BinaryNode, &(f64, f64))| {
        let count = f64::from(node.count);
        let mean = sum / count;
        Spread { count: count as f32, mean: mean as f32, variance: (squares / count - mean * mean).max(0.0) as f32 }
    };
    binary.iter().zip(&sums).map(spread).collect()
}
