//! Small bright parts of the image, taken out of what portals are guided by.
//!
//! A sun of a few texels can carry more than all the rest of the sky. Whether it is seen through a portal is a matter
//! of geometry, but an average over a cell of the portal can only guess. So the image is split, once: its brightest
//! texels, up to the excess over a cap, become *suns*, each with a direction and a power; the rest is capped, and its
//! contrast is bounded.

use alloc::vec;
use alloc::vec::Vec;

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

use super::pyramid::level_start;
use super::texel::SunTexel;
use crate::warp::equal_area::{SPHERE, square_to_sphere, wrap_texel_log2};

/// Most suns of an environment: each costs every shading point a walk down the tree over portals.
pub(crate) const MAX_SUNS: usize = 8;

/// A texel this many times brighter than the mean of the capped image belongs to a sun.
const CONTRAST: f64 = 16.0;
/// Largest angular radius of a sun, as a sine. What is larger is no detail.
const LARGEST: f32 = 0.15;
/// A split that takes out less than this share of the flux is not worth its walk.
const LEAST_SHARE: f64 = 0.01;
/// Most texels in suns, as a share of the image.
const MOST_TEXELS: usize = 256;

/// Most texels of a sun, after merging: they bound what a shading point costs where a sun is seen in part.
const MOST_BLOCKS: usize = 256;

/// A cluster of bright texels.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Sun {
    /// Unit direction of the centre, in the environment's frame.
    pub axis: [f32; 3],
    /// Sine of the angular radius of a cone around the centre that holds all texels.
    pub sin_radius: f32,
    /// Excess over the cap, integrated over solid angle.
    pub power: f32,
    /// Where its texels start and end in the list of all.
    pub range: [u32; 2],
    /// Its texels are those of an image of `2^level` texels a side.
    pub level: u32,
}

/// An image split into suns and a capped rest.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Suns {
    /// Radiance at which the rest is capped; infinite without suns.
    pub(super) cap: f32,
    pub(super) suns: Vec<Sun>,
    pub(super) texels: Vec<SunTexel>,
}

impl Suns {
    /// An image without suns.
    pub(super) fn none() -> Self {
        Self { cap: f32::INFINITY, suns: Vec::new(), texels: Vec::new() }
    }

    /// Splits the finest level, of `2^depth` texels a side.
    pub(super) fn find(depth: u32, image: &[f32]) -> Self {
        let mean = |cap: f64| image.iter().map(|&v| f64::from(v).min(cap)).sum::<f64>() / image.len() as f64;
        let flux = mean(f64::INFINITY);
        // Twice: the first cap is still raised by the suns themselves.
        let mut cap = CONTRAST * mean(CONTRAST * flux);
        for _ in 0..40 {
            let bright: Vec<u32> =
                (0..).zip(image).filter(|&(_, &v)| f64::from(v) > cap).map(|(texel, _)| texel).collect();
            if bright.is_empty() || flux - mean(cap) < LEAST_SHARE * flux {
                break;
            }
            if bright.len() * MOST_TEXELS <= image.len()
                && let Some(suns) = Self::gather(depth, image, &bright, cap as f32)
            {
                return suns;
            }
            cap *= 2.0;
        }
        Self::none()
    }

    /// Groups neighbouring bright texels. `None` if there are too many groups, or one is too large.
    fn gather(depth: u32, image: &[f32], bright: &[u32], cap: f32) -> Option<Self> {
        let mut found = Self { cap, suns: Vec::new(), texels: Vec::new() };
        let mut taken = vec![false; bright.len()];
        for start in 0..bright.len() {
            if taken[start] {
                continue;
            }
            if found.suns.len() == MAX_SUNS {
                return None;
            }
            let mut group = cluster(depth, bright, &mut taken, start);
            group.sort_unstable();
            let sun = found.add(depth, image, &group);
            if sun.sin_radius > LARGEST || sun.power <= 0.0 {
                return None;
            }
            found.suns.push(sun);
        }
        Some(found)
    }

    /// Appends the texels of one sun.
    fn add(&mut self, depth: u32, image: &[f32], group: &[u32]) -> Sun {
        let excess = |texel: u32| f64::from(image[texel as usize]) - f64::from(self.cap);
        let total: f64 = group.iter().map(|&texel| excess(texel)).sum();
        let start = self.texels.len() as u32;
        let (level, blocks) = blocks(depth, group.iter().map(|&texel| (texel, excess(texel))).collect());
        let texels_a_block = f64::from(1_u32 << (2 * (depth - level)));
        let mut sum = 0.0;
        for (block, power) in blocks {
            sum += power;
            let texel = SunTexel::new(level, block, (power / texels_a_block) as f32);
            self.texels.push(SunTexel { sum: (sum / total).min(1.0) as f32, ..texel });
        }
        if let Some(last) = self.texels.last_mut() {
            last.sum = 1.0;
        }
        let axis = group.iter().map(|&t| center(depth, t) * excess(t) as f32).sum::<Vec3>().normalize_or(Vec3::Z);
        // A texel reaches at most its diagonal beyond its centre: √2 / 2^depth of the square, 3 radians of it.
        let texel_radius = 3.0 * core::f32::consts::SQRT_2 / (1_u32 << level) as f32;
        let sin = group.iter().fold(0.0, |sin: f32, &t| sin.max(axis.cross(center(depth, t)).length()));
        let power = total * f64::from(SPHERE) / image.len() as f64;
        Sun {
            axis: axis.to_array(),
            sin_radius: sin + texel_radius,
            power: power as f32,
            range: [start, self.texels.len() as u32],
            level,
        }
    }
}

/// Merges four texels into one, over and over, until there are few enough. They stay sorted by number.
fn blocks(depth: u32, mut texels: Vec<(u32, f64)>) -> (u32, Vec<(u32, f64)>) {
    let mut level = depth;
    while texels.len() > MOST_BLOCKS {
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

/// All bright texels that hang together with one of them, corners included.
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
            if let Ok(next) = bright.binary_search(&((j << depth) | i))
                && !taken[next]
            {
                taken[next] = true;
                open.push(next);
            }
        }
    }
    group
}

/// Direction of a texel's centre.
fn center(depth: u32, texel: u32) -> Vec3 {
    let side = 1.0 / (1_u32 << depth) as f32;
    let (x, y) = (texel & ((1 << depth) - 1), texel >> depth);
    square_to_sphere(Vec2::new(x as f32 + 0.5, y as f32 + 0.5) * side)
}

/// The finest level of all means.
pub(super) fn finest(depth: u32, means: &[f32]) -> &[f32] {
    &means[level_start(depth)..]
}
