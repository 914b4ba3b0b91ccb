//! From the binary tree to a wide one: each wide node is a cut through the binary tree below it, made by replacing,
//! again and again, the node of largest error by its two children.

use alloc::vec::Vec;

use super::build::BinaryNode;
use super::node::{Child, Node, Slot, Spread, Tlas};
use crate::bounds::{LightBounds, Moments};

/// A wide node that waits for its children: its binary node, and the lane that refers to it.
struct Pending {
    binary: usize,
    parent: Slot,
}

/// Collapses a binary tree. Returns the wide tree, whose nodes have no bounds yet, with the lights in the order of its
/// leaves, which follows the tree, so that the lights of one node are neighbours in memory. The nodes below a node
/// follow it, in the order of its lanes.
pub(super) fn collapse<const N: usize>(binary: &[BinaryNode]) -> (Tlas<N>, Vec<u32>) {
    let mut tlas = Tlas { nodes: Vec::new(), parents: Vec::new(), spreads: Vec::new(), leaves: Vec::new() };
    let mut lights = Vec::with_capacity(binary.len() / 2 + 1);
    if let [leaf] = binary {
        tlas.leaves.push(Slot::ROOT);
        lights.push(leaf.link);
        return (tlas, lights);
    }
    let mut pending = Vec::from([Pending { binary: 0, parent: Slot::ROOT }]);
    while let Some(Pending { binary: root, parent }) = pending.pop() {
        let index = tlas.nodes.len();
        tlas.nodes.push(Node::empty());
        tlas.parents.push(parent);
        tlas.spreads.push(Spread::default());
        if let Some((node, lane)) = parent.get::<N>() {
            tlas.nodes[node].set(lane, Child::Node(index as u32), &LightBounds::NONE, &Moments::NONE);
        }
        let mut cut = [0; N];
        let width = make_cut(binary, root, &mut cut);
        for (lane, &below) in cut[..width].iter().enumerate() {
            if binary[below].count == 1 {
                let leaf = Child::Leaf(lights.len() as u32);
                tlas.nodes[index].set(lane, leaf, &LightBounds::NONE, &Moments::NONE);
                tlas.leaves.push(Slot::new::<N>(index, lane));
                lights.push(binary[below].link);
            }
        }
        // Last in, first out: the leftmost child comes next.
        let inner = cut[..width].iter().enumerate().rev().filter(|&(_, &below)| binary[below].count > 1);
        pending.extend(inner.map(|(lane, &below)| Pending { binary: below, parent: Slot::new::<N>(index, lane) }));
    }
    (tlas, lights)
}

/// Fills `cut` with up to `N` binary nodes below `root`, in the tree's order, and counts them.
fn make_cut<const N: usize>(binary: &[BinaryNode], root: usize, cut: &mut [usize; N]) -> usize {
    cut[0] = root;
    let mut width = 1;
    while width < N {
        let error = |&lane: &usize| binary[cut[lane]].cost;
        let widest = (0..width)
            .filter(|&lane| binary[cut[lane]].count > 1)
            .max_by(|a, b| error(a).total_cmp(&error(b)).then(binary[cut[*a]].count.cmp(&binary[cut[*b]].count)));
        let Some(lane) = widest else { break };
        let parent = cut[lane];
        cut.copy_within(lane + 1..width, lane + 2);
        cut[lane] = parent + 1;
        cut[lane + 1] = parent + binary[parent].link as usize;
        width += 1;
    }
    width
}
