//! Resampling of a host's image to an equal-area image whose size is a power of two, by area: no flux is lost.

use super::image::Edges;
use super::lat_long::{CellCoverage, LatLong};
use super::pyramid::level_start;
use super::source::EnvironmentSource;
use super::{MAX_RADIANCE, MIN_RADIANCE};
use crate::parallel::for_each_chunk;
use crate::progress::{Cancelled, Progress};
use alloc::vec;
use alloc::vec::Vec;

/// Units of progress for every row of the resampled image. *Measured* on 16384 x 8192 texels: a row takes about four
/// times as long as one of the pyramid. It only makes reports even.
pub(super) const UNITS_PER_ROW: usize = 4;

/// Returns the means of the source over the texels of an equal-area image of `2^depth` texels a side, `depth` at
/// least 1, as the finest level of an otherwise empty pyramid.
///
/// A texel that shares any area with a lit cell is lit.
pub(super) fn resample(
    source: &EnvironmentSource<'_>,
    depth: u32,
    progress: &Progress<'_>,
) -> Result<Vec<f32>, Cancelled> {
    let mut levels = vec![0.0; level_start(depth + 1)];
    let image = &mut levels[level_start(depth)..];
    let size = 1_usize << depth;
    match source.edges() {
        Edges::LatLong(_) => {
            let source = LatLong::new(source, size);
            fill(image, size, progress, CellCoverage::default, |coverage, x, y| source.texel(coverage, x, y));
        }
        Edges::EqualArea => fill(image, size, progress, || (), |(), x, y| box_mean(source, x, y, size)),
    }
    progress.check()?;
    Ok(levels)
}

/// Mean over the cells of an equal-area source that a texel overlaps.
fn box_mean(source: &EnvironmentSource<'_>, x: usize, y: usize, size: usize) -> f64 {
    let cells = source.columns();
    let (mut flux, mut area) = (0.0, 0.0);
    for (row, height) in overlaps(y, size, cells) {
        for (column, width) in overlaps(x, size, cells) {
            flux += width * height * source.cell(column, row);
            area += width * height;
        }
    }
    flux / area
}

/// Cells that a texel overlaps along one axis, and by how much, in units of the side over `cells * size`.
fn overlaps(texel: usize, size: usize, cells: usize) -> impl Iterator<Item = (usize, f64)> {
    // Exact: at most 2^13 by 2^17.
    let (start, end) = (texel as u64 * cells as u64, (texel as u64 + 1) * cells as u64);
    let size = size as u64;
    (start / size..end.div_ceil(size))
        .map(move |cell| (cell as usize, (end.min((cell + 1) * size) - start.max(cell * size)) as f64))
}

/// Computes all texels, row by row, each row with a scratch space of its own. Each texel is computed alone: the result
/// does not depend on the number of threads.
fn fill<S>(
    image: &mut [f32],
    size: usize,
    progress: &Progress<'_>,
    scratch: impl Fn() -> S + Sync + Send,
    texel: impl Fn(&mut S, usize, usize) -> f64 + Sync + Send,
) {
    for_each_chunk(image, size, |y, row| {
        if progress.check().is_err() {
            return;
        }
        let mut scratch = scratch();
        for (x, out) in row.iter_mut().enumerate() {
            let mean = texel(&mut scratch, x, y);
            *out = if mean > 0.0 { (mean as f32).clamp(MIN_RADIANCE, MAX_RADIANCE) } else { 0.0 };
        }
        progress.add(UNITS_PER_ROW);
    });
}
