//! The image that an environment is built from, as its host sees it.

use super::{BRIGHTEST, DARKEST};
use crate::error::{Error, Kind};
use crate::record::Filter;
use crate::warp::equal_area::wrap_texel;
use alloc::vec::Vec;

/// Largest side of an image.
const MAX_SIDE: usize = 1 << 16;

/// How the image continues beyond its edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Edges {
    /// Columns repeat, rows end: a latitude-longitude image.
    LatLong,
    /// The octahedral map's copies, rotated by half a turn.
    EqualArea,
}

/// A checked image, and the grid of cells of constant radiance that stands for it.
#[derive(Clone, Debug)]
pub(super) struct Source {
    texels: Vec<f32>,
    width: usize,
    height: usize,
    edges: Edges,
    filter: Filter,
    /// How many texels were negative.
    pub(super) clamped: u32,
}

impl Source {
    pub(super) fn new(
        width: usize,
        height: usize,
        texels: &[f32],
        edges: Edges,
        filter: Filter,
    ) -> Result<Self, Error> {
        let what = "environment";
        if !(1..=MAX_SIDE).contains(&width) || !(1..=MAX_SIDE).contains(&height) {
            return Err(Error(Kind::ImageSize { what, width, height, limit: MAX_SIDE }));
        }
        // At most 2^32: counted in 64 bits, as `usize` may be narrower.
        if texels.len() as u64 != width as u64 * height as u64 {
            return Err(Error(Kind::TexelCount { what, width, height, found: texels.len() }));
        }
        let mut clamped = 0_u32;
        let check = |(i, &value): (usize, &f32)| {
            let (x, y) = (i % width, i / width);
            if !value.is_finite() {
                return Err(Error(Kind::Texel { what, x, y, value }));
            }
            if value > BRIGHTEST {
                return Err(Error(Kind::TexelTooBright { what, x, y, value, limit: BRIGHTEST }));
            }
            if value < 0.0 {
                clamped = clamped.saturating_add(1);
            }
            Ok(if value > 0.0 { value.max(DARKEST) } else { 0.0 })
        };
        let texels = texels.iter().enumerate().map(check).collect::<Result<_, _>>()?;
        Ok(Self { texels, width, height, edges, filter, clamped })
    }

    /// The radiance of every direction, if it is the same everywhere.
    pub(super) fn constant(&self) -> Option<f32> {
        let first = self.texels[0];
        self.texels.iter().all(|&v| v == first).then_some(first)
    }

    /// Columns of the grid of cells.
    pub(super) fn columns(&self) -> usize {
        self.width * self.refinement()
    }

    /// Rows of the grid of cells.
    pub(super) fn rows(&self) -> usize {
        self.height * self.refinement()
    }

    /// Cells per texel and axis: a host that interpolates sees light half a texel around a lit one, so the cells
    /// are quadrants of texels then.
    fn refinement(&self) -> usize {
        match self.filter {
            Filter::Nearest => 1,
            Filter::Bilinear => 2,
        }
    }

    /// Mean radiance over a cell: the texel's, or the average of the interpolated image over a quadrant of it.
    pub(super) fn cell(&self, column: usize, row: usize) -> f64 {
        if self.filter == Filter::Nearest {
            return f64::from(self.texels[row * self.width + column]);
        }
        let (x, y) = ((column / 2) as i32, (row / 2) as i32);
        // Towards the neighbour that the quadrant lies next to.
        let (dx, dy) = ((column % 2) as i32 * 2 - 1, (row % 2) as i32 * 2 - 1);
        // Over half a texel the weight of the nearer centre is 3/4 on average.
        (9.0 * self.texel(x, y) + 3.0 * (self.texel(x + dx, y) + self.texel(x, y + dy)) + self.texel(x + dx, y + dy))
            * (1.0 / 16.0)
    }

    /// Texel at a place inside or one step outside of the image.
    fn texel(&self, x: i32, y: i32) -> f64 {
        let (width, height) = (self.width as i32, self.height as i32);
        let (x, y) = if (0..width).contains(&x) && (0..height).contains(&y) {
            (x as usize, y as usize)
        } else {
            match self.edges {
                Edges::LatLong => (x.rem_euclid(width) as usize, y.clamp(0, height - 1) as usize),
                Edges::EqualArea => {
                    let (x, y) = wrap_texel(x, y, width);
                    (x as usize, y as usize)
                }
            }
        };
        f64::from(self.texels[y * self.width + x])
    }
}
