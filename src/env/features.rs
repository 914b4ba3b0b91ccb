//! Small bright parts of the image, taken out of what portals are guided by.
//!
//! A sun of a few texels can carry more than all the rest of the sky. Whether it is visible through a portal is a
//! matter of geometry, but an average over a cell of the portal can only guess. So the image is split, once: what its
//! brightest texels have above a cap becomes *bright features*, each with a direction and a power. The rest is capped
//! there.
//!
//! A limit that is reached never gives all features up. Of a feature that is too large, the brighter half of the
//! contrast remains; of too many features, the strongest ones. Everything else goes back into the rest.

use alloc::vec;
use alloc::vec::Vec;

use super::feature_blocks::blocks;
use super::feature_clusters::{BrightTexel, MAX_DOUBLINGS, TexelCluster, clusters};
use super::feature_texel::{FeatureTexel, from_morton, to_morton};
use super::feature_tree::{FeatureNode, feature_tree};
use super::pyramid::level_start;

/// What counts as a bright feature. None of the limits is part of the format: environments built with others load all
/// the same.
///
/// Contrast and radius are *measured* (docs/CONSTANTS.md, "Environment and bright features"): half and double of them
/// change little. The other limits are budgets, chosen and not swept.
#[derive(Clone, Copy, Debug)]
pub(super) struct FeatureLimits {
    /// Ratio of the cap to the mean of the capped image. Larger: fewer texels are features, and the trees are guided
    /// by a rest of more contrast. Smaller: larger features, which are seen in part more often.
    pub(super) contrast: f64,
    /// Largest angular radius of a feature, as a sine. Larger: whole bright clouds become features, which are seen in
    /// part from almost everywhere and cost time there. Smaller: a blurred sun stays in the rest.
    pub(super) sin_radius: f32,
    /// Least share of the flux in all features together. Larger: a faint sun stays in the rest. Smaller: features that
    /// are not worth the search for them.
    pub(super) flux_share: f64,
    /// Largest share of the image's texels in features. Larger: features that the pyramid resolves as well, as what
    /// fills this share has at most the inverse contrast. Smaller: many lamps stay in the rest.
    pub(super) image_share: f64,
    /// Most features. Larger: more memory. Smaller: of more lamps, the weaker ones stay in the rest.
    pub(super) features: usize,
    /// Most blocks of texels of a feature. Larger: a finer feature of more memory; the time grows with the square root
    /// where the feature is seen in part. Smaller: texels of different brightness share a block.
    pub(super) blocks: usize,
}

impl Default for FeatureLimits {
    fn default() -> Self {
        Self {
            contrast: 16.0,
            sin_radius: 0.15,
            flux_share: 0.001,
            image_share: 1.0 / 64.0,
            features: 4096,
            blocks: 4096,
        }
    }
}

/// Stands for no cluster.
const NO_CLUSTER: u32 = u32::MAX;

/// An image split into bright features and a capped rest.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct BrightFeatures {
    /// Least radiance at which the rest is capped anywhere; infinite without features.
    pub(super) cap: f32,
    /// Tree over all features, depth first.
    pub(super) nodes: Vec<FeatureNode>,
    /// Blocks of texels, in the order of the tree's leaves.
    pub(super) texels: Vec<FeatureTexel>,
    /// What the rest is where it is not the image: number of the texel of the finest level, row by row, and radiance.
    pub(super) rest: Vec<(u32, f32)>,
}

impl BrightFeatures {
    /// An image without features.
    pub(super) fn none() -> Self {
        Self { cap: f32::INFINITY, ..Self::default() }
    }

    /// Splits the finest level, of `2^depth` texels a side.
    pub(super) fn find(depth: u32, image: &[f32], limits: &FeatureLimits) -> Self {
        let mean = |cap: f64| image.iter().map(|&v| f64::from(v).min(cap)).sum::<f64>() / image.len() as f64;
        let flux = mean(f64::INFINITY);
        // Twice: the first cap is still raised by the features themselves.
        let mut cap = limits.contrast * mean(limits.contrast * flux);
        let most = ((limits.image_share * image.len() as f64) as usize).max(1);
        // To where the next doubling would leave room.
        for _ in 0..MAX_DOUBLINGS {
            if image.iter().filter(|&&v| f64::from(v) > 2.0 * cap).count() <= most {
                break;
            }
            cap *= 2.0;
        }
        let cap = cap as f32;
        let mut bright: Vec<BrightTexel> = (0..)
            .zip(image)
            .filter(|&(_, &v)| v > cap)
            .map(|(texel, &v): (u32, _)| (to_morton(texel & ((1 << depth) - 1), texel >> depth), v))
            .collect();
        bright.sort_unstable_by_key(|&(code, _)| code);
        let mut clusters = clusters(depth, bright.clone(), cap, limits.sin_radius);
        // The strongest remain; of equal ones the first.
        let excess = |cluster: &TexelCluster| {
            cluster.texels.iter().map(|&(_, v)| f64::from(v) - f64::from(cluster.cap)).sum::<f64>()
        };
        clusters.sort_by(|a, b| excess(b).total_cmp(&excess(a)));
        let mut room = most;
        clusters.retain(|cluster| {
            let fits = cluster.texels.len() <= room;
            room -= if fits { cluster.texels.len() } else { 0 };
            fits
        });
        clusters.truncate(limits.features);
        let found: f64 = clusters.iter().map(excess).sum();
        if clusters.is_empty() || found < limits.flux_share * flux * image.len() as f64 {
            return Self::none();
        }
        Self::from_clusters(depth, &bright, &clusters, limits)
    }

    fn from_clusters(depth: u32, bright: &[BrightTexel], clusters: &[TexelCluster], limits: &FeatureLimits) -> Self {
        let mut owners = vec![NO_CLUSTER; bright.len()];
        for (i, cluster) in (0..).zip(clusters) {
            for &(code, _) in &cluster.texels {
                owners[bright.partition_point(|&(other, _)| other < code)] = i;
            }
        }
        // A block of a feature may hold darker texels, but none that belongs to another feature or stays uncapped.
        let is_foreign = |at: usize, i: u32| {
            let owner = owners[at];
            owner != i && (owner != NO_CLUSTER || bright[at].1 > clusters[i as usize].cap)
        };
        let features = (0..)
            .zip(clusters)
            .map(|(i, cluster)| {
                blocks(depth, cluster, limits.blocks, |first, end| {
                    let start = bright.partition_point(|&(code, _)| u64::from(code) < first);
                    let stop = bright.partition_point(|&(code, _)| u64::from(code) < end);
                    (start..stop).any(|at| is_foreign(at, i))
                })
            })
            .collect();
        let (nodes, texels) = feature_tree(features);
        let mut rest: Vec<(u32, f32)> = Vec::new();
        for cluster in clusters {
            let number = |code: u32| {
                let [x, y] = from_morton(code);
                (y << depth) | x
            };
            rest.extend(cluster.texels.iter().map(|&(code, _)| (number(code), cluster.cap)));
        }
        rest.sort_unstable_by_key(|&(texel, _)| texel);
        let cap = clusters.iter().fold(f32::INFINITY, |cap, cluster| cap.min(cluster.cap));
        Self { cap, nodes, texels, rest }
    }
}

/// The finest level of all means.
pub(super) fn finest(depth: u32, means: &[f32]) -> &[f32] {
    &means[level_start(depth)..]
}
