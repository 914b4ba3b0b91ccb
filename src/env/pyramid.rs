//! Means, ranges and 3x3 filtered means of all levels of an equal-area image.
//!
//! The level of depth `d` has `2^d` x `2^d` texels; depth 0 is the whole sphere. Levels follow each other, the
//! coarsest first, so that a texel's place does not depend on the size of the image.

use crate::warp::equal_area::wrap_texel_log2;
use alloc::vec;
use alloc::vec::Vec;

/// Place of the first texel of a level.
#[inline]
pub(super) const fn level_start(depth: u32) -> usize {
    ((1_usize << (2 * depth)) - 1) / 3
}

/// The levels of an image.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pyramid {
    /// Means of all levels. Positive wherever a texel below is.
    pub(super) means: Vec<f32>,
    /// Minimum and maximum of all levels but the finest, whose texels are their own.
    pub(super) ranges: Vec<[f32; 2]>,
    /// Box-filtered means of all levels: each the average over its 3x3 neighborhood across the map's seams.
    pub(super) filtered: Vec<f32>,
}

impl Pyramid {
    /// Builds all levels of an image of `2^depth` texels a side. Its texels are 0 or in `[1e-30, 1e30]`, and
    /// stand at the end of `means`, which has room for all levels. Ranges and filtered means are those of the image
    /// with some texels, by number, replaced by what remains of them without the bright features.
    pub(super) fn new(depth: u32, mut means: Vec<f32>, rest: &[(u32, f32)]) -> Self {
        let mut capped = (!rest.is_empty()).then(|| means.clone());
        for &(texel, value) in rest {
            capped.iter_mut().for_each(|capped| capped[level_start(depth) + texel as usize] = value);
        }
        let mut ranges = vec![[0.0; 2]; level_start(depth)];
        for d in (0..depth).rev() {
            let size = 1_u32 << d;
            for y in 0..size {
                for x in 0..size {
                    let at = level_start(d) + ((y << d) | x) as usize;
                    means[at] = parent_mean(children(&means, d, x, y));
                    ranges[at] = if d + 1 == depth {
                        parent_range(children(capped.as_ref().unwrap_or(&means), d, x, y).map(|v| [v; 2]))
                    } else {
                        parent_range(children(&ranges, d, x, y))
                    };
                }
            }
        }
        let mut filtered = Vec::with_capacity(means.len());
        capped.iter_mut().for_each(|capped| fill_means(depth, capped));
        let image = capped.as_ref().unwrap_or(&means);
        for d in 0..=depth {
            filter(d, &image[level_start(d)..level_start(d + 1)], &mut filtered);
        }
        Self { means, ranges, filtered }
    }
}

/// Fills in the means of all levels but the finest.
fn fill_means(depth: u32, means: &mut [f32]) {
    for d in (0..depth).rev() {
        for texel in 0..1_u32 << (2 * d) {
            let (x, y) = (texel & ((1 << d) - 1), texel >> d);
            means[level_start(d) + texel as usize] = parent_mean(children(means, d, x, y));
        }
    }
}

/// The four texels below a texel of depth `d`, row by row.
#[inline]
pub(super) fn children<T: Copy>(levels: &[T], d: u32, x: u32, y: u32) -> [T; 4] {
    let row = level_start(d + 1) + ((y << (d + 2)) | (x << 1)) as usize;
    let next = row + (2 << d);
    [levels[row], levels[row + 1], levels[next], levels[next + 1]]
}

/// Mean of four means, rounded once.
#[inline]
pub(super) fn parent_mean(children: [f32; 4]) -> f32 {
    (0.25 * children.iter().map(|&v| f64::from(v)).sum::<f64>()) as f32
}

/// Range that holds four ranges.
#[inline]
pub(super) fn parent_range(children: [[f32; 2]; 4]) -> [f32; 2] {
    children.into_iter().reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]).unwrap_or_default()
}

/// Appends the 3x3 averages of one level.
fn filter(depth: u32, level: &[f32], filtered: &mut Vec<f32>) {
    let size = 1_i32 << depth;
    let at = |x: i32, y: i32| -> f64 {
        let (x, y) = wrap_texel_log2(x, y, depth);
        f64::from(level[((y << depth) | x) as usize])
    };
    for y in 0..size {
        for x in 0..size {
            let inside = x > 0 && y > 0 && x + 1 < size && y + 1 < size;
            let sum: f64 = if inside {
                let row = |y: i32| {
                    let start = ((y << depth) | (x - 1)) as usize;
                    let [a, b, c] = [level[start], level[start + 1], level[start + 2]].map(f64::from);
                    a + b + c
                };
                row(y - 1) + row(y) + row(y + 1)
            } else {
                let row = |y: i32| at(x - 1, y) + at(x, y) + at(x + 1, y);
                row(y - 1) + row(y) + row(y + 1)
            };
            filtered.push((sum / 9.0) as f32);
        }
    }
}
