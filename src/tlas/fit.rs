//! Bounds, moments and spreads of a tree whose shape is given, from the leaves to the root.
//!
//! A build ends with it and a refit is nothing else, so a refit with nothing changed gives the same tree bit for bit.

use smallvec::SmallVec;

use super::node::{Child, Node, Spread, Tlas};
use crate::bounds::{LightBounds, Moments};
use crate::parallel;

/// A node and all nodes below it, which follow it in memory.
struct Subtree<'a, const N: usize> {
    /// Number of the first node.
    first: usize,
    nodes: &'a mut [Node<N>],
    spreads: &'a mut [Spread],
    fitted: Fitted,
}

/// What a node has to know of one of its children.
#[derive(Clone, Copy)]
struct Fitted {
    bounds: LightBounds,
    moments: Moments,
    /// Number of leaves, and the sums of their energies and of the squares of these.
    count: f64,
    sum: f64,
    squares: f64,
    /// Costs in the surface area orientation heuristic of all lanes below.
    cost: f64,
}

impl<const N: usize> Tlas<N> {
    /// Gives all nodes the bounds of the lights below, and tells the tree's cost: that of all clusters in the surface
    /// area orientation heuristic, relative to that of the root.
    pub(crate) fn fit(&mut self, light: &(impl Fn(u32) -> (LightBounds, Moments) + Sync)) -> f64 {
        if self.nodes.is_empty() {
            return 1.0;
        }
        let (nodes, spreads) = (&mut self.nodes[..], &mut self.spreads[..]);
        let root = Subtree { first: 0, nodes, spreads, fitted: Fitted::NONE }.fit(light);
        if root.sum > 0.0 {
            let scale = 1.0 / root.sum;
            self.spreads.iter_mut().for_each(|spread| spread.scale(scale));
        }
        let whole = root.bounds.cost();
        if whole > 0.0 { root.cost / whole } else { 1.0 }
    }
}

impl<const N: usize> Subtree<'_, N> {
    fn fit(self, light: &(impl Fn(u32) -> (LightBounds, Moments) + Sync)) -> Fitted {
        let count = self.nodes.len();
        let (root, below) = self.nodes.split_at_mut(1);
        let (spread, spreads) = self.spreads.split_at_mut(1);
        let mut subtrees = divide(&root[0], self.first + 1, below, spreads);
        parallel::for_each(&mut subtrees, count, |subtree| subtree.fitted = subtree.take().fit(light));
        let mut whole = Fitted::NONE;
        let mut subtrees = subtrees.iter();
        for lane in 0..N {
            let child = root[0].child(lane);
            let fitted = match child {
                Child::Empty => continue,
                Child::Leaf(leaf) => Fitted::leaf(light(leaf)),
                Child::Node(_) => subtrees.next().map_or(Fitted::NONE, |subtree| subtree.fitted),
            };
            root[0].set(lane, child, &fitted.bounds, &fitted.moments);
            whole = if lane == 0 { fitted } else { whole.union(&fitted) };
            whole.cost += fitted.bounds.cost();
        }
        spread[0] = whole.spread();
        whole
    }

    /// The same, with nothing left behind.
    fn take(&mut self) -> Subtree<'_, N> {
        Subtree { first: self.first, nodes: self.nodes, spreads: self.spreads, fitted: self.fitted }
    }
}

/// The subtrees below a node, whose first one begins with node number `first`.
fn divide<'a, const N: usize>(
    node: &Node<N>,
    first: usize,
    mut nodes: &'a mut [Node<N>],
    mut spreads: &'a mut [Spread],
) -> SmallVec<[Subtree<'a, N>; 16]> {
    let starts: SmallVec<[usize; 16]> = (0..N)
        .filter_map(|lane| match node.child(lane) {
            Child::Node(index) => Some(index as usize),
            Child::Leaf(_) | Child::Empty => None,
        })
        .collect();
    let end = first + nodes.len();
    let ends = starts.iter().skip(1).copied().chain([end]);
    let cut = |(&first, end): (&usize, usize)| {
        let own_nodes = nodes.split_off_mut(..end - first).unwrap_or_default();
        let own_spreads = spreads.split_off_mut(..end - first).unwrap_or_default();
        Subtree { first, nodes: own_nodes, spreads: own_spreads, fitted: Fitted::NONE }
    };
    starts.iter().zip(ends).map(cut).collect()
}

impl Fitted {
    const NONE: Self =
        Self { bounds: LightBounds::NONE, moments: Moments::NONE, count: 0.0, sum: 0.0, squares: 0.0, cost: 0.0 };

    fn leaf((bounds, moments): (LightBounds, Moments)) -> Self {
        let energy = f64::from(bounds.energy());
        Self { bounds, moments, count: 1.0, sum: energy, squares: energy * energy, cost: 0.0 }
    }

    fn union(&self, other: &Self) -> Self {
        let two_sided = self.bounds.two_sided && other.bounds.two_sided;
        let flip = two_sided && self.moments.normal.dot(other.moments.normal) < 0.0;
        Self {
            bounds: self.bounds.union(other.bounds),
            moments: self.moments.union(other.moments, flip),
            count: self.count + other.count,
            sum: self.sum + other.sum,
            squares: self.squares + other.squares,
            cost: self.cost + other.cost,
        }
    }

    fn spread(&self) -> Spread {
        let mean = self.sum / self.count;
        let variance = (self.squares / self.count - mean * mean).max(0.0);
        Spread { count: self.count as f32, mean: mean as f32, variance: variance as f32 }
    }
}
