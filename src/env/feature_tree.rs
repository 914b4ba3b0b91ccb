//! A tree over all bright features and their blocks, by cones of directions.
//!
//! The nodes are stored depth first: a node's first child follows the node, and the node says where the next one begins
//! that is not below it. Walks need no stack.

use alloc::vec::Vec;

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::feature_texel::FeatureTexel;
use crate::math;

/// Most blocks of a leaf. Chosen by the bench `instructions`, not swept.
///
/// Larger: fewer nodes, and more blocks that are looked at one by one. Smaller: the reverse.
const LEAF_BLOCKS: usize = 4;

/// Factor on radii of blocks, which are chords. *Proved*: an angle below 1.2 is at most this times its chord.
const CHORD: f32 = 1.07;

/// A node: several features, one of them, or a part of one.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct FeatureNode {
    /// Unit direction of the center, in the environment's frame.
    pub(crate) axis: [f32; 3],
    /// Sine of the angular radius of a cone around the center that holds all blocks. 1: all directions.
    pub(crate) sin_radius: f32,
    /// Sine of the angular radius of the disk of even radiance that is spread as far around the center.
    pub(crate) sin_spread: f32,
    /// Excess over the cap, integrated over solid angle.
    pub(crate) power: f32,
    /// Start and end of the blocks in the list of all.
    pub(crate) range: [u32; 2],
    /// Index of the next node that is not below this one.
    pub(crate) next: u32,
    /// 1 for a feature or a part of one, 0 for several features.
    pub(crate) is_single: u32,
}

const _: () = assert!(size_of::<FeatureNode>() == 40);

/// Builds the tree from the blocks of each feature. Returns it with the blocks in its order.
pub(super) fn feature_tree(features: Vec<Vec<FeatureTexel>>) -> (Vec<FeatureNode>, Vec<FeatureTexel>) {
    let mut features: Vec<(Vec3, Vec<FeatureTexel>)> =
        features.into_iter().map(|blocks| (weighted_center(&blocks), blocks)).collect();
    let mut tree = Tree { nodes: Vec::new(), texels: Vec::new() };
    if !features.is_empty() {
        tree.add_features(&mut features);
    }
    (tree.nodes, tree.texels)
}

/// Center of blocks by their powers.
fn weighted_center(blocks: &[FeatureTexel]) -> Vec3 {
    let largest = blocks.iter().fold(f32::MIN_POSITIVE, |largest, block| largest.max(block.power()));
    let sum: Vec3 = blocks.iter().map(|block| Vec3::from_array(block.center) * (block.power() / largest)).sum();
    sum.normalize_or(Vec3::Z)
}

struct Tree {
    nodes: Vec<FeatureNode>,
    texels: Vec<FeatureTexel>,
}

impl Tree {
    fn add_features(&mut self, features: &mut [(Vec3, Vec<FeatureTexel>)]) {
        if let [(axis, blocks)] = features {
            let start = self.texels.len();
            self.texels.extend_from_slice(blocks);
            self.add_blocks(start, Some(*axis));
            return;
        }
        let node = self.open(0);
        let (low, high) = bounds(features.iter().map(|(center, _)| *center));
        let axis = (high - low).max_position();
        let middle = 0.5 * (low + high)[axis];
        features.sort_by(|(a, _), (b, _)| a[axis].total_cmp(&b[axis]));
        let split = features.partition_point(|(center, _)| center[axis] < middle);
        let split = if split == 0 || split == features.len() { features.len() / 2 } else { split };
        let (first, second) = features.split_at_mut(split);
        self.add_features(first);
        self.add_features(second);
        self.close(node, None);
    }

    /// Adds the tree over the last blocks, from `start` on, which are sorted by code.
    fn add_blocks(&mut self, start: usize, axis: Option<Vec3>) {
        let end = self.texels.len();
        self.add_range(start, end, axis);
    }

    fn add_range(&mut self, start: usize, end: usize, axis: Option<Vec3>) {
        let node = self.open(1);
        self.nodes[node].range = [start as u32, end as u32];
        if end - start > LEAF_BLOCKS {
            let split = self.split(start, end);
            self.add_range(start, split, None);
            self.add_range(split, end, None);
        }
        self.close(node, axis);
    }

    /// Where the blocks of the other half of the smallest cell of the quadtree begin that holds all.
    fn split(&self, start: usize, end: usize) -> usize {
        let code = |i: usize| self.texels[i].codes(super::MAX_PYRAMID_DEPTH).0;
        let differing = code(start) ^ code(end - 1);
        let bit = 31 - differing.max(1).leading_zeros();
        let upper = (code(end - 1) >> bit) << bit;
        let split =
            start + self.texels[start..end].partition_point(|block| block.codes(super::MAX_PYRAMID_DEPTH).0 < upper);
        if split == start || split == end { start.midpoint(end) } else { split }
    }

    fn open(&mut self, is_single: u32) -> usize {
        let start = self.texels.len() as u32;
        self.nodes.push(FeatureNode { range: [start, start], is_single, ..Zeroable::zeroed() });
        self.nodes.len() - 1
    }

    /// Completes a node of which everything below is there.
    fn close(&mut self, node: usize, axis: Option<Vec3>) {
        let next = self.nodes.len();
        let is_leaf = next == node + 1;
        let second = if is_leaf { node } else { self.nodes[node + 1].next as usize };
        let [start, _] = self.nodes[node].range;
        let end = if is_leaf { self.nodes[node].range[1] } else { self.nodes[second].range[1] };
        let blocks = &self.texels[start as usize..end as usize];
        let power = if is_leaf {
            blocks.iter().map(FeatureTexel::power).sum()
        } else {
            self.nodes[node + 1].power + self.nodes[second].power
        };
        let axis = axis.unwrap_or_else(|| {
            let (low, high) = bounds(blocks.iter().map(|block| Vec3::from_array(block.center)));
            (low + high).normalize_or(Vec3::Z)
        });
        let sin_radius = blocks.iter().fold(0.0, |sin: f32, block| {
            let center = Vec3::from_array(block.center);
            let reach = axis.cross(center).length() + CHORD * block.radius;
            // Beyond 72 degrees sines say little, and beyond a right angle nothing.
            sin.max(if axis.dot(center) > 0.3 && reach < 0.95 { reach } else { 1.0 })
        });
        let sin_spread = spread(axis, blocks, power).min(sin_radius);
        let (axis, range, next) = (axis.to_array(), [start, end], next as u32);
        let node = &mut self.nodes[node];
        *node = FeatureNode { axis, sin_radius, sin_spread, power, range, next, ..*node };
    }
}

/// Returns the sine of the radius of the disk with the blocks' mean square distance from an axis: that of a disk is
/// half of its radius squared. A block adds a third of its half diagonal squared.
fn spread(axis: Vec3, blocks: &[FeatureTexel], power: f32) -> f32 {
    let square = |block: &FeatureTexel| {
        let own = block.radius * block.radius / 3.0;
        block.power() / power * (axis.cross(Vec3::from_array(block.center)).length_squared() + own)
    };
    math::sqrt(2.0 * blocks.iter().map(square).sum::<f32>())
}

fn bounds(points: impl Iterator<Item = Vec3>) -> (Vec3, Vec3) {
    points.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), point| (low.min(point), high.max(point)))
}
