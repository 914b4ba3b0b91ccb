//! The receiver's side of a weight, in the form that all lanes share. The only place of the tree that distinguishes kinds
//! of receivers.

use glam::Vec3;

use crate::record::{Receiver, ShadingPoint};

/// Least expected cosine of a cluster that is not culled, on either side. Keeps every light possible that may be visible:
/// a larger one wastes samples on clusters seen edge-on, a smaller one makes their samples rarer and brighter. *Measured*:
/// docs/ACCURACY.md, "Moments".
pub(super) const LEAST_CLUSTER_COSINE: f32 = 1e-3;
/// Relative error granted to the dot products that decide on culling. *Proved*: covers their rounding, three products
/// and three sums of 6e-8 each, twentyfold. A larger one culls a little less.
const CULL_ROUNDING: f32 = 1e-5;

/// A shading point, prepared for the loop over the lanes of a node.
pub(super) struct ReceiverLanes {
    pub(super) position: Vec3,
    /// Normal for the cosine at the receiver; zero in a medium.
    pub(super) normal: Vec3,
    /// Bits of the cosine that count: all but its sign, where both sides receive.
    pub(super) cosine_bits: u32,
    /// Least cosine at the receiver; 1 in a medium, where it replaces the cosine.
    pub(super) least_cosine: f32,
    /// Normal of the horizon; zero without one.
    pub(super) horizon: Vec3,
    /// Height that is added to all heights above the horizon: positive without a horizon, so that nothing is below.
    pub(super) lift: f32,
    /// Rounding granted to heights over the horizon, relative to distances.
    pub(super) slack: f32,
}

impl ReceiverLanes {
    /// Prepares a shading point.
    #[inline(always)]
    pub(super) fn new(x: &ShadingPoint) -> Self {
        let position = x.position;
        let (all, unsigned) = (u32::MAX, u32::MAX >> 1);
        let (normal, cosine_bits, least_cosine, horizon, lift) = match x.receiver {
            Receiver::Surface(normal) => (normal, all, LEAST_CLUSTER_COSINE, normal, 0.0),
            Receiver::Transmissive(normal) => (normal, unsigned, LEAST_CLUSTER_COSINE, Vec3::ZERO, 1.0),
            Receiver::Volume => (Vec3::ZERO, all, 1.0, Vec3::ZERO, 1.0),
        };
        let slack = CULL_ROUNDING * horizon.abs().element_sum();
        Self { position, normal, cosine_bits, least_cosine, horizon, lift, slack }
    }
}
