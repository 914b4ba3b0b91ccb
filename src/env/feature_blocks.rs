//! The texels of a bright feature in blocks: a cut through the quadtree over them, fine where the feature has contrast.

use alloc::collections::BinaryHeap;
use alloc::vec::Vec;
use core::cmp::Ordering;

use super::feature_clusters::{TexelCluster, radius};
use super::feature_texel::FeatureTexel;

/// Relative variance within the blocks of a feature up to which they stay as they are. Chosen on captured suns, not
/// swept.
///
/// Larger: fewer blocks. Smaller: more of them, and the variance at points that see the whole feature falls with it.
const BLOCK_VARIANCE: f64 = 0.004;

/// Largest radius of a block over that of the feature. Chosen on the window's sun, not swept.
///
/// Larger: where an opening cuts the feature, more of the block next to the edge is bent. Smaller: more blocks.
const BLOCK_REACH: f32 = 0.3;

/// Largest margin of a block over the radius of the feature, unless it is a single texel. Chosen on the window's sun,
/// not swept.
///
/// Larger: more directions that miss the opening at its edges. Smaller: more blocks.
const BLOCK_MARGIN: f32 = 0.002;

/// A cell of the quadtree, with the feature's texels in it.
#[derive(Clone, Copy, Debug)]
struct Block {
    level: u32,
    code: u32,
    start: usize,
    end: usize,
    /// Variance that the block adds, relative to the mean of the block.
    key: f64,
}

impl PartialEq for Block {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Block {}

impl PartialOrd for Block {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Block {
    fn cmp(&self, other: &Self) -> Ordering {
        self.key.total_cmp(&other.key).then(other.start.cmp(&self.start))
    }
}

/// Cuts a cluster of texels into at most `most` blocks, sorted by code. There are more only where a block would bend
/// too much, or hold what does not belong to the cluster: `is_foreign` tells of a range of codes.
pub(super) fn blocks(
    depth: u32,
    cluster: &TexelCluster,
    most: usize,
    is_foreign: impl Fn(u64, u64) -> bool,
) -> Vec<FeatureTexel> {
    let texels = &cluster.texels;
    let cap = f64::from(cluster.cap);
    let excess = |block: &Block| texels[block.start..block.end].iter().map(|&(_, v)| f64::from(v) - cap);
    // The texels that are not the feature's count as if they were at the cap.
    let sums = |block: &Block| {
        let count = (1_u64 << (2 * (depth - block.level))) as f64;
        let (sum, squares) = excess(block).fold((0.0, 0.0), |(sum, squares), e| (sum + e, squares + e * e));
        let all = count * cap + sum;
        (all, (count * (count * cap * cap + 2.0 * cap * sum + squares) / all - all).max(0.0), sum / count)
    };
    let build = |block: &Block| FeatureTexel::new(block.level, block.code, sums(block).2 as f32, cluster.cap);
    let is_alone = |block: &Block| {
        let shift = 2 * (depth - block.level);
        !is_foreign(u64::from(block.code) << shift, (u64::from(block.code) + 1) << shift)
    };
    let children = |block: &Block| {
        let mut start = block.start;
        let shift = 2 * (depth - block.level - 1);
        let mut children = Vec::new();
        for code in 4 * block.code..4 * block.code + 4 {
            let end = start + texels[start..block.end].partition_point(|&(texel, _)| texel >> shift <= code);
            if end > start {
                let mut child = Block { level: block.level + 1, code, start, end, key: 0.0 };
                child.key = sums(&child).1;
                children.push(child);
            }
            start = end;
        }
        children
    };
    let whole = Block { level: 0, code: 0, start: 0, end: texels.len(), key: 0.0 };
    let total: f64 = texels.iter().map(|&(_, v)| f64::from(v)).sum();
    // What has to be divided whatever it costs.
    let radius = radius(depth, texels);
    let (mut open, mut heap, mut finest) = (Vec::from([whole]), BinaryHeap::new(), Vec::new());
    while let Some(block) = open.pop() {
        if block.level == depth {
            finest.push(block);
            continue;
        }
        let size = 3.0 / (1_u32 << block.level) as f32;
        let is_fit =
            size <= 2.0 * BLOCK_REACH * radius && is_alone(&block) && { build(&block).margin <= BLOCK_MARGIN * radius };
        if is_fit {
            heap.push(block);
        } else {
            open.extend(children(&block));
        }
    }
    // What may be.
    let mut variance: f64 = heap.iter().map(|block| block.key).sum();
    while heap.len() + finest.len() < most && variance > BLOCK_VARIANCE * total {
        let Some(block) = heap.pop() else { break };
        variance -= block.key;
        for child in children(&block) {
            if child.level == depth {
                finest.push(child);
            } else {
                variance += child.key;
                heap.push(child);
            }
        }
    }
    let mut all: Vec<Block> = heap.into_iter().chain(finest).collect();
    all.sort_unstable_by_key(|block| block.start);
    all.iter().map(build).collect()
}
