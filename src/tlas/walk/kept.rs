//! Ways down a tree whose leaves are instances, or of an object: they keep what they find out.
//!
//! The weight of a child that is near the shading point is the sum of the weights of its own children. Where such a
//! child is chosen, these are the weights of the next choice, but for those of its children that are near in turn. A
//! node near an instance takes long to weigh, as the instance is weighed by its own tree. All steps are one kernel.

use super::FirstWeights;
use super::importance::{Estimates, LeafOracle};
use crate::receiver::Lobe;
use crate::simd::Kernel;
use crate::tlas::node::Child;
use crate::tlas::tree::WideTree;
use crate::warp::{Variate, pick_wide};

/// Most children of a node whose estimates are kept. Affects time alone. *Chosen*: near a plane of lights about three
/// children of a node are near.
///
/// Larger: more memory is cleared for each walk. Smaller: more nodes are weighed twice.
const MOST_KEPT: usize = 4;

/// Estimates of those children of a node that were opened.
struct Kept<const N: usize> {
    /// The nodes, as far as there are any.
    nodes: [u32; MOST_KEPT],
    estimates: [Estimates<N>; MOST_KEPT],
    len: usize,
}

impl<const N: usize> Kept<N> {
    #[inline(always)]
    fn none() -> Self {
        let estimates =
            [(); MOST_KEPT].map(|()| Estimates { weights: [0.0; N], largest: 0, doubtful: [0; 2], opened: 0 });
        Self { nodes: [0; MOST_KEPT], estimates, len: 0 }
    }

    #[inline(always)]
    fn keep(&mut self, node: u32, estimates: Estimates<N>) {
        if self.len < MOST_KEPT {
            self.nodes[self.len] = node;
            self.estimates[self.len] = estimates;
            self.len += 1;
        }
    }

    /// Returns what is kept of a node.
    #[inline(always)]
    fn of(&self, node: u32) -> Option<Estimates<N>> {
        self.nodes[..self.len].iter().position(|kept| *kept == node).map(|i| self.estimates[i])
    }
}

/// One way down, which leaves what is left of the random number.
pub(super) struct KeepingWalk<'a, const N: usize, S, L> {
    pub(super) tlas: &'a WideTree<'a, N>,
    pub(super) oracle: &'a S,
    pub(super) lobe: L,
    /// Weights of the root, if they are known.
    pub(super) first: Option<&'a FirstWeights>,
    pub(super) u: &'a mut Variate,
}

impl<const N: usize, S: LeafOracle, L: Lobe> Kernel for KeepingWalk<'_, N, S, L> {
    type Output = Option<(u32, f64)>;
    const USES_512_BITS: bool = N >= 16;

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { tlas, oracle, lobe, mut first, u } = self;
        let receiver = oracle.shading_point().lanes(lobe);
        let mut kept = Kept::none();
        let (mut node, mut pmf) = (0, 1.0);
        loop {
            let weights = match first.take() {
                Some(weights) => weights.lanes(),
                None => {
                    let known = kept.of(node);
                    kept.len = 0;
                    let own = match known {
                        Some(estimates) => estimates,
                        None => tlas.own_estimates(node as usize, &receiver, oracle),
                    };
                    tlas.weights_by(node as usize, own, &receiver, oracle, |child, below| kept.keep(child, below))
                }
            };
            let (lane, share) = pick_wide(&weights, u)?;
            pmf *= share;
            match tlas.nodes[node as usize].child(lane) {
                Child::Node(index) => node = index,
                Child::Leaf(leaf) => return Some((leaf, pmf)),
                Child::Empty => return None,
            }
        }
    }
}
