//! Walks through one tree within another: the lights of an object, by a lobe that says how the object is placed, and
//! the instances above them. What the choice of an instance leaves of a random number chooses among its lights.

use super::FirstWeights;
use super::descend::NodeWeights;
use super::importance::LeafOracle;
use super::kept::KeepingWalk;
use super::ray::{Crossed, Met};
use crate::receiver::{Lobe, for_lobe};
use crate::simd::InstructionSet;
use crate::tlas::arity::Arity;
use crate::tlas::node::Node;
use crate::tlas::tree::{TlasView, WideTree, for_arity};
use crate::warp::{Variate, pmf_wide};
use glam::Vec3;

impl TlasView<'_> {
    /// Draws a leaf as [`Self::sample`] does, and leaves what is left of the random number.
    pub(crate) fn sample_on(
        &self,
        oracle: &impl LeafOracle,
        first: Option<&FirstWeights>,
        u: &mut Variate,
    ) -> Option<(u32, f64)> {
        for_arity!(self, tree => for_lobe!(oracle.shading_point().receiver, lobe => tree.sample_on(oracle, lobe, first, u)))
    }

    /// Draws a leaf by a given lobe. Returns it with its probability; `None` where nothing can arrive from the part of
    /// the tree that `u` leads to.
    pub(crate) fn sample_by(&self, oracle: &impl LeafOracle, lobe: impl Lobe, u: &mut Variate) -> Option<(u32, f64)> {
        for_arity!(self, tree => tree.sample_on(oracle, lobe, None, u))
    }

    /// Returns the probability with which [`Self::sample_by`] draws a leaf.
    pub(crate) fn pmf_by(&self, leaf: u32, oracle: &impl LeafOracle, lobe: impl Lobe) -> f64 {
        for_arity!(self, tree => tree.pmf_by(leaf, oracle, lobe))
    }

    /// Returns the sum of the weights of the root's children by a given lobe: an estimate of the irradiance in units of
    /// the sum of all energies. `None` for a tree without nodes.
    pub(crate) fn irradiance_by(&self, oracle: &impl LeafOracle, lobe: impl Lobe) -> Option<f32> {
        for_arity!(self, tree => (!tree.nodes.is_empty()).then(|| tree.weigh_by(0, oracle, lobe).iter().sum()))
    }

    /// Calls `visit` for each leaf whose box, widened by a margin, the ray from `origin` along `direction` (need not be
    /// a unit vector) crosses.
    pub(crate) fn cross_within(&self, origin: Vec3, direction: Vec3, margin: f32, visit: impl FnMut(u32)) {
        for_arity!(self, tree => tree.cross_within(origin, direction, margin, visit));
    }

    /// Calls `visit` for each leaf whose box may hold a point within a distance of a cone around a unit vector, with an
    /// angular radius of this sine and cosine.
    pub(crate) fn meet_within(&self, origin: Vec3, axis: Vec3, cone: [f32; 2], margin: f32, visit: impl FnMut(u32)) {
        for_arity!(self, tree => tree.meet_within(origin, axis, cone, margin, visit));
    }
}

impl<const N: usize> WideTree<'_, N> {
    /// Returns the weight of every child of a node by a given lobe.
    fn weigh_by(&self, node: usize, oracle: &impl LeafOracle, lobe: impl Lobe) -> [f32; N] {
        InstructionSet::best().run(NodeWeights { tlas: self, node, oracle, lobe })
    }

    fn sample_on(
        &self,
        oracle: &impl LeafOracle,
        lobe: impl Lobe,
        first: Option<&FirstWeights>,
        u: &mut Variate,
    ) -> Option<(u32, f64)> {
        if self.nodes.is_empty() {
            return self.single_leaf(oracle).then_some((0, 1.0));
        }
        InstructionSet::best().run(KeepingWalk { tlas: self, oracle, lobe, first, u })
    }

    fn pmf_by(&self, leaf: u32, oracle: &impl LeafOracle, lobe: impl Lobe) -> f64 {
        if self.nodes.is_empty() {
            return if self.single_leaf(oracle) { 1.0 } else { 0.0 };
        }
        self.path(leaf).map(|(node, lane)| pmf_wide(&self.weigh_by(node, oracle, lobe), lane)).product()
    }

    fn cross_within(&self, origin: Vec3, direction: Vec3, margin: f32, visit: impl FnMut(u32)) {
        let (level, inverse) = (InstructionSet::best(), direction.recip());
        let entered = |node: &Node<N>| level.run(Crossed::<N, true> { node, origin, inverse, margin });
        self.walk(entered, visit);
    }

    fn meet_within(&self, origin: Vec3, axis: Vec3, cone: [f32; 2], margin: f32, visit: impl FnMut(u32)) {
        let level = InstructionSet::best();
        self.walk(|node| level.run(Met::<N, true> { node, origin, axis, cone, margin }), visit);
    }
}
