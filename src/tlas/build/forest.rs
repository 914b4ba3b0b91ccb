//! Which nodes of the binary tree become wide ones: those that mislead the choice least, found by dynamic programming
//! as in Ylitie, Karras and Laine (2017, section 3.1).
//!
//! A wide node replaces a cluster by its moments, and that is where the choice goes wrong. What a cluster costs is the
//! root of its cost in the surface area orientation heuristic, plus the same for every node, so that few nodes are
//! needed and their lanes are full. Classes of sizes have equal shares of the root's lanes.

use alloc::vec::Vec;
use core::ops::Range;

use smallvec::SmallVec;

use super::binary::{BinaryNode, JOINED};
use super::classes::MOST_CLASSES;
use crate::math;

/// Cost of a wide node, relative to the mean cost of all clusters that fit into one. A larger cost gives fewer and
/// fuller nodes, a smaller one nodes that mislead less. *Measured* (docs/SPEED.md, "Fewer and fuller nodes").
const NODE_COST: f32 = 4.0;

/// How to divide one binary node into at most 1, 2 ... `N` lanes.
#[derive(Clone, Copy)]
pub(super) struct Forest<const N: usize> {
    /// Least cost, by the number of lanes less one.
    cost: [f32; N],
    /// Number of lanes for the left child; zero where the node had better stay a single lane.
    left: [u8; N],
}

/// Finds the cheapest way to divide each node of a binary tree.
pub(super) fn forests<const N: usize>(binary: &[BinaryNode]) -> Vec<Forest<N>> {
    let mut forests = Vec::new();
    forests.resize(binary.len(), Forest { cost: [0.0; N], left: [0; N] });
    // 1. Where the classes of sizes begin: each node that joins them has one on its left, and all others on its right.
    let mut joins = SmallVec::<[usize; MOST_CLASSES]>::new();
    let mut last = 0;
    while binary[last].cost == JOINED {
        joins.push(last);
        last += binary[last].link as usize;
    }
    // 2. Every class by itself: what the clusters of one cost says nothing about those of another.
    divide(binary, &mut forests, last..binary.len());
    for &join in &joins {
        divide(binary, &mut forests, join + 1..join + binary[join].link as usize);
    }
    // 3. The joins, the last of which has two classes below it.
    for (classes, &join) in (2..).zip(joins.iter().rev()) {
        let (left, right) = (join + 1, join + binary[join].link as usize);
        let most = [left, right].map(|child| (binary[child].count as usize).min(N));
        let share = |lanes: usize| (lanes / classes).max(lanes.saturating_sub(most[1])).clamp(1, most[0]);
        forests[join] = Forest::join(&forests[left], &forests[right], most, JOINED, |i, j| i == share(i + j));
    }
    forests
}

/// Finds the cheapest way to divide each node of one class.
fn divide<const N: usize>(binary: &[BinaryNode], forests: &mut [Forest<N>], class: Range<usize>) {
    let cost = |node: &BinaryNode| math::sqrt(node.cost);
    let small = || binary[class.clone()].iter().filter(|node| node.count > 1 && node.count as usize <= N);
    let (sum, count) = small().fold((0.0, 0), |(sum, count), node| (sum + f64::from(cost(node)), count + 1));
    let node_cost = NODE_COST * (sum / f64::from(count.max(1))) as f32;
    // Children before parents: a child always lies behind its parent.
    for (i, node) in class.clone().zip(&binary[class.clone()]).rev().filter(|(_, node)| node.count > 1) {
        let (left, right) = (i + 1, i + node.link as usize);
        let most = [left, right].map(|child| (binary[child].count as usize).min(N));
        forests[i] = Forest::join(&forests[left], &forests[right], most, cost(node) + node_cost, |_, _| true);
    }
}

impl<const N: usize> Forest<N> {
    /// Returns the forest of a node from those of its children, which fill at most `most` lanes each; as a single lane
    /// the node costs `own` on top. `may_have` tells which numbers of lanes the two may have together.
    fn join(left: &Self, right: &Self, most: [usize; 2], own: f32, may_have: impl Fn(usize, usize) -> bool) -> Self {
        let mut all = Self { cost: [f32::INFINITY; N], left: [0; N] };
        for i in 1..=most[0] {
            for j in (1..=most[1].min(N - i)).filter(|&j| may_have(i, j)) {
                let cost = left.cost[i - 1] + right.cost[j - 1];
                if cost < all.cost[i + j - 1] {
                    (all.cost[i + j - 1], all.left[i + j - 1]) = (cost, i as u8);
                }
            }
        }
        // More lanes than are needed do no harm.
        for i in 2..N {
            if all.cost[i - 1] <= all.cost[i] {
                (all.cost[i], all.left[i]) = (all.cost[i - 1], all.left[i - 1]);
            }
        }
        all.cost[0] = all.cost[N - 1] + own;
        for i in 1..N - 1 {
            if all.cost[0] < all.cost[i] {
                (all.cost[i], all.left[i]) = (all.cost[0], 0);
            }
        }
        all
    }
}

/// The binary nodes that the lanes of a wide node stand for, in the tree's order.
pub(super) struct LaneCut<const N: usize> {
    lanes: [usize; N],
    width: usize,
}

impl<const N: usize> LaneCut<N> {
    /// Finds the lanes of the wide node made of a binary one.
    pub(super) fn new(binary: &[BinaryNode], forests: &[Forest<N>], root: usize) -> Self {
        let mut cut = Self { lanes: [0; N], width: 0 };
        cut.divide(binary, forests, root, N);
        cut
    }

    /// Returns the members, as indices of binary nodes.
    pub(super) fn members(&self) -> &[usize] {
        &self.lanes[..self.width]
    }

    fn divide(&mut self, binary: &[BinaryNode], forests: &[Forest<N>], node: usize, lanes: usize) {
        match forests[node].left[lanes - 1] as usize {
            0 => {
                self.lanes[self.width] = node;
                self.width += 1;
            }
            left => {
                self.divide(binary, forests, node + 1, left);
                self.divide(binary, forests, node + binary[node].link as usize, lanes - left);
            }
        }
    }
}
