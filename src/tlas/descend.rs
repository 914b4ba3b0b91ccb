//! From the root to a leaf, and from a leaf back to the root: the same weights decide both.

use super::importance::{Scene, Sight};
use super::node::{Child, Node, TlasView};
use crate::record::ShadingPoint;
use crate::simd::{Level, Work};
use crate::warp::{Variate, pick_wide, pmf_wide};

/// The way down to a leaf.
pub(super) struct Draw<'a, const N: usize, S> {
    pub(super) tlas: &'a TlasView<'a, N>,
    /// Where it begins.
    pub(super) node: usize,
    pub(super) x: &'a ShadingPoint,
    pub(super) scene: &'a S,
    pub(super) u: &'a mut Variate,
}

impl<const N: usize, S: Scene> Work for Draw<'_, N, S> {
    type Output = Option<(u32, f64)>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        let sight = Sight::new(self.x);
        let mut node = self.node;
        let mut pmf = 1.0;
        loop {
            let weights = self.tlas.nodes[node].weights(&sight, self.scene);
            let (lane, share) = pick_wide(&weights, self.u)?;
            pmf *= share;
            match self.tlas.nodes[node].child(lane) {
                Child::Node(index) => node = index as usize,
                Child::Leaf(leaf) => return Some((leaf, pmf)),
                Child::Empty => return None,
            }
        }
    }
}

/// The way back from a leaf: the probability that [`Draw`] takes it.
pub(super) struct Follow<'a, const N: usize, S> {
    pub(super) tlas: &'a TlasView<'a, N>,
    pub(super) leaf: u32,
    pub(super) x: &'a ShadingPoint,
    pub(super) scene: &'a S,
}

impl<const N: usize, S: Scene> Work for Follow<'_, N, S> {
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let sight = Sight::new(self.x);
        let share = |(node, lane): (usize, usize)| pmf_wide(&self.tlas.nodes[node].weights(&sight, self.scene), lane);
        self.tlas.path(self.leaf).map(share).product()
    }
}

/// The weights of one node.
struct Weigh<'a, const N: usize, S> {
    node: &'a Node<N>,
    x: &'a ShadingPoint,
    scene: &'a S,
}

impl<const N: usize, S: Scene> Work for Weigh<'_, N, S> {
    type Output = [f32; N];

    #[inline(always)]
    fn run(self) -> [f32; N] {
        self.node.weights(&Sight::new(self.x), self.scene)
    }
}

impl<const N: usize> Node<N> {
    /// Weight of every child.
    pub(super) fn weigh(&self, x: &ShadingPoint, scene: &impl Scene) -> [f32; N] {
        Level::best().run(Weigh { node: self, x, scene })
    }
}

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
        node: usize,
        x: &ShadingPoint,
        scene: &impl Scene,
        u: &mut Variate,
    ) -> Option<(u32, f64)> {
        Level::best().run(Draw { tlas: self, node, x, scene, u })
    }

    /// Probability with which [`Self::sample`] draws a leaf.
    pub(crate) fn pmf(&self, leaf: u32, x: &ShadingPoint, scene: &impl Scene) -> f64 {
        if self.nodes.is_empty() {
            return if self.single_leaf(scene) { 1.0 } else { 0.0 };
        }
        Level::best().run(Follow { tlas: self, leaf, x, scene })
    }

    /// Estimate of the irradiance from all leaves, in units of the sum of their energies. Zero for a tree without
    /// nodes.
    pub(crate) fn irradiance(&self, x: &ShadingPoint, scene: &impl Scene) -> f32 {
        self.nodes.first().map_or(0.0, |root| root.weigh(x, scene).iter().sum())
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
