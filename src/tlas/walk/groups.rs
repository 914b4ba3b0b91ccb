//! Children without a light that the shading point receives: their weights are zero.

use super::importance::Estimates;
use crate::tlas::tree::WideTree;

impl<const N: usize> WideTree<'_, N> {
    /// Returns the estimates of a node's children, zero for those that hold no light in any of these light groups.
    /// Cold, so that scenes without groups keep estimates in registers.
    #[cold]
    #[inline(never)]
    pub(super) fn within_groups(&self, index: usize, groups: u32, mut estimates: Estimates<N>) -> Estimates<N> {
        let lanes = &self.groups[index * N..(index + 1) * N];
        estimates.largest = 0;
        for (lane, (weight, held)) in estimates.weights.iter_mut().zip(lanes).enumerate() {
            if held & groups == 0 {
                *weight = 0.0;
                estimates.opened &= !(1 << lane);
            }
            estimates.largest = estimates.largest.max(weight.to_bits());
        }
        estimates
    }
}
