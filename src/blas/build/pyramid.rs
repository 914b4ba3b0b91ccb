//! Minimum, maximum and mean of an image over ever larger blocks.

use alloc::vec::Vec;

use crate::blas::build::texture::Texture;
use crate::parallel::{self, WORTHWHILE};

/// Bytes for edges between the few large texels of a small image. All its triangles share it: the first ones take what
/// they need. A budget: images of fewer than 2^17 texels have sharper edges with more.
pub(super) const BYTES_PER_IMAGE: f64 = (1 << 18) as f64;

/// Bytes for each texel of an image, for edges between openings so narrow that samples go astray without them. All
/// triangles of the image share them, each by the texels that it covers. A budget: a grid of 100 x 100 openings on
/// 400² texels takes all of it; images with fewer edges, and noise, take nothing (docs/ACCURACY.md, "Memory of textures").
const RESCUE_BYTES_PER_TEXEL: f64 = 64.0;

/// Most bytes for such edges. A budget: it bounds what one large image can take.
const RESCUE_BYTES: f64 = (3 << 22) as f64;

/// Returns the bytes that all triangles of an image may take for such edges.
pub(super) fn rescue_bytes(texture: &Texture<'_>) -> f64 {
    (RESCUE_BYTES_PER_TEXEL * texture.texels() as f64).min(RESCUE_BYTES)
}

/// What is known of a block of texels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TexelBlock {
    /// The darkest texel.
    pub(crate) min: f32,
    /// The brightest texel.
    pub(crate) max: f32,
    /// The mean of the texels that exist (blocks at the far edges may be cut off).
    pub(crate) mean: f32,
}

/// One texture with its pyramid. Level `l` has blocks of `2^l` texels to a side; level 0 is the image itself.
#[derive(Clone, Debug)]
pub(crate) struct TexturePyramid<'a> {
    texture: Texture<'a>,
    /// From level 1 up to the one that is a single block.
    levels: Vec<PyramidLevel>,
    /// What is left of the image's memory.
    pub(super) memory: ImageMemory,
}

/// What trees over an image may still take.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct ImageMemory {
    /// Bytes beyond two a texel.
    pub(super) extra: f64,
    /// Bytes that triangles before have left of what they could have taken: later ones may have them.
    pub(super) saved: f64,
    /// Bytes that triangles of this batch have left, for the next batch.
    pub(super) saved_now: f64,
    /// Bytes for edges without which samples go astray.
    pub(super) rescue: f64,
}

#[derive(Clone, Debug)]
struct PyramidLevel {
    size: [u32; 2],
    blocks: Vec<TexelBlock>,
}

impl<'a> TexturePyramid<'a> {
    /// Builds the pyramid: 12 bytes for every third texel, about.
    pub(crate) fn new(texture: Texture<'a>) -> Self {
        let memory = ImageMemory { extra: BYTES_PER_IMAGE, rescue: rescue_bytes(&texture), ..ImageMemory::default() };
        let mut pyramid = Self { texture, levels: Vec::new(), memory };
        let mut size = texture.size();
        while size != [1, 1] {
            let below = pyramid.levels.len() as u32;
            let [w, h] = size.map(|n| n.div_ceil(2));
            let mut blocks = alloc::vec![TexelBlock { min: 0.0, max: 0.0, mean: 0.0 }; w as usize * h as usize];
            // Rows at once that are worth handing to another thread.
            let rows = (WORTHWHILE / w as usize).max(1);
            parallel::for_each_chunk(&mut blocks, rows * w as usize, |chunk, blocks| {
                for (row, blocks) in blocks.chunks_exact_mut(w as usize).enumerate() {
                    for (x, block) in (0..).zip(blocks) {
                        *block = pyramid.merge(below, x, (chunk * rows + row) as u32, size);
                    }
                }
            });
            size = [w, h];
            pyramid.levels.push(PyramidLevel { size, blocks });
        }
        pyramid
    }

    /// The block above up to four blocks of the level `below`, which has `size` blocks.
    fn merge(&self, below: u32, x: u32, y: u32, size: [u32; 2]) -> TexelBlock {
        let [w, h] = self.texture.size();
        let texels_along = |i: u32, n: u32| f64::from((n - (i << below)).min(1 << below));
        let (mut min, mut max) = (f32::INFINITY, 0.0f32);
        let (mut sum, mut count) = (0.0, 0.0);
        for j in 2 * y..(2 * y + 2).min(size[1]) {
            for i in 2 * x..(2 * x + 2).min(size[0]) {
                let block = self.block(below, i, j);
                min = min.min(block.min);
                max = max.max(block.max);
                let texels = texels_along(i, w) * texels_along(j, h);
                sum += f64::from(block.mean) * texels;
                count += texels;
            }
        }
        TexelBlock { min, max, mean: (sum / count) as f32 }
    }

    /// The texture itself.
    pub(crate) fn texture(&self) -> &Texture<'a> {
        &self.texture
    }

    /// A block of a level from 0 to [`Self::top`].
    pub(crate) fn block(&self, level: u32, x: u32, y: u32) -> TexelBlock {
        if level == 0 {
            let value = self.texture.texel(x, y);
            TexelBlock { min: value, max: value, mean: value }
        } else {
            let level = &self.levels[level as usize - 1];
            level.blocks[y as usize * level.size[0] as usize + x as usize]
        }
    }

    /// The level that is a single block.
    pub(crate) fn top(&self) -> u32 {
        self.levels.len() as u32
    }

    /// The whole image.
    pub(crate) fn whole(&self) -> TexelBlock {
        self.block(self.top(), 0, 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Pcg32;

    #[test]
    fn whole_image_of_any_size() {
        let mut rng = Pcg32::new(1, 1);
        for (w, h) in [(1, 1), (1, 37), (5, 3), (64, 64), (33, 7)] {
            let texels: Vec<f32> = (0..w * h).map(|_| rng.next_f32()).collect();
            let pyramid = TexturePyramid::new(Texture::new(w, h, &texels).unwrap());
            let whole = pyramid.whole();
            let mean = texels.iter().map(|&t| f64::from(t)).sum::<f64>() / texels.len() as f64;
            assert_eq!(whole.min, texels.iter().copied().fold(f32::INFINITY, f32::min));
            assert_eq!(whole.max, texels.iter().copied().fold(0.0, f32::max));
            assert!((f64::from(whole.mean) / mean - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn the_largest_values_do_not_overflow() {
        let texels = [f32::MAX; 16];
        assert_eq!(TexturePyramid::new(Texture::new(4, 4, &texels).unwrap()).whole().mean, f32::MAX);
    }
}
