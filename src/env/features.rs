//! Small bright parts of the image, taken out of what portals are guided by.
//!
//! A sun of a few texels can carry more than all the rest of the sky. Whether it is visible through a portal is a
//! matter of geometry, but an average over a cell of the portal can only guess. So the image is split, once: what its
//! brightest texels have above a cap becomes *bright features*, each with a direction and a power. The rest is capped,
//! and its contrast is bounded.

use alloc::vec;
use alloc::vec::Vec;

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

use super::feature_texel::FeatureTexel;
use super::pyramid::level_start;
use crate::warp::equal_area::{SPHERE, square_to_sphere, wrap_texel_log2};

/// Most bright features of an environment. *Format*: bytes with more are refused, and lists of a fixed length rely on
/// it.
///
/// Larger: more of the image is followed exactly, but each feature costs every shading point a walk down the tree over
/// triangles, even where it is hidden.
pub(crate) const MAX_FEATURES: usize = 8;

/// Most doublings of the cap until the image counts as one without features. *Proved* to be enough wherever the mean
/// of the capped image is at least 2^-40 of the brightest texel: nothing is above the cap then.
///
/// Larger: a longer search in images of even more contrast. Smaller: their features may be missed.
const MAX_DOUBLINGS: u32 = 40;

/// What counts as a bright feature. None of the limits is part of the format: environments built with others load all
/// the same.
///
/// The defaults are *measured* on the scenes with windows of the bench `quality`. With half and with double the
/// contrast the variance where the sun is visible changes by at most a fifth. Half and double of each other limit
/// give the same features there, and so the same variance.
#[derive(Clone, Copy, Debug)]
pub(super) struct FeatureLimits {
    /// Ratio of the cap to the mean of the capped image. Larger: fewer texels are features, and the trees are guided
    /// by a rest of more contrast. Smaller: larger features, which are refused sooner.
    pub(super) contrast: f64,
    /// Largest angular radius of a feature, as a sine. Larger: whole bright clouds become features, which are seen in
    /// part from almost everywhere and cost time there. Smaller: a blurred sun stays in the rest.
    pub(super) sin_radius: f32,
    /// Least share of the flux above the cap. Larger: a faint sun stays in the rest. Smaller: features that are not
    /// worth the walk down the tree.
    pub(super) flux_share: f64,
    /// Largest share of the image's texels in features. Larger: features that the pyramid resolves as well. Smaller:
    /// the cap rises sooner, and less of the flux is in features.
    pub(super) image_share: f64,
    /// Most features, at most [`MAX_FEATURES`].
    pub(super) features: usize,
    /// Most texels of a feature after merging. Larger: a finer feature, but a shading point that sees it in part pays
    /// for every texel. Smaller: texels with larger margins, so that more directions miss the opening; at 16 the
    /// variance where the sun is visible is 0.6 instead of 0.003.
    pub(super) texels: usize,
}

impl Default for FeatureLimits {
    fn default() -> Self {
        Self {
            contrast: 16.0,
            sin_radius: 0.15,
            flux_share: 0.01,
            image_share: 1.0 / 256.0,
            features: MAX_FEATURES,
            texels: 256,
        }
    }
}

/// A cluster of bright texels.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct BrightFeature {
    /// Unit direction of the center, in the environment's frame.
    pub(crate) axis: [f32; 3],
    /// Sine of the angular radius of a cone around the center that holds all texels.
    pub(crate) sin_radius: f32,
    /// Excess over the cap, integrated over solid angle.
    pub(crate) power: f32,
    /// Start and end of the feature's texels in the list of all.
    pub(crate) range: [u32; 2],
    /// Base-2 logarithm of the number of texels a side of the image that the feature's texels belong to.
    pub(crate) level: u32,
}

const _: () = assert!(size_of::<BrightFeature>() == 32);

/// An image split into bright features and a capped rest.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct BrightFeatures {
    /// Radiance at which the rest is capped; infinite without features.
    pub(super) cap: f32,
    /// Features, in the order of their first texels.
    pub(super) features: Vec<BrightFeature>,
    /// Texels of all features, one feature after the other.
    pub(super) texels: Vec<FeatureTexel>,
}

impl BrightFeatures {
    /// An image without features.
    pub(super) fn none() -> Self {
        Self { cap: f32::INFINITY, features: Vec::new(), texels: Vec::new() }
    }

    /// Splits the finest level, of `2^depth` texels a side.
    pub(super) fn find(depth: u32, image: &[f32], limits: &FeatureLimits) -> Self {
        let mean = |cap: f64| image.iter().map(|&v| f64::from(v).min(cap)).sum::<f64>() / image.len() as f64;
        let flux = mean(f64::INFINITY);
        // Twice: the first cap is still raised by the features themselves.
        let mut cap = limits.contrast * mean(limits.contrast * flux);
        for _ in 0..MAX_DOUBLINGS {
            let bright: Vec<u32> =
                (0..).zip(image).filter(|&(_, &v)| f64::from(v) > cap).map(|(texel, _)| texel).collect();
            if bright.is_empty() || flux - mean(cap) < limits.flux_share * flux {
                break;
            }
            let few = bright.len() as f64 <= limits.image_share * image.len() as f64;
            let found = if few { Self::gather(depth, image, &bright, cap as f32, limits) } else { None };
            if let Some(features) = found {
                return features;
            }
            cap *= 2.0;
        }
        Self::none()
    }

    /// Groups neighboring bright texels. `None` if there are too many groups, or if one is too large.
    fn gather(depth: u32, image: &[f32], bright: &[u32], cap: f32, limits: &FeatureLimits) -> Option<Self> {
        let mut found = Self { cap, features: Vec::new(), texels: Vec::new() };
        let mut taken = vec![false; bright.len()];
        for start in 0..bright.len() {
            if taken[start] {
                continue;
            }
            if found.features.len() == limits.features.min(MAX_FEATURES) {
                return None;
            }
            let mut group = cluster(depth, bright, &mut taken, start);
            group.sort_unstable();
            let feature = found.add(depth, image, &group, limits.texels);
            if feature.sin_radius > limits.sin_radius || feature.power <= 0.0 {
                return None;
            }
            found.features.push(feature);
        }
        Some(found)
    }

    /// Appends the texels of one feature, merged to at most `most`.
    fn add(&mut self, depth: u32, image: &[f32], group: &[u32], most: usize) -> BrightFeature {
        let excess = |texel: u32| f64::from(image[texel as usize]) - f64::from(self.cap);
        let total: f64 = group.iter().map(|&texel| excess(texel)).sum();
        let start = self.texels.len() as u32;
        let (level, blocks) = blocks(depth, group.iter().map(|&texel| (texel, excess(texel))).collect(), most);
        let texels_a_block = f64::from(1_u32 << (2 * (depth - level)));
        let mut sum = 0.0;
        for (block, power) in blocks {
            sum += power;
            let texel = FeatureTexel::new(level, block, (power / texels_a_block) as f32);
            self.texels.push(FeatureTexel { sum: (sum / total).min(1.0) as f32, ..texel });
        }
        if let Some(last) = self.texels.last_mut() {
            last.sum = 1.0;
        }
        let axis = group.iter().map(|&t| center(depth, t) * excess(t) as f32).sum::<Vec3>().normalize_or(Vec3::Z);
        // A texel reaches at most its diagonal beyond its center: √2 / 2^depth of the square, 3 radians of it.
        let texel_radius = 3.0 * core::f32::consts::SQRT_2 / (1_u32 << level) as f32;
        let sin = group.iter().fold(0.0, |sin: f32, &t| sin.max(axis.cross(center(depth, t)).length()));
        let power = total * f64::from(SPHERE) / image.len() as f64;
        BrightFeature {
            axis: axis.to_array(),
            sin_radius: sin + texel_radius,
            power: power as f32,
            range: [start, self.texels.len() as u32],
            level,
        }
    }
}

/// Merges four texels into one, again and again, until there are at most `most`. Returns the level of the texels, and
/// the texels sorted by number.
fn blocks(depth: u32, mut texels: Vec<(u32, f64)>, most: usize) -> (u32, Vec<(u32, f64)>) {
    let mut level = depth;
    while texels.len() > most.max(1) {
        let parent = |texel: u32| ((texel >> (level + 1)) << (level - 1)) | ((texel & ((1 << level) - 1)) >> 1);
        texels = texels.into_iter().map(|(texel, power)| (parent(texel), power)).collect();
        texels.sort_by_key(|&(texel, _)| texel);
        texels.dedup_by(|(texel, power), (kept, sum)| {
            let same = texel == kept;
            if same {
                *sum += *power;
            }
            same
        });
        level -= 1;
    }
    (level, texels)
}

/// All bright texels that are connected to one of them, over edges or corners.
fn cluster(depth: u32, bright: &[u32], taken: &mut [bool], start: usize) -> Vec<u32> {
    taken[start] = true;
    let mut open = vec![start];
    let mut group = Vec::new();
    while let Some(at) = open.pop() {
        let texel = bright[at];
        group.push(texel);
        let (x, y) = ((texel & ((1 << depth) - 1)) as i32, (texel >> depth) as i32);
        for (dx, dy) in [(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)] {
            let (i, j) = wrap_texel_log2(x + dx, y + dy, depth);
            let neighbor = bright.binary_search(&((j << depth) | i));
            if let Some(next) = neighbor.ok().filter(|next| !taken[*next]) {
                taken[next] = true;
                open.push(next);
            }
        }
    }
    group
}

/// Direction of a texel's center.
fn center(depth: u32, texel: u32) -> Vec3 {
    let side = 1.0 / (1_u32 << depth) as f32;
    let (x, y) = (texel & ((1 << depth) - 1), texel >> depth);
    square_to_sphere(Vec2::new(x as f32 + 0.5, y as f32 + 0.5) * side)
}

/// The finest level of all means.
pub(super) fn finest(depth: u32, means: &[f32]) -> &[f32] {
    &means[level_start(depth)..]
}
