//! Drawing directions in whole bright features, and the excess in a direction.

use glam::{Vec2, Vec3};

use super::descend::inside;
use super::feature_texel::{FeatureTexel, from_morton, to_morton};
use super::feature_tree::FeatureNode;
use super::rotation::{to_local, to_world};
use super::view::EnvironmentView;
use crate::warp::equal_area::{sphere_to_square, square_to_sphere};
use crate::warp::{Variate, pick_pair};

/// Slack of the cone around a feature for rounding, as a sine. *Proved*: covers the errors of the map (2.5e-7), of the
/// rotation, and of a plane or a direction (2e-7 each), twice over.
///
/// Larger: features are tested block by block a little more often. Smaller: a visible direction could be lost.
const FEATURE_ROUNDING: f32 = 2e-6;

impl FeatureNode {
    /// Sine of the angular radius of a cone that holds all directions of the node, however they were rounded. At least
    /// 1 for a node that may hold any direction.
    #[inline]
    pub(crate) fn reach(&self) -> f32 {
        self.sin_radius + FEATURE_ROUNDING
    }

    /// Whether the node may hold a direction of the environment's frame.
    #[inline]
    fn may_hold(&self, local: Vec3) -> bool {
        let (axis, reach) = (Vec3::from_array(self.axis), self.reach());
        reach >= 1.0 || (local.dot(axis) >= 0.0 && local.cross(axis).length_squared() <= reach * reach)
    }

    /// Whether a block is one of the node's.
    #[inline]
    pub(crate) fn holds_block(&self, block: u32) -> bool {
        (self.range[0]..self.range[1]).contains(&block)
    }
}

impl<'a> EnvironmentView<'a> {
    /// The tree over what is much brighter than the rest, depth first. Empty where nothing is.
    #[inline]
    pub(crate) fn feature_nodes(&self) -> &'a [FeatureNode] {
        self.features
    }

    /// Whether a node has no children, but blocks alone.
    #[inline]
    pub(crate) fn is_feature_leaf(&self, node: usize) -> bool {
        self.features[node].next as usize == node + 1
    }

    /// Blocks of texels below a node.
    #[inline]
    pub(crate) fn feature_texels(&self, node: usize) -> &'a [FeatureTexel] {
        let [start, end] = self.features[node].range;
        &self.feature_texels[start as usize..end as usize]
    }

    /// Draws a world direction below a node, with a density in proportion to its excess over the cap.
    pub(crate) fn sample_feature(&self, mut node: usize, mut u: [Variate; 2]) -> Vec3 {
        while !self.is_feature_leaf(node) {
            let children = [node + 1, self.features[node + 1].next as usize];
            node = children[pick_pair(children.map(|child| self.features[child].power), &mut u[1])];
        }
        let blocks = self.feature_texels(node);
        let target = u[1].value() * blocks.iter().map(|block| f64::from(block.power())).sum::<f64>();
        let (mut chosen, mut low, mut width, mut below) = (&blocks[0], 0.0, 1.0, 0.0);
        for block in blocks {
            let power = f64::from(block.power());
            if power > 0.0 {
                (chosen, low, width) = (block, below, power);
                below += power;
                if target < below {
                    break;
                }
            }
        }
        u[1].stretch(target - low, width, 1.0);
        self.direction_in_texel(chosen, u.map(|u| u.value_f32() - 0.5))
    }

    /// World direction of a point in a block, in units of the block's side around the center.
    pub(crate) fn direction_in_texel(&self, block: &FeatureTexel, point: [f32; 2]) -> Vec3 {
        let [x, y] = from_morton(block.code);
        let level = block.level;
        let point = Vec2::new(inside(level, x, point[0] + 0.5), inside(level, y, point[1] + 0.5));
        to_world(&self.header.rotation, square_to_sphere(point))
    }

    /// Returns the block that a unit world direction falls into: its number and its excess over the cap.
    #[inline]
    pub(crate) fn feature_at(&self, direction: Vec3) -> Option<(u32, f32)> {
        let local = to_local(&self.header.rotation, direction);
        // Most directions are far from everything.
        if !self.features.first()?.may_hold(local) {
            return None;
        }
        let scale = (1_u32 << self.header.depth) as f32;
        let last = (1 << self.header.depth) - 1;
        let point = sphere_to_square(local) * scale;
        let code = to_morton((point.x as u32).min(last), (point.y as u32).min(last));
        let block = self.block_at(local, code)?;
        Some((block as u32, self.feature_texels[block].excess))
    }

    /// Index of the block that holds a texel of the finest level. `local` is a direction in the texel.
    fn block_at(&self, local: Vec3, code: u32) -> Option<usize> {
        let depth = self.header.depth;
        let mut node = 0;
        while let Some(found) = self.features.get(node) {
            if !found.may_hold(local) {
                node = found.next as usize;
                continue;
            }
            if found.is_single == 0 {
                node += 1;
                continue;
            }
            let [start, end] = found.range.map(|at| at as usize);
            let blocks = &self.feature_texels[start..end];
            let after = blocks.partition_point(|block| block.codes(depth).0 <= code);
            if after > 0 {
                let (first, count) = blocks[after - 1].codes(depth);
                if code - first < count {
                    return Some(start + after - 1);
                }
            }
            node = found.next as usize;
        }
        None
    }

    /// Returns what remains of a texel of the finest level without the features.
    pub(super) fn rest_of(&self, x: u32, y: u32, radiance: f32) -> f32 {
        if radiance <= self.header.cap {
            return radiance;
        }
        let side = 1.0 / (1_u32 << self.header.depth) as f32;
        let local = square_to_sphere(Vec2::new(x as f32 + 0.5, y as f32 + 0.5) * side);
        let block = self.block_at(local, to_morton(x, y));
        block.map_or(radiance, |block| radiance.min(self.feature_texels[block].cap))
    }

    /// World direction of a node's center.
    #[inline]
    pub(crate) fn feature_axis(&self, node: usize) -> Vec3 {
        to_world(&self.header.rotation, Vec3::from_array(self.features[node].axis))
    }

    /// Direction in the environment's frame of a world direction.
    #[inline]
    pub(crate) fn local_direction(&self, direction: Vec3) -> Vec3 {
        to_local(&self.header.rotation, direction)
    }
}
