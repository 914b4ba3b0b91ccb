//! Bounds, moments and spreads of a tree whose shape is given, from the leaves to the root.
//!
//! A build ends with it and a refit is nothing else, so a refit with nothing changed gives the same tree bit for bit.

use smallvec::SmallVec;

use super::node::{Child, Node, Spread, Tlas};
use crate::bounds::{LightBounds, Moments};
use crate::parallel;

/// A node and all nodes below it: its children are neighbours, behind them is what lies below the first of them, and so
/// on.
struct Subtree<'a, const N: usize> {
    root: &'a mut Node<N>,
    spread: &'a mut Spread,
    below: &'a mut [Node<N>],
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
        let [node, below @ ..] = &mut self.nodes[..] else { return 1.0 };
        let [spread, spreads @ ..] = &mut self.spreads[..] else { return 1.0 };
        let root = Subtree { root: node, spread, below, spreads, fitted: Fitted::NONE }.fit(light);
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
        let Self { root, spread, below, spreads, .. } = self;
        let count = below.len();
        let mut subtrees = divide(root, below, spreads);
        parallel::for_each(&mut subtrees, count, |subtree| subtree.fitted = subtree.take().fit(light));
        let mut whole = Fitted::NONE;
        let mut known: SmallVec<[(LightBounds, Moments); 16]> = SmallVec::new();
        for lane in 0..N {
            let fitted = match root.child(lane) {
                Child::Empty => break,
                Child::Leaf(leaf) => Fitted::leaf(light(leaf)),
                Child::Node(_) => subtrees[lane].fitted,
            };
            known.push((fitted.bounds, fitted.moments));
            whole = if lane == 0 { fitted } else { whole.union(&fitted) };
            whole.cost += fitted.bounds.cost();
        }
        root.set(&known);
        *spread = whole.spread();
        whole
    }

    /// The same, with nothing left behind.
    fn take(&mut self) -> Subtree<'_, N> {
        let Self { root, spread, below, spreads, fitted } = self;
        Subtree { root, spread, below, spreads, fitted: *fitted }
    }
}

/// The subtrees below a node, of all nodes below it.
fn divide<'a, const N: usize>(
    node: &Node<N>,
    below: &'a mut [Node<N>],
    spreads: &'a mut [Spread],
) -> SmallVec<[Subtree<'a, N>; 16]> {
    let count = usize::from(node.node_count);
    let first = node.first_node as usize;
    let end = first + below.len();
    let (roots, mut below) = below.split_at_mut(count);
    let (root_spreads, mut spreads) = spreads.split_at_mut(count);
    // Where the nodes below each child begin: where those below the next one that has any do, for one without.
    let mut starts = [end; 17];
    for lane in (0..count).rev() {
        let root = &roots[lane];
        starts[lane] = if root.node_count > 0 { root.first_node as usize } else { starts[lane + 1] };
    }
    let cut = |((lane, root), spread): ((usize, &'a mut Node<N>), &'a mut Spread)| {
        let size = starts[lane + 1] - starts[lane];
        let own_nodes = below.split_off_mut(..size).unwrap_or_default();
        let own_spreads = spreads.split_off_mut(..size).unwrap_or_default();
        Subtree { root, spread, below: own_nodes, spreads: own_spreads, fitted: Fitted::NONE }
    };
    roots.iter_mut().enumerate().zip(root_spreads).map(cut).collect()
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
