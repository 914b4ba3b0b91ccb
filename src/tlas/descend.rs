//! From the root to a leaf, and from a leaf back to the root: the same weights decide both.

use super::importance::Scene;
use super::node::{Child, TlasView};
use crate::record::ShadingPoint;
use crate::warp::{Variate, pick, pmf, sum};

impl<const N: usize> TlasView<'_, N> {
    /// Draws a leaf. Returns it with its probability; `None` where nothing can arrive from the part of the tree
    /// that `u` leads to.
    pub(crate) fn sample(&self, x: &ShadingPoint, scene: &impl Scene, u: &mut Variate) -> Option<(u32, f64)> {
        if self.nodes.is_empty() {
            return self.single_leaf(scene).then_some((0, 1.0));
        }
        self.sample_below(0, x, scene, u)
    }

    /// Draws a leaf below a node.
    pub(super) fn sample_below(
        &self,
        mut node: usize,
        x: &ShadingPoint,
        scene: &impl Scene,
        u: &mut Variate,
    ) -> Option<(u32, f64)> {
        let mut pmf = 1.0;
        loop {
            let weights = self.nodes[node].weights(x, scene);
            let total = sum(&weights);
            if total == 0.0 {
                return None;
            }
            let lane = pick(&weights, total, u);
            pmf *= f64::from(weights[lane]) / total;
            match self.nodes[node].child(lane) {
                Child::Node(index) => node = index as usize,
                Child::Leaf(leaf) => return Some((leaf, pmf)),
                Child::Empty => return None,
            }
        }
    }

    /// Probability with which [`Self::sample`] draws a leaf.
    pub(crate) fn pmf(&self, leaf: u32, x: &ShadingPoint, scene: &impl Scene) -> f64 {
        if self.nodes.is_empty() {
            return if self.single_leaf(scene) { 1.0 } else { 0.0 };
        }
        self.path(leaf).map(|(node, lane)| pmf(&self.nodes[node].weights(x, scene), lane)).product()
    }

    /// Estimate of the irradiance from all leaves, in units of the sum of their energies. Zero for a tree without
    /// nodes.
    pub(crate) fn irradiance(&self, x: &ShadingPoint, scene: &impl Scene) -> f32 {
        self.nodes.first().map_or(0.0, |root| root.weights(x, scene).iter().sum())
    }

    /// Nodes and lanes on the way from a leaf to the root.
    pub(super) fn path(&self, leaf: u32) -> impl Iterator<Item = (usize, usize)> {
        core::iter::successors(self.leaves[leaf as usize].get::<N>(), |&(node, _)| self.parents[node].get::<N>())
    }

    /// Whether the tree is a single leaf, and that leaf visible.
    pub(super) fn single_leaf(&self, scene: &impl Scene) -> bool {
        self.leaves.len() == 1 && scene.is_visible(0)
    }
}
