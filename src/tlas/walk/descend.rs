//! From the root to a leaf, and from a leaf back to the root: the same weights decide both.

use super::importance::LeafOracle;
use crate::receiver::{Lobe, ReceiverLanes, for_lobe};
use crate::simd::{InstructionSet, Kernel, prefetch};
use crate::tlas::arity::MAX_LANES;
use crate::tlas::node::{Child, Node};
use crate::tlas::tree::WideTree;
use crate::warp::{Variate, pick_wide, pmf_wide};

/// Number of walks that are interleaved. Fewer hide less of the waiting for memory, more leave the cache. Affects time
/// alone. Chosen; see docs/SPEED.md on `sample_many`.
pub(crate) const INTERLEAVED: usize = 8;

/// A way down the tree, as far as it has got.
pub(crate) struct Descent<S, L> {
    receiver: ReceiverLanes<L>,
    oracle: S,
    u: Variate,
    node: u32,
    /// Probability of getting here.
    pmf: f64,
    /// Where it ended: in a leaf, or with nothing.
    end: Option<Option<u32>>,
}

impl<S: LeafOracle, L: Lobe> Descent<S, L> {
    /// Starts at the root. The lobe is that of the receiver.
    #[inline(always)]
    pub(crate) fn new(oracle: S, lobe: L, u: Variate) -> Self {
        Self { receiver: oracle.shading_point().lanes(lobe), oracle, u, node: 0, pmf: 1.0, end: None }
    }

    /// Returns the leaf that was drawn, with its probability.
    #[inline(always)]
    pub(crate) fn leaf(&self) -> Option<(u32, f64)> {
        self.end.flatten().map(|leaf| (leaf, self.pmf))
    }

    /// Goes on to a child, unless this is the end.
    #[inline(always)]
    fn step<const N: usize>(&mut self, tlas: &WideTree<'_, N>) {
        let node = &tlas.nodes[self.node as usize];
        let weights = tlas.weights(self.node as usize, &self.receiver, &self.oracle);
        self.choose(node, &weights);
    }

    /// Chooses a child by the weights of all.
    #[inline(always)]
    fn choose<const N: usize>(&mut self, node: &Node<N>, weights: &[f32; N]) {
        let Some((lane, share)) = pick_wide(weights, &mut self.u) else {
            self.end = Some(None);
            return;
        };
        self.pmf *= share;
        match node.child(lane) {
            Child::Node(index) => self.node = index,
            Child::Leaf(leaf) => self.end = Some(Some(leaf)),
            Child::Empty => self.end = Some(None),
        }
    }
}

/// Weights of the root's children, zero in the lanes that the arity does not have.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FirstWeights([f32; MAX_LANES]);

impl FirstWeights {
    fn new<const N: usize>(weights: [f32; N]) -> Self {
        Self(core::array::from_fn(|lane| if lane < N { weights[lane] } else { 0.0 }))
    }

    #[inline(always)]
    pub(super) fn lanes<const N: usize>(&self) -> [f32; N] {
        core::array::from_fn(|lane| self.0[lane])
    }

    /// Returns the sum of all weights: an estimate of the irradiance in units of the sum of all energies.
    #[inline]
    pub(crate) fn sum(&self) -> f32 {
        self.0.iter().sum()
    }
}

/// One way down to a leaf.
pub(in crate::tlas) struct SampleWalk<'a, const N: usize, S, L> {
    pub(in crate::tlas) tlas: &'a WideTree<'a, N>,
    pub(in crate::tlas) walk: Descent<S, L>,
}

impl<const N: usize, S: LeafOracle, L: Lobe> Kernel for SampleWalk<'_, N, S, L> {
    type Output = Option<(u32, f64)>;
    const USES_512_BITS: bool = N >= 16;

    #[inline(always)]
    fn run(mut self) -> Self::Output {
        while self.walk.end.is_none() {
            self.walk.step(self.tlas);
        }
        self.walk.leaf()
    }
}

/// Several ways down, interleaved by steps, and each step in two halves: while one way waits for memory or for sums,
/// the others go on. A machine looks ahead by about one step, so that it would not find the next one by itself.
struct InterleavedWalks<'a, const N: usize, S, L> {
    tlas: &'a WideTree<'a, N>,
    walks: &'a mut [Descent<S, L>],
}

impl<const N: usize, S: LeafOracle, L: Lobe> Kernel for InterleavedWalks<'_, N, S, L> {
    type Output = ();
    const USES_512_BITS: bool = N >= 16;

    #[inline(always)]
    fn run(self) {
        for walks in self.walks.chunks_mut(INTERLEAVED) {
            let mut weights = [[0.0; N]; INTERLEAVED];
            let mut going = true;
            while going {
                for (walk, weights) in walks.iter().zip(&mut weights).filter(|(walk, _)| walk.end.is_none()) {
                    *weights = self.tlas.weights(walk.node as usize, &walk.receiver, &walk.oracle);
                }
                going = false;
                for (walk, weights) in walks.iter_mut().zip(&weights).filter(|(walk, _)| walk.end.is_none()) {
                    walk.choose(&self.tlas.nodes[walk.node as usize], weights);
                    prefetch(&self.tlas.nodes[walk.node as usize]);
                    going = true;
                }
            }
        }
    }
}

/// The way back from a leaf: the probability that [`SampleWalk`] draws it.
pub(in crate::tlas) struct PmfWalk<'a, const N: usize, S, L> {
    pub(in crate::tlas) tlas: &'a WideTree<'a, N>,
    pub(in crate::tlas) leaf: u32,
    pub(in crate::tlas) oracle: &'a S,
    pub(in crate::tlas) lobe: L,
    /// Weights of the root, if they are known.
    pub(in crate::tlas) first: Option<&'a FirstWeights>,
}

impl<const N: usize, S: LeafOracle, L: Lobe> Kernel for PmfWalk<'_, N, S, L> {
    type Output = f64;
    const USES_512_BITS: bool = N >= 16;

    #[inline(always)]
    fn run(self) -> f64 {
        // The way is short to find, but its nodes are far apart in memory.
        self.tlas.path(self.leaf).for_each(|(node, _)| prefetch(&self.tlas.nodes[node]));
        let receiver = self.oracle.shading_point().lanes(self.lobe);
        let mut pmf = 1.0;
        // Not a fold, whose closure would be compiled for the baseline.
        for (node, lane) in self.tlas.path(self.leaf) {
            pmf *= match self.first {
                Some(weights) if node == 0 => pmf_wide(&weights.lanes::<N>(), lane),
                _ => pmf_wide(&self.tlas.weights(node, &receiver, self.oracle), lane),
            };
        }
        pmf
    }
}

/// The weights of one node.
pub(super) struct NodeWeights<'a, const N: usize, S, L> {
    pub(super) tlas: &'a WideTree<'a, N>,
    pub(super) node: usize,
    pub(super) oracle: &'a S,
    pub(super) lobe: L,
}

impl<const N: usize, S: LeafOracle, L: Lobe> Kernel for NodeWeights<'_, N, S, L> {
    type Output = [f32; N];
    const USES_512_BITS: bool = N >= 16;

    #[inline(always)]
    fn run(self) -> [f32; N] {
        self.tlas.weights(self.node, &self.oracle.shading_point().lanes(self.lobe), self.oracle)
    }
}

impl<const N: usize> WideTree<'_, N> {
    /// Returns the weight of every child of a node.
    pub(in crate::tlas) fn weigh(&self, node: usize, oracle: &impl LeafOracle) -> [f32; N] {
        let receiver = oracle.shading_point().receiver;
        for_lobe!(receiver, lobe => InstructionSet::best().run(NodeWeights { tlas: self, node, oracle, lobe }))
    }

    /// Draws a leaf. Returns it with its probability; `None` where nothing can arrive from the part of the tree
    /// that `u` leads to. `first` are [`Self::first_weights`], if they are known.
    pub(crate) fn sample(
        &self,
        oracle: &impl LeafOracle,
        first: Option<&FirstWeights>,
        u: Variate,
    ) -> Option<(u32, f64)> {
        let Some(root) = self.nodes.first() else { return self.single_leaf(oracle).then_some((0, 1.0)) };
        for_lobe!(oracle.shading_point().receiver, lobe => {
            let mut walk = Descent::new(oracle, lobe, u);
            if let Some(weights) = first {
                walk.choose(root, &weights.lanes());
            }
            InstructionSet::best().run(SampleWalk { tlas: self, walk })
        })
    }

    /// Draws a leaf below a node.
    pub(in crate::tlas) fn sample_below(
        &self,
        node: usize,
        oracle: &impl LeafOracle,
        u: Variate,
    ) -> Option<(u32, f64)> {
        for_lobe!(oracle.shading_point().receiver, lobe => {
            let walk = Descent { node: node as u32, ..Descent::new(oracle, lobe, u) };
            InstructionSet::best().run(SampleWalk { tlas: self, walk })
        })
    }

    /// Draws a leaf for each walk, which then holds it.
    pub(crate) fn sample_many(&self, walks: &mut [Descent<impl LeafOracle, impl Lobe>], first: Option<&FirstWeights>) {
        let Some(root) = self.nodes.first() else {
            for walk in walks {
                walk.end = Some(self.single_leaf(&walk.oracle).then_some(0));
            }
            return;
        };
        if let Some(weights) = first {
            walks.iter_mut().for_each(|walk| walk.choose(root, &weights.lanes()));
        }
        InstructionSet::best().run(InterleavedWalks { tlas: self, walks });
    }

    /// Returns the probability with which [`Self::sample`] draws a leaf.
    pub(crate) fn pmf(&self, leaf: u32, oracle: &impl LeafOracle, first: Option<&FirstWeights>) -> f64 {
        if self.nodes.is_empty() {
            return if self.single_leaf(oracle) { 1.0 } else { 0.0 };
        }
        let receiver = oracle.shading_point().receiver;
        for_lobe!(receiver, lobe => InstructionSet::best().run(PmfWalk { tlas: self, leaf, oracle, lobe, first }))
    }

    /// Returns the weights of the root's children, which add up to an estimate of the irradiance in units of the sum of
    /// all energies; `None` for a tree without nodes.
    pub(crate) fn first_weights(&self, oracle: &impl LeafOracle) -> Option<FirstWeights> {
        (!self.nodes.is_empty()).then(|| FirstWeights::new(self.weigh(0, oracle)))
    }

    /// Whether the tree is a single leaf, and that leaf visible.
    pub(in crate::tlas) fn single_leaf(&self, oracle: &impl LeafOracle) -> bool {
        self.leaves.len() == 1 && oracle.is_visible(0)
    }
}
