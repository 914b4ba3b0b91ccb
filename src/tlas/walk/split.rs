//! Adaptive tree splitting (Conty Estevez and Kulla 2018, section 5.4): where the lights of a node differ much, as
//! seen from the shading point, all of its children are visited instead of one.

use super::importance::LeafOracle;
use crate::math;
use crate::receiver::ShadingPoint;
use crate::tlas::node::Child;
use crate::tlas::tree::WideTree;
use crate::warp::{self, Variate};

/// How far a light tree is split.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Splitting {
    /// From 0 (never) to 1 (always): a node is split where `(1 + σ)^-1/4` lies below, with σ the standard deviation
    /// of its contribution relative to the whole tree's.
    pub threshold: f32,
    /// Levels of the tree, counted from the root, that may be split. A tree of [arity](crate::Arity) `N` gives
    /// at most `N^levels` samples.
    pub levels: u32,
}

impl Splitting {
    /// Returns a splitting with this threshold, in `[0, 1]`, and number of levels.
    #[must_use]
    pub const fn new(threshold: f32, levels: u32) -> Self {
        Self { threshold, levels }
    }
}

impl Default for Splitting {
    fn default() -> Self {
        Self { threshold: 0.5, levels: 1 }
    }
}

/// Frame of the measure: distances are in units of the distance to the tree as a whole.
struct Measure {
    threshold: f32,
    inverse_scale2: f32,
}

impl<const N: usize> WideTree<'_, N> {
    /// Draws a leaf from every part of the tree that splitting visits, each with the density of its kind among all
    /// drawn: `visit(leaf, expected count)`. `variate(i)` gives the number that the i-th draw is made with.
    pub(crate) fn sample_split(
        &self,
        oracle: &impl LeafOracle,
        splitting: &Splitting,
        mut variate: impl FnMut(u32) -> Variate,
        mut visit: impl FnMut(u32, f64),
    ) {
        if self.nodes.is_empty() {
            if self.single_leaf(oracle) {
                visit(0, 1.0);
            }
            return;
        }
        let x = oracle.shading_point();
        let measure = self.measure(x, splitting);
        let mut draws = 0;
        // Depth first through the split nodes, without a stack: from a finished node on to the next lane above it.
        let (mut node, mut lane, mut depth) = (0, 0, 0);
        let mut arriving = true;
        let mut weights = [0.0; N];
        loop {
            if arriving && depth < splitting.levels && self.is_split(node, x, &measure) {
                weights = self.weigh(node, oracle);
            } else if arriving {
                if let Some((leaf, count)) = self.sample_below(node, oracle, variate(draws)) {
                    visit(leaf, count);
                }
                draws += 1;
                lane = N;
            }
            arriving = false;
            if lane == N {
                let Some((parent, from)) = self.parent(node) else { return };
                (node, lane, depth) = (parent, from + 1, depth - 1);
                weights = self.weigh(node, oracle);
                continue;
            }
            match self.nodes[node].child(lane) {
                Child::Node(index) if weights[lane] > 0.0 => {
                    (node, lane, depth, arriving) = (index as usize, 0, depth + 1, true);
                }
                Child::Leaf(leaf) if weights[lane] > 0.0 => {
                    visit(leaf, 1.0);
                    lane += 1;
                }
                _ => lane += 1,
            }
        }
    }

    /// Returns the expected number of times that [`Self::sample_split`] visits a leaf.
    pub(crate) fn expected_count(&self, leaf: u32, oracle: &impl LeafOracle, splitting: &Splitting) -> f64 {
        if self.nodes.is_empty() {
            return self.pmf(leaf, oracle, None);
        }
        let x = oracle.shading_point();
        let measure = self.measure(x, splitting);
        let height = self.path(leaf).count() as u32;
        // A node splits only below split nodes: `count` assumes that all above do, `pmf` that none does.
        let (mut count, mut pmf) = (1.0, 1.0);
        for (i, (node, lane)) in (0..).zip(self.path(leaf)) {
            let share = warp::pmf_wide(&self.weigh(node, oracle), lane);
            pmf *= share;
            let depth = height - 1 - i;
            if !(depth < splitting.levels && self.is_split(node, x, &measure)) {
                count = pmf;
            } else if share == 0.0 {
                count = 0.0;
            }
        }
        count
    }

    fn measure(&self, x: &ShadingPoint, splitting: &Splitting) -> Measure {
        let (near, far) = self.distances(0, x);
        let scale = 0.5 * (near + far);
        Measure { threshold: splitting.threshold, inverse_scale2: 1.0 / (scale * scale).max(f32::MIN_POSITIVE) }
    }

    /// Whether the standard deviation of the node's contribution is large: equations 8 to 10 of the paper.
    fn is_split(&self, node: usize, x: &ShadingPoint, measure: &Measure) -> bool {
        let spread = &self.spreads[node];
        let (near, far) = self.distances(node, x);
        if near <= 0.0 {
            return measure.threshold > 0.0;
        }
        let (a2, b2) = (near * near * measure.inverse_scale2, far * far * measure.inverse_scale2);
        let (a, b) = (math::sqrt(a2), math::sqrt(b2));
        // Mean and variance of 1/d² for distances spread evenly over [a, b]; for b = a the limit.
        let mean = 1.0 / (a * b);
        let square = (a2 + a * b + b2) / (3.0 * a2 * a * b2 * b);
        let variance = (square - mean * mean).max(0.0);
        let total = spread.variance * variance + spread.variance * mean * mean + spread.mean * spread.mean * variance;
        let deviation = spread.count * math::sqrt(total);
        let quality = 1.0 / math::sqrt(math::sqrt(1.0 + deviation));
        quality < measure.threshold
    }

    /// Returns the least and largest distance from a point to the boxes of a node's children.
    fn distances(&self, node: usize, x: &ShadingPoint) -> (f32, f32) {
        let node = &self.nodes[node];
        let (low, high) = node.corners();
        let (mut near2, mut far2) = ([0.0; N], [0.0; N]);
        for axis in 0..3 {
            for lane in 0..N {
                let (below, above) = (low[axis][lane] - x.position[axis], x.position[axis] - high[axis][lane]);
                let near = math::at_least(if below > above { below } else { above }, 0.0);
                let far = if below.abs() > above.abs() { below } else { above };
                near2[lane] += near * near;
                far2[lane] += far * far;
            }
        }
        let width = usize::from(node.width).min(N);
        let near2 = near2[..width].iter().fold(f32::INFINITY, |a, b| a.min(*b));
        let far2 = far2[..width].iter().fold(0.0, |a: f32, b| a.max(*b));
        (math::sqrt(near2), math::sqrt(far2))
    }
}
