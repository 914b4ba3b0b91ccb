//! A few texels of the wrapped plane in a local array: small footprints read the same ones again and again.

use crate::blas::build::texture::{Texture, wrap_index};

/// Texels of a rectangle of the wrapped plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window<const CAPACITY: usize> {
    /// The first column and row, in the plane.
    pub(super) first: [i64; 2],
    /// Numbers of columns and rows.
    pub(super) size: [usize; 2],
    texels: [f32; CAPACITY],
}

/// A window for the footprint of a fine cell.
///
/// A budget of time: larger ones are slower to fill, and smaller ones send more footprints down the pyramid. No result
/// depends on the capacity.
pub(super) type SmallWindow = Window<36>;

/// A window for every footprint that is integrated exactly. *Proved*: such a footprint is at most 24 texels long, and
/// reads 27 texels along an axis.
pub(super) type LargeWindow = Window<729>;

impl<const CAPACITY: usize> Window<CAPACITY> {
    /// Reads the texels between the first and the last along each axis. `None` if they are more than `CAPACITY`.
    #[inline]
    pub(super) fn new(texture: &Texture<'_>, ends: [[i64; 2]; 2]) -> Option<Self> {
        let [width, height] = ends.map(|[from, to]| to.saturating_sub(from).saturating_add(1) as usize);
        if width == 0 || height == 0 || width.saturating_mul(height) > CAPACITY {
            return None;
        }
        let mut window = Self { first: ends.map(|[from, _]| from), size: [width, height], texels: [0.0; CAPACITY] };
        let [columns, rows] = texture.size();
        let [[x0, x1], [y0, y1]] = ends;
        if x0 >= 0 && x1 < i64::from(columns) && y0 >= 0 && y1 < i64::from(rows) {
            for (row, y) in window.texels.chunks_exact_mut(width).zip(y0..=y1) {
                row.copy_from_slice(texture.run(x0 as usize, y as usize, width));
            }
        } else {
            let wrap = texture.wrapping();
            for (row, y) in window.texels.chunks_exact_mut(width).zip(y0..=y1) {
                let y = wrap_index(wrap[1], y, rows);
                for (texel, x) in row.iter_mut().zip(x0..=x1) {
                    *texel = texture.texel(wrap_index(wrap[0], x, columns), y);
                }
            }
        }
        Some(window)
    }

    /// Returns a texel by its column and row in the window.
    #[inline(always)]
    pub(super) fn texel(&self, column: usize, row: usize) -> f32 {
        self.texels[row * self.size[0] + column]
    }

    /// Returns the texels of a row.
    #[inline(always)]
    pub(super) fn row(&self, row: usize) -> &[f32] {
        &self.texels[row * self.size[0]..][..self.size[0]]
    }

    /// Returns the darkest and the brightest texel.
    #[inline]
    pub(super) fn ends(&self) -> (f32, f32) {
        let texels = &self.texels[..self.size[0] * self.size[1]];
        texels.iter().fold((f32::INFINITY, 0.0), |(min, max), &texel| (texel.min(min), texel.max(max)))
    }
}
