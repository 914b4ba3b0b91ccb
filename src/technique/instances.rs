//! What the tree over all lights leaves open where its leaves are instances: which of the object's triangles.
//!
//! The choice of an instance is followed by a walk through the object's own tree, and a probability is the product of
//! both. Scenes without instances ask once whether there are any.

use glam::Vec3;

use super::{LightScene, Viewpoint};
use crate::light::{LightLeaf, ObjectWalk, PlacedObject};
use crate::tlas::{FirstWeights, Outgoing};
use crate::warp::Variate;

impl LightScene<'_> {
    /// Draws a light by what it sends out. Returns it with its probability.
    pub(crate) fn sample_outgoing(&self, outgoing: &Outgoing, u: &mut Variate) -> Option<(LightLeaf, f64)> {
        let (leaf, pmf) = self.tlas.sample_outgoing(outgoing, u)?;
        match self.lights.instance(leaf) {
            None => Some((LightLeaf::alone(leaf), pmf)),
            Some(placed) => {
                let (below, own) = placed.sample_outgoing(outgoing, u)?;
                Some((LightLeaf::within(leaf, below), pmf * own))
            }
        }
    }

    /// Returns the probability with which [`Self::sample_outgoing`] draws a light.
    pub(crate) fn pmf_outgoing(&self, leaf: LightLeaf, outgoing: &Outgoing) -> f64 {
        let pmf = self.tlas.pmf_outgoing(leaf.top, outgoing);
        match (leaf.below(), self.lights.instance(leaf.top)) {
            (Some(below), Some(placed)) => pmf * placed.pmf_outgoing(below, outgoing),
            _ => pmf,
        }
    }

    /// Calls `visit` for each light whose box may hold a point in a cone around a unit vector, with an angular radius
    /// of this sine and cosine.
    #[inline(always)]
    pub(super) fn meet(&self, origin: Vec3, axis: Vec3, cone: [f32; 2], mut visit: impl FnMut(LightLeaf)) {
        if self.lights.has_instances() {
            self.tlas.meet(origin, axis, cone, |leaf| {
                self.visit_within(leaf, &mut visit, |placed, visit| placed.meet(origin, axis, cone, visit));
            });
        } else {
            self.tlas.meet(origin, axis, cone, |leaf| visit(LightLeaf::alone(leaf)));
        }
    }

    /// Calls `visit` for every light.
    pub(super) fn for_each_light(&self, mut visit: impl FnMut(LightLeaf)) {
        let leaves = 0..self.lights.len() as u32;
        for leaf in leaves.filter(|&leaf| !self.lights.is_edited || self.tlas.has_leaf(leaf)) {
            self.visit_within(leaf, &mut visit, |placed, visit| (0..placed.count()).for_each(visit));
        }
    }

    /// Calls `visit` for the light in a leaf; if that is an instance, for those of its triangles that `among` passes
    /// on.
    #[inline]
    pub(super) fn visit_within(
        &self,
        leaf: u32,
        visit: &mut impl FnMut(LightLeaf),
        among: impl FnOnce(&PlacedObject<'_>, &mut dyn FnMut(u32)),
    ) {
        match self.lights.instance(leaf) {
            None => visit(LightLeaf::alone(leaf)),
            Some(placed) => among(&placed, &mut |below| visit(LightLeaf::within(leaf, below))),
        }
    }
}

impl Viewpoint<'_> {
    /// Draws a light. Returns it with its probability; `None` where nothing can arrive from the part of the lights that
    /// `u` leads to. `first` are the weights of the tree's first choice, if they are known.
    #[inline(always)]
    pub(super) fn choose(&self, first: Option<&FirstWeights>, u: Variate) -> Option<(LightLeaf, f64)> {
        if self.scene.lights.has_instances() {
            return self.choose_with_instances(first, u);
        }
        let (leaf, pmf) = self.scene.tlas.sample(self, first, u)?;
        Some((LightLeaf::alone(leaf), pmf))
    }

    #[inline(never)]
    fn choose_with_instances(&self, first: Option<&FirstWeights>, mut u: Variate) -> Option<(LightLeaf, f64)> {
        let (leaf, pmf) = self.scene.tlas.sample_on(self, first, &mut u)?;
        self.choose_within(leaf, pmf, || u)
    }

    /// Draws a light of a leaf that has been chosen with this probability, or is visited this many times: the light
    /// itself, or a triangle of the instance that it is.
    #[inline]
    pub(crate) fn choose_within(&self, leaf: u32, pmf: f64, u: impl FnOnce() -> Variate) -> Option<(LightLeaf, f64)> {
        if !self.scene.lights.has_instances() {
            return Some((LightLeaf::alone(leaf), pmf));
        }
        let Some(placed) = self.scene.lights.instance(leaf) else { return Some((LightLeaf::alone(leaf), pmf)) };
        let (below, own) = self.walk(&placed)?.sample(&mut u())?;
        Some((LightLeaf::within(leaf, below), pmf * own))
    }

    /// Returns the probability with which [`Self::choose_within`] draws a light, without that of the leaf.
    #[inline]
    pub(super) fn pmf_within(&self, leaf: LightLeaf) -> f64 {
        leaf.below().map_or(1.0, |below| self.pmf_of_placed(leaf.top, below))
    }

    #[inline(never)]
    fn pmf_of_placed(&self, leaf: u32, below: u32) -> f64 {
        let walk = self.scene.lights.instance(leaf).and_then(|placed| self.walk(&placed));
        walk.map_or(0.0, |walk| walk.pmf(below))
    }

    /// Returns an estimate of the irradiance from the instance in a leaf; `None` for any other light.
    pub(super) fn irradiance_of_instance(&self, leaf: u32) -> Option<f32> {
        let placed = self.scene.lights.instance(leaf)?;
        let mean = f64::from(self.scene.environment.mean_without_features());
        let sum = self.walk(&placed).map_or(0.0, |walk| walk.irradiance());
        Some(placed.irradiance(sum, mean))
    }

    fn walk<'v>(&'v self, placed: &PlacedObject<'v>) -> Option<ObjectWalk<'v>> {
        ObjectWalk::new(placed, &self.x, Some(&self.scene.environment))
    }
}
