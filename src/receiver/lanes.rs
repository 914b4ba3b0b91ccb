//! A shading point as the loop over the lanes of a node needs it: numbers alone, so that all kinds share one loop
//! without a branch.

use glam::Vec3;

use super::lobe::{Lobe, NoLobe};
use crate::geometry::HORIZON_ROUNDING;
use crate::math::at_least;

/// Least expected cosine of a cluster that is not culled, at the receiver and at the lights. It keeps every light
/// possible that may be visible.
///
/// *Measured* on cloud-10000 (docs/ACCURACY.md, "Moments"). A larger value wastes samples on clusters seen edge-on; a
/// smaller one makes their samples rarer and brighter.
pub(crate) const LEAST_CLUSTER_COSINE: f32 = 1e-3;

/// A shading point prepared for the vector loop over the lanes of a node, which is compiled for each kind of lobe.
pub(crate) struct ReceiverLanes<L = NoLobe> {
    pub(crate) position: Vec3,
    /// Normal that the cosine at the receiver is taken with; zero in a medium.
    pub(crate) normal: Vec3,
    /// Bits of the cosine that count: all but its sign where both sides receive.
    pub(crate) cosine_bits: u32,
    /// Least cosine at the receiver; 1 in a medium, where it replaces the cosine.
    pub(crate) least_cosine: f32,
    /// Normal of the horizon; zero where there is none.
    pub(crate) horizon: Vec3,
    /// Height added to every cluster; positive where there is no horizon.
    pub(crate) lift: f32,
    /// Rounding granted to heights over the horizon, relative to distances.
    pub(crate) slack: f32,
    /// What is favored beyond the cosine.
    pub(crate) lobe: L,
}

impl ReceiverLanes {
    #[inline(always)]
    pub(super) fn new(
        position: Vec3,
        normal: Vec3,
        cosine_bits: u32,
        least_cosine: f32,
        horizon: Vec3,
        lift: f32,
    ) -> Self {
        let slack = HORIZON_ROUNDING * horizon.abs().element_sum();
        Self { position, normal, cosine_bits, least_cosine, horizon, lift, slack, lobe: NoLobe }
    }

    /// Returns the same shading point with a lobe.
    #[inline(always)]
    pub(crate) fn with_lobe<L: Lobe>(self, lobe: L) -> ReceiverLanes<L> {
        let Self { position, normal, cosine_bits, least_cosine, horizon, lift, slack, .. } = self;
        ReceiverLanes { position, normal, cosine_bits, least_cosine, horizon, lift, slack, lobe }
    }
}

impl<L: Lobe> ReceiverLanes<L> {
    /// Returns the mean weight of a small cell of directions by the cosine of its central direction to the normal.
    /// `least` is that of [`ReceiverKind::least_over_directions`](super::ReceiverKind::least_over_directions).
    #[inline(always)]
    pub(crate) fn weight_of_cell(&self, cosine: f32, least: f32) -> f32 {
        at_least(f32::from_bits(cosine.to_bits() & self.cosine_bits), least)
    }
}
