//! What is asked of a finished tree. Whatever draws a leaf has its density next to it, by the same weights.
//!
//! The methods of [`TlasView`] look at the arity once and leave the walk to those of
//! [`WideTree`](super::tree::WideTree) of the same name.

mod beam;
pub(in crate::tlas) mod descend;
mod factors;
mod groups;
mod importance;
mod kept;
mod learned;
pub(in crate::tlas) mod ray;
mod segment;
mod shaped;
mod split;
mod within;

use glam::Vec3;

pub(crate) use beam::{Beam, Outgoing};
pub(crate) use descend::{Descent, FirstWeights, INTERLEAVED};
pub(crate) use factors::{FACTORS, FactorBytes, factor};
pub(crate) use importance::LeafOracle;
pub(crate) use segment::{ClusterAlong, ClusterMoments, Clusters, Stretch};
pub use split::Splitting;

use crate::receiver::Lobe;
use crate::tlas::arity::Arity;
use crate::tlas::tree::{TlasView, for_arity};
use crate::warp::Variate;

impl TlasView<'_> {
    /// Draws a leaf. Returns it with its probability; `None` where nothing can arrive from the part of the tree
    /// that `u` leads to. `first` are [`Self::first_weights`], if they are known.
    #[inline]
    pub(crate) fn sample(
        &self,
        oracle: &impl LeafOracle,
        first: Option<&FirstWeights>,
        u: Variate,
    ) -> Option<(u32, f64)> {
        for_arity!(self, tree => tree.sample(oracle, first, u))
    }

    /// Draws a leaf for each descent, as [`Self::sample`] does. Each descent then holds what was drawn. `first` are
    /// [`Self::first_weights`] of all descents, where they begin at one shading point.
    pub(crate) fn sample_many(
        &self,
        descents: &mut [Descent<impl LeafOracle, impl Lobe>],
        first: Option<&FirstWeights>,
    ) {
        for_arity!(self, tree => tree.sample_many(descents, first));
    }

    /// Returns the probability with which [`Self::sample`] draws a leaf.
    #[inline]
    pub(crate) fn pmf(&self, leaf: u32, oracle: &impl LeafOracle, first: Option<&FirstWeights>) -> f64 {
        for_arity!(self, tree => tree.pmf(leaf, oracle, first))
    }

    /// Returns the weights of the root's children; `None` for a tree without nodes.
    #[inline]
    pub(crate) fn first_weights(&self, oracle: &impl LeafOracle) -> Option<FirstWeights> {
        for_arity!(self, tree => tree.first_weights(oracle))
    }

    /// Draws a leaf from every part of the tree that splitting visits, each with the density of its kind among all
    /// drawn: `visit(leaf, expected count)`. `variate(i)` gives the number that the i-th draw is made with.
    #[inline]
    pub(crate) fn sample_split(
        &self,
        oracle: &impl LeafOracle,
        splitting: &Splitting,
        variate: impl FnMut(u32) -> Variate,
        visit: impl FnMut(u32, f64),
    ) {
        for_arity!(self, tree => tree.sample_split(oracle, splitting, variate, visit));
    }

    /// Returns the expected number of times that [`Self::sample_split`] visits a leaf.
    #[inline]
    pub(crate) fn expected_count(&self, leaf: u32, oracle: &impl LeafOracle, splitting: &Splitting) -> f64 {
        for_arity!(self, tree => tree.expected_count(leaf, oracle, splitting))
    }

    /// Draws a leaf by what it sends out. Returns it with its probability. A tree of one leaf gives that leaf.
    #[inline]
    pub(crate) fn sample_outgoing(&self, outgoing: &Outgoing, u: &mut Variate) -> Option<(u32, f64)> {
        for_arity!(self, tree => tree.sample_outgoing(outgoing, u))
    }

    /// Returns the probability with which [`Self::sample_outgoing`] draws a leaf.
    #[inline]
    pub(crate) fn pmf_outgoing(&self, leaf: u32, outgoing: &Outgoing) -> f64 {
        for_arity!(self, tree => tree.pmf_outgoing(leaf, outgoing))
    }

    /// Returns what all leaves send out, in units of the sum of their energies; `None` for a tree without nodes.
    #[inline]
    pub(crate) fn outgoing(&self, outgoing: &Outgoing) -> Option<f32> {
        for_arity!(self, tree => tree.outgoing(outgoing))
    }

    /// Calls `visit` for each leaf whose box the ray from `origin` along `direction` (need not be a unit vector)
    /// crosses.
    #[inline]
    pub(crate) fn cross(&self, origin: Vec3, direction: Vec3, visit: impl FnMut(u32)) {
        for_arity!(self, tree => tree.cross(origin, direction, visit));
    }

    /// Finds clusters of lights that are small for their distance from a stretch of a ray, as far as there is room for.
    pub(crate) fn clusters_along(&self, stretch: &Stretch, groups: u32) -> Clusters {
        for_arity!(self, tree => tree.clusters_along(stretch, groups))
    }

    /// Calls `visit` for each leaf whose box parallel rays in a direction, a unit vector, may meet that start on a
    /// stretch of another ray.
    pub(crate) fn meet_strip(&self, stretch: &Stretch, direction: Vec3, visit: impl FnMut(u32)) {
        for_arity!(self, tree => tree.meet_strip(stretch, direction, visit));
    }

    /// Calls `visit` for each leaf whose box may hold a point in a cone around a unit vector, with an angular radius of
    /// this sine and cosine.
    #[inline]
    pub(crate) fn meet(&self, origin: Vec3, axis: Vec3, cone: [f32; 2], visit: impl FnMut(u32)) {
        for_arity!(self, tree => tree.meet(origin, axis, cone, visit));
    }
}
