//! Means, ranges and 3x3 filtered means of all levels of an equal-area image.
//!
//! The level of depth `d` has `2^d` x `2^d` texels; depth 0 is the whole sphere. Levels follow each other, the
//! coarsest first, so that a texel's place does not depend on the size of the image.

use crate::parallel::{WORTHWHILE, for_each_chunk};
use crate::progress::{Cancelled, Progress};
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
    /// with some texels, by number, replaced by what remains of them without the bright features. Every row of the
    /// finest filtered level is a unit of progress.
    pub(super) fn new(
        depth: u32,
        mut means: Vec<f32>,
        rest: &[(u32, f32)],
        progress: &Progress<'_>,
    ) -> Result<Self, Cancelled> {
        fill_means(depth, &mut means);
        progress.check()?;
        // In place and back again: a second image would be a third of the memory.
        let whole = replace_texels(&mut means[level_start(depth)..], rest);
        let ranges = ranges_of(depth, &means[level_start(depth)..]);
        progress.check()?;
        let coarser = if rest.is_empty() { Vec::new() } else { coarser_means(depth, &means) };
        let mut filtered = vec![0.0; means.len()];
        for d in 0..=depth {
            let levels = if d == depth || coarser.is_empty() { &means } else { &coarser };
            let level = &levels[level_start(d)..level_start(d + 1)];
            let out = &mut filtered[level_start(d)..level_start(d + 1)];
            filter(d, level, out, (d == depth).then_some(progress));
        }
        progress.check()?;
        replace_texels(&mut means[level_start(depth)..], &whole);
        Ok(Self { means, ranges, filtered })
    }
}

/// Replaces texels by number, and returns what they were.
fn replace_texels(image: &mut [f32], texels: &[(u32, f32)]) -> Vec<(u32, f32)> {
    texels.iter().map(|&(texel, value)| (texel, core::mem::replace(&mut image[texel as usize], value))).collect()
}

/// Returns the ranges of all levels but the finest, which is given.
fn ranges_of(depth: u32, finest: &[f32]) -> Vec<[f32; 2]> {
    let mut ranges = vec![[0.0; 2]; level_start(depth)];
    for d in (0..depth).rev() {
        let (level, finer) = ranges[..level_start((d + 2).min(depth))].split_at_mut(level_start(d + 1));
        for_each_texel(&mut level[level_start(d)..], d, |x, y| {
            if d + 1 == depth {
                parent_range(children_in(finest, d, x, y).map(|v| [v; 2]))
            } else {
                parent_range(children_in(finer, d, x, y))
            }
        });
    }
    ranges
}

/// Computes all levels above the finest one.
fn fill_means(depth: u32, means: &mut [f32]) {
    for d in (0..depth).rev() {
        let (level, finer) = means.split_at_mut(level_start(d + 1));
        for_each_texel(&mut level[level_start(d)..], d, |x, y| parent_mean(children_in(finer, d, x, y)));
    }
}

/// Recomputes the means of all levels but the finest.
fn coarser_means(depth: u32, means: &[f32]) -> Vec<f32> {
    let mut coarser = vec![0.0; level_start(depth)];
    if depth > 0 {
        let finest = &means[level_start(depth)..];
        for_each_texel(&mut coarser[level_start(depth - 1)..], depth - 1, |x, y| {
            parent_mean(children_in(finest, depth - 1, x, y))
        });
        fill_means(depth - 1, &mut coarser);
    }
    coarser
}

/// Computes every texel of a level alone, many rows side by side.
fn for_each_texel<T: Send>(level: &mut [T], depth: u32, texel: impl Fn(u32, u32) -> T + Sync + Send) {
    let rows = rows_at_once(depth);
    for_each_chunk(level, rows << depth, |chunk, texels| {
        for (row, texels) in texels.chunks_exact_mut(1 << depth).enumerate() {
            let y = (chunk * rows + row) as u32;
            (0..).zip(texels).for_each(|(x, out)| *out = texel(x, y));
        }
    });
}

/// Number of rows of a level that are worth handing to another thread.
fn rows_at_once(depth: u32) -> usize {
    (WORTHWHILE >> depth).max(1)
}

/// The four texels of a level below a texel of depth `d`, row by row.
#[inline]
fn children_in<T: Copy>(level: &[T], d: u32, x: u32, y: u32) -> [T; 4] {
    let row = ((y << (d + 2)) | (x << 1)) as usize;
    let next = row + (2 << d);
    [level[row], level[row + 1], level[next], level[next + 1]]
}

/// The four texels below a texel of depth `d`, row by row.
#[inline]
pub(super) fn children<T: Copy>(levels: &[T], d: u32, x: u32, y: u32) -> [T; 4] {
    children_in(&levels[level_start(d + 1)..], d, x, y)
}

/// The 16 texels two levels below a texel of depth `d`, by rows.
#[inline(always)]
pub(super) fn grandchildren(levels: &[f32], d: u32, x: u32, y: u32) -> [[f32; 4]; 4] {
    let level = &levels[level_start(d + 2)..];
    let start = ((y << (d + 4)) | (x << 2)) as usize;
    core::array::from_fn(|row| {
        let row = &level[start + (row << (d + 2))..][..4];
        [row[0], row[1], row[2], row[3]]
    })
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

/// Computes the 3x3 averages of one level.
fn filter(depth: u32, level: &[f32], filtered: &mut [f32], progress: Option<&Progress<'_>>) {
    let size = 1_i32 << depth;
    let value = |at: usize| f64::from(level[at]);
    let at = |x: i32, y: i32| -> f64 {
        let (x, y) = wrap_texel_log2(x, y, depth);
        value(((y << depth) | x) as usize)
    };
    let texel = |x: i32, y: i32| {
        let inside = x > 0 && y > 0 && x + 1 < size && y + 1 < size;
        let sum: f64 = if inside {
            let row = |y: i32| {
                let start = ((y << depth) | (x - 1)) as usize;
                let [a, b, c] = [start, start + 1, start + 2].map(value);
                a + b + c
            };
            row(y - 1) + row(y) + row(y + 1)
        } else {
            let row = |y: i32| at(x - 1, y) + at(x, y) + at(x + 1, y);
            row(y - 1) + row(y) + row(y + 1)
        };
        (sum / 9.0) as f32
    };
    let rows = rows_at_once(depth);
    for_each_chunk(filtered, rows << depth, |chunk, texels| {
        if let Some(progress) = progress {
            if progress.check().is_err() {
                return;
            }
            progress.add(texels.len() >> depth);
        }
        for (row, texels) in texels.chunks_exact_mut(1 << depth).enumerate() {
            let y = (chunk * rows + row) as i32;
            (0..).zip(texels).for_each(|(x, out)| *out = texel(x, y));
        }
    });
}
