//! Which nodes of the binary tree become wide ones: those that mislead the choice least, found by dynamic programming
//! as in Ylitie, Karras and Laine (2017, section 3.1).
//!
//! A wide node replaces a cluster by its moments, and that is where the choice goes wrong. What a cluster costs is the
//! root of its cost in the surface area orientation heuristic, plus the same for every node, so that few nodes are
//! needed and their lanes are full. Classes of sizes have equal shares of the root's lanes.

use alloc::vec;
use alloc::vec::Vec;

use smallvec::SmallVec;

use super::binary::{BinaryNode, JOINED};
use super::classes::MOST_CLASSES;
use crate::math;
use crate::parallel;

/// Cost of a wide node, relative to the mean cost of all clusters that fit into one. A larger cost gives fewer and
/// fuller nodes, a smaller one nodes that mislead less. *Measured* (docs/SPEED.md, "Fewer and fuller nodes").
const NODE_COST: f32 = 4.0;

/// How to divide one binary node into at most 1, 2 ... `N` lanes: by each number less one, the number of lanes for the
/// left child; zero where the node had better stay a single lane.
pub(super) type Division<const N: usize> = [u8; N];

/// The cheapest ways to divide one binary node.
#[derive(Clone, Copy)]
struct Forest<const N: usize> {
    /// Least cost, by the number of lanes less one.
    cost: [f32; N],
    left: Division<N>,
}

/// Finds the cheapest way to divide each node of a binary tree.
pub(super) fn divisions<const N: usize>(binary: &[BinaryNode]) -> Vec<Division<N>> {
    let mut divisions = vec![[0; N]; binary.len()];
    // 1. Where the classes of sizes begin: each node that joins them has one on its left, and all others on its right.
    let mut joins = SmallVec::<[usize; MOST_CLASSES]>::new();
    let mut last = 0;
    while binary[last].cost == JOINED {
        joins.push(last);
        last += binary[last].link as usize;
    }
    // 2. Every class by itself: what the clusters of one cost says nothing about those of another.
    let mut below = divide_class(&binary[last..], &mut divisions[last..]);
    // 3. The joins, the last of which has two classes below it.
    for (classes, &join) in (2..).zip(joins.iter().rev()) {
        let (left, right) = (join + 1, join + binary[join].link as usize);
        let class = divide_class(&binary[left..right], &mut divisions[left..right]);
        let most = [left, right].map(|child| (binary[child].count as usize).min(N));
        let share = |lanes: usize| (lanes / classes).max(lanes.saturating_sub(most[1])).clamp(1, most[0]);
        let forest = Forest::join(&class, &below, most, JOINED, |i, j| i == share(i + j));
        (divisions[join], below) = (forest.left, forest.cost);
    }
    divisions
}

/// Finds the cheapest way to divide each node of one class. Returns the costs of its root.
fn divide_class<const N: usize>(class: &[BinaryNode], divisions: &mut [Division<N>]) -> [f32; N] {
    let small = class.iter().filter(|node| node.count > 1 && node.count as usize <= N);
    let (sum, count) = small.fold((0.0, 0), |(sum, count), node| (sum + f64::from(own_cost(node)), count + 1));
    let node_cost = NODE_COST * (sum / f64::from(count.max(1))) as f32;
    divide(class, divisions, node_cost)
}

/// Finds the cheapest way to divide each node of a subtree. Returns the costs of its root: those of all nodes would
/// take more memory than the tree.
fn divide<const N: usize>(subtree: &[BinaryNode], divisions: &mut [Division<N>], node_cost: f32) -> [f32; N] {
    let root = &subtree[0];
    let mut costs = [[0.0; N]; 2];
    if root.count == 1 {
        return costs[0];
    }
    let right = root.link as usize;
    let (own, below) = divisions.split_at_mut(1);
    let (left_divisions, right_divisions) = below.split_at_mut(right - 1);
    let [left_costs, right_costs] = &mut costs;
    parallel::both(
        || *left_costs = divide(&subtree[1..right], left_divisions, node_cost),
        || *right_costs = divide(&subtree[right..], right_divisions, node_cost),
        root.count as usize,
    );
    let most = [1, right].map(|child| (subtree[child].count as usize).min(N));
    let forest = Forest::join(&costs[0], &costs[1], most, own_cost(root) + node_cost, |_, _| true);
    own[0] = forest.left;
    forest.cost
}

/// Returns what a cluster costs as a single lane.
fn own_cost(node: &BinaryNode) -> f32 {
    math::sqrt(node.cost)
}

impl<const N: usize> Forest<N> {
    /// Returns the forest of a node from the costs of its children, which fill at most `most` lanes each; as a single
    /// lane the node costs `own` on top. `may_have` tells which numbers of lanes the two may have together.
    fn join(
        left: &[f32; N],
        right: &[f32; N],
        most: [usize; 2],
        own: f32,
        may_have: impl Fn(usize, usize) -> bool,
    ) -> Self {
        let mut all = Self { cost: [f32::INFINITY; N], left: [0; N] };
        for i in 1..=most[0] {
            for j in (1..=most[1].min(N - i)).filter(|&j| may_have(i, j)) {
                let cost = left[i - 1] + right[j - 1];
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
    pub(super) fn new(binary: &[BinaryNode], divisions: &[Division<N>], root: usize) -> Self {
        let mut cut = Self { lanes: [0; N], width: 0 };
        cut.divide(binary, divisions, root, N);
        cut
    }

    /// Returns the members, as indices of binary nodes.
    pub(super) fn members(&self) -> &[usize] {
        &self.lanes[..self.width]
    }

    fn divide(&mut self, binary: &[BinaryNode], divisions: &[Division<N>], node: usize, lanes: usize) {
        match divisions[node][lanes - 1] as usize {
            0 => {
                self.lanes[self.width] = node;
                self.width += 1;
            }
            left => {
                self.divide(binary, divisions, node + 1, left);
                self.divide(binary, divisions, node + binary[node].link as usize, lanes - left);
            }
        }
    }
}
