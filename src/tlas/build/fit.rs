//! Bounds, moments and spreads of a tree whose shape is given, from the leaves to the root.
//!
//! A build ends with it and a refit is nothing else, so a refit with nothing changed gives the same tree bit for bit.

use smallvec::SmallVec;

use crate::bounds::{LightBounds, Moments};
use crate::parallel;
use crate::tlas::arity::{Arity, MAX_LANES};
use crate::tlas::node::{Child, Node, Spread};
use crate::tlas::tree::Tlas;

/// A node and all nodes below it, which are neighbors in memory.
struct Subtree<'a, const N: usize> {
    node: &'a mut Node<N>,
    spread: &'a mut Spread,
    /// Number of the first node below.
    first: usize,
    below: &'a mut [Node<N>],
    spreads: &'a mut [Spread],
    fitted: Fitted,
}

/// Summary of a child for the node above it.
#[derive(Clone, Copy, Debug)]
pub(in crate::tlas) struct Fitted {
    pub(in crate::tlas) bounds: LightBounds,
    moments: Moments,
    /// Number of leaves, and the sums of their energies and of the squares of these.
    count: f64,
    pub(in crate::tlas) sum: f64,
    squares: f64,
    /// Costs in the surface area orientation heuristic of all lanes below.
    cost: f64,
}

impl Tlas {
    /// Gives all nodes the bounds of the lights below. Returns the tree's cost: that of all clusters in the surface
    /// area orientation heuristic, relative to that of the root.
    pub(crate) fn fit(&mut self, light: &(impl Fn(u32) -> (LightBounds, Moments) + Sync)) -> f64 {
        match self.arity {
            Arity::Four => self.fit_nodes::<4>(light),
            Arity::Eight => self.fit_nodes::<8>(light),
            Arity::Sixteen => self.fit_nodes::<16>(light),
        }
    }

    fn fit_nodes<const N: usize>(&mut self, light: &(impl Fn(u32) -> (LightBounds, Moments) + Sync)) -> f64 {
        let nodes: &mut [Node<N>] = bytemuck::cast_slice_mut(&mut self.nodes);
        let [node, below @ ..] = nodes else { return 1.0 };
        let [spread, spreads @ ..] = &mut self.spreads[..] else { return 1.0 };
        let root = Subtree { node, spread, first: 1, below, spreads, fitted: Fitted::NONE }.fit(light);
        if root.sum > 0.0 {
            let scale = 1.0 / root.sum;
            self.spreads.iter_mut().for_each(|spread| spread.scale(scale));
        }
        root.relative_cost()
    }
}

impl<const N: usize> Node<N> {
    /// Writes what is known of all children, in the order of the lanes. Returns what is known of the node.
    pub(in crate::tlas) fn fit(&mut self, lanes: &[Fitted]) -> (Fitted, Spread) {
        if lanes.is_empty() {
            return (Fitted::NONE, Spread::default());
        }
        let known: SmallVec<[_; MAX_LANES]> = lanes.iter().map(|lane| (lane.bounds, lane.moments)).collect();
        self.set(&known);
        let whole = lanes.iter().copied().reduce(|whole, lane| whole.union(&lane)).unwrap_or(Fitted::NONE);
        let cost = whole.cost + lanes.iter().map(|lane| lane.bounds.cost()).sum::<f64>();
        (Fitted { cost, ..whole }, whole.spread())
    }
}

impl<const N: usize> Subtree<'_, N> {
    fn fit(&mut self, light: &(impl Fn(u32) -> (LightBounds, Moments) + Sync)) -> Fitted {
        let mut subtrees = divide(self.node, self.first, self.below, self.spreads);
        let size = subtrees.iter().map(|subtree| 1 + subtree.below.len()).sum();
        parallel::for_each(&mut subtrees, size, |subtree| subtree.fitted = subtree.fit(light));
        let mut subtrees = subtrees.iter();
        let lanes: SmallVec<[Fitted; MAX_LANES]> = (0..N)
            .filter_map(|lane| match self.node.child(lane) {
                Child::Empty => None,
                Child::Leaf(leaf) => Some(Fitted::leaf(light(leaf))),
                Child::Node(_) => subtrees.next().map(|subtree| subtree.fitted),
            })
            .collect();
        let (fitted, spread) = self.node.fit(&lanes);
        *self.spread = spread;
        fitted
    }
}

/// Returns the subtrees below a node. Its child nodes come first, then what is below the first of them, and so on.
fn divide<'a, const N: usize>(
    node: &Node<N>,
    first: usize,
    nodes: &'a mut [Node<N>],
    spreads: &'a mut [Spread],
) -> SmallVec<[Subtree<'a, N>; MAX_LANES]> {
    let end = first + nodes.len();
    let children = usize::from(node.node_count);
    let (nodes, mut below) = nodes.split_at_mut(children);
    let (own_spreads, mut spreads) = spreads.split_at_mut(children);
    // Where the nodes below each child begin; those of the last one end with the slice.
    let mut starts = [end; N];
    let mut next = end;
    for (start, child) in starts.iter_mut().zip(nodes.iter()).rev() {
        next = if child.node_count > 0 { child.first_node as usize } else { next };
        *start = next;
    }
    let mut subtrees = SmallVec::new();
    for (i, (node, spread)) in nodes.iter_mut().zip(own_spreads).enumerate() {
        let first = starts[i];
        let count = starts.get(i + 1).copied().unwrap_or(end) - first;
        let (mine, others) = below.split_at_mut(count);
        let (mine_spreads, other_spreads) = spreads.split_at_mut(count);
        (below, spreads) = (others, other_spreads);
        subtrees.push(Subtree { node, spread, first, below: mine, spreads: mine_spreads, fitted: Fitted::NONE });
    }
    subtrees
}

impl Fitted {
    pub(in crate::tlas) const NONE: Self =
        Self { bounds: LightBounds::NONE, moments: Moments::NONE, count: 0.0, sum: 0.0, squares: 0.0, cost: 0.0 };

    pub(in crate::tlas) fn leaf((bounds, moments): (LightBounds, Moments)) -> Self {
        let energy = f64::from(bounds.energy());
        Self { bounds, moments, count: 1.0, sum: energy, squares: energy * energy, cost: 0.0 }
    }

    /// Returns the number of leaves.
    pub(in crate::tlas) fn leaf_count(&self) -> f32 {
        self.count as f32
    }

    /// Returns the cost of all lanes below, relative to that of the whole.
    pub(in crate::tlas) fn relative_cost(&self) -> f64 {
        let whole = self.bounds.cost();
        if whole > 0.0 { self.cost / whole } else { 1.0 }
    }

    /// Returns the summary of both, of which this may be that of no leaf.
    pub(in crate::tlas) fn joined(&self, other: &Self) -> Self {
        if self.count > 0.0 { self.union(other) } else { *other }
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
