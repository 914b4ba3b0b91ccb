//! Which clusters are looked into before they are weighed, and how deep.
//!
//! A cluster near the shading point is opened, as moments say little of it from there. A cluster around the shading
//! point is opened further: as seen from its middle, one of its lights may send more than all others together. A
//! cluster that the horizon crosses, and whose mean lies below it, is opened where such clusters are a good part of
//! what a node sends: all of its lights may be dark, and a sample that chooses it is lost.

use super::importance::{Estimates, LeafOracle};
use crate::math::only_if;
use crate::receiver::{Lobe, ReceiverLanes};
use crate::tlas::tree::WideTree;
use crate::warp::within_range;

/// Share of a node's weight that children in doubt must have together, so that any of them is opened. *Measured* on
/// clouds and spheres (docs/ACCURACY.md, "Samples that choose nothing").
///
/// Larger: more samples choose nothing. Smaller: children are opened that hardly matter.
const DOUBTFUL_SHARE: f32 = 0.3;
/// Least share of a node's weight of a child in doubt that is opened. *Measured* as above.
///
/// Larger: more samples choose nothing. Smaller: up to one over it of the children are opened.
const LEAST_DOUBTFUL: f32 = 0.02;
/// Most nodes that are weighed for one child. *Measured* as above; a bound where a great many lights overlap.
///
/// Larger: points inside of many lights take longer. Smaller: the light next to a point is mistaken for its
/// neighbors.
const MOST_OPENED: usize = 6;

/// Returns the sum of weights, by four, so that it does not wait for each of them.
#[inline(always)]
fn total<const N: usize>(weights: &[f32; N]) -> f32 {
    let mut sums = [0.0; 4];
    for four in weights.chunks_exact(4) {
        for (sum, weight) in sums.iter_mut().zip(four) {
            *sum += weight;
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

impl<const N: usize> Estimates<N> {
    /// Returns those of a node without children.
    #[inline(always)]
    pub(super) fn none() -> Self {
        Self { weights: [0.0; N], largest: 0, doubtful: [0; 2], opened: 0, around: 0, unsure: 0 }
    }

    /// Returns the children that are to be opened because nothing may arrive from any of their lights, as a set of
    /// bits.
    #[inline(always)]
    pub(super) fn doubted(&self) -> u32 {
        if self.unsure == 0 {
            return 0;
        }
        let mut unsure = [0.0; N];
        for (lane, weight) in unsure.iter_mut().enumerate() {
            *weight = only_if(self.unsure >> lane & 1 != 0, self.weights[lane]);
        }
        let all = total(&self.weights);
        if total(&unsure) <= DOUBTFUL_SHARE * all {
            return 0;
        }
        (0..N).fold(0, |set, lane| set | u32::from(unsure[lane] > LEAST_DOUBTFUL * all) << lane)
    }
}

impl<const N: usize> WideTree<'_, N> {
    /// Returns the sum of the weights of a node's children, of which those around the shading point are opened
    /// themselves.
    #[inline(always)]
    pub(super) fn opened(&self, index: usize, x: &ReceiverLanes<impl Lobe>, oracle: &impl LeafOracle) -> f32 {
        self.opened_from(index, self.estimated(index, x, oracle), x, oracle)
    }

    /// Returns [`opened`](Self::opened) by the estimates of the node's children.
    #[inline(always)]
    pub(super) fn opened_from(
        &self,
        mut index: usize,
        mut estimates: Estimates<N>,
        x: &ReceiverLanes<impl Lobe>,
        oracle: &impl LeafOracle,
    ) -> f32 {
        let mut waiting = [0; MOST_OPENED];
        let (mut next, mut end, mut sum) = (1, 1, 0.0);
        // What is known of walls is known of the children of few nodes, and stays with them.
        let most = if oracle.has_factors() { 1 } else { MOST_OPENED };
        loop {
            let mut around = estimates.around;
            while around != 0 && end < most {
                let lane = around.trailing_zeros();
                around &= around - 1;
                estimates.weights[lane as usize] = 0.0;
                waiting[end] = self.nodes[index].first_node.wrapping_add(lane);
                end += 1;
            }
            sum += total(&estimates.weights);
            if next == end {
                return only_if(sum > 0.0, within_range(sum));
            }
            index = waiting[next] as usize;
            next += 1;
            estimates = self.estimated(index, x, oracle);
        }
    }
}
