//! The image that an environment is built from, as its host sees it.

use super::image::{Edges, EnvironmentImage, Poles};
use super::{MAX_RADIANCE, MIN_RADIANCE};
use crate::error::{Error, ErrorKind};
use crate::parallel;
use crate::record::Filter;
use crate::warp::equal_area::wrap_texel;

/// Largest side of an image, in texels. *Proved*: twice the side times the 2^13 texels of a resampled side is exact in
/// the integers and doubles that resampling uses.
///
/// Larger: the products would still fit, but counts of texels would need 64 bits everywhere.
const MAX_IMAGE_SIDE: usize = 1 << 16;

/// A checked image, borrowed from the host, and the grid of cells of constant radiance that stands for it.
#[derive(Clone, Copy, Debug)]
pub(super) struct EnvironmentSource<'a> {
    /// As the host has them: [`clamped`] when they are read.
    texels: &'a [f32],
    width: usize,
    height: usize,
    edges: Edges,
    filter: Filter,
    /// Number of texels that were negative.
    pub(super) clamped: u32,
    /// Least and largest radiance.
    range: [f32; 2],
}

/// Returns the radiance of a texel that was not refused.
#[inline(always)]
fn clamped(value: f32) -> f32 {
    if value > 0.0 { value.max(MIN_RADIANCE) } else { 0.0 }
}

/// What is found in a part of an image.
#[derive(Clone, Copy)]
struct CheckedPart {
    is_valid: bool,
    negative: usize,
    range: [f32; 2],
}

impl CheckedPart {
    fn new(texels: &[f32]) -> Self {
        let mut part = Self { is_valid: true, negative: 0, range: [f32::INFINITY, 0.0] };
        for &value in texels {
            // NaN fails the comparison.
            part.is_valid &= value.abs() < f32::INFINITY && value <= MAX_RADIANCE;
            part.negative += usize::from(value < 0.0);
            let value = clamped(value);
            part.range = [value.min(part.range[0]), value.max(part.range[1])];
        }
        part
    }

    fn merge(self, other: Self) -> Self {
        Self {
            is_valid: self.is_valid && other.is_valid,
            negative: self.negative + other.negative,
            range: [self.range[0].min(other.range[0]), self.range[1].max(other.range[1])],
        }
    }
}

impl<'a> EnvironmentSource<'a> {
    /// Checks an image.
    pub(super) fn new(image: &EnvironmentImage<'a>) -> Result<Self, Error> {
        let EnvironmentImage { width, height, luminance: texels, edges, filter, .. } = *image;
        let what = "environment";
        if !(1..=MAX_IMAGE_SIDE).contains(&width) || !(1..=MAX_IMAGE_SIDE).contains(&height) {
            return Err(Error(ErrorKind::ImageSize { what, width, height, limit: MAX_IMAGE_SIDE }));
        }
        // At most 2^32: counted in 64 bits, as `usize` may be narrower.
        if texels.len() as u64 != width as u64 * height as u64 {
            return Err(Error(ErrorKind::TexelCount { what, width, height, found: texels.len() }));
        }
        let part = parallel::reduce(texels, CheckedPart::new, CheckedPart::merge);
        if !part.is_valid {
            let is_wrong = |value: &f32| !(value.is_finite() && *value <= MAX_RADIANCE);
            let i = texels.iter().position(is_wrong).unwrap_or(0);
            let (x, y, value) = (i % width, i / width, texels[i]);
            return Err(Error(if value.is_finite() {
                ErrorKind::TexelTooBright { what, x, y, value, limit: MAX_RADIANCE }
            } else {
                ErrorKind::Texel { what, x, y, value }
            }));
        }
        let negative = u32::try_from(part.negative).unwrap_or(u32::MAX);
        Ok(Self { texels, width, height, edges, filter, clamped: negative, range: part.range })
    }

    /// The radiance of every direction, if it is the same everywhere.
    pub(super) fn constant(&self) -> Option<f32> {
        let [low, high] = self.range;
        (low == high).then_some(high)
    }

    /// How the image continues beyond its edges.
    pub(super) fn edges(&self) -> Edges {
        self.edges
    }

    /// Number of columns of the grid of cells.
    pub(super) fn columns(&self) -> usize {
        self.width * self.refinement()
    }

    /// Number of rows of the grid of cells.
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
    #[inline]
    pub(super) fn cell(&self, column: usize, row: usize) -> f64 {
        if self.filter == Filter::Nearest {
            return f64::from(clamped(self.texels[row * self.width + column]));
        }
        let (x, y) = ((column / 2) as i32, (row / 2) as i32);
        // Towards the neighbor that the quadrant lies next to.
        let (dx, dy) = ((column % 2) as i32 * 2 - 1, (row % 2) as i32 * 2 - 1);
        // Over half a texel the weight of the nearer center is 3/4 on average.
        (9.0 * self.texel(x, y) + 3.0 * (self.texel(x + dx, y) + self.texel(x, y + dy)) + self.texel(x + dx, y + dy))
            * (1.0 / 16.0)
    }

    /// Texel at a place inside or one step outside of the image.
    #[inline]
    fn texel(&self, x: i32, y: i32) -> f64 {
        let (width, height) = (self.width as i32, self.height as i32);
        let at = |x: i32, y: i32| f64::from(clamped(self.texels[y as usize * self.width + x as usize]));
        if (0..width).contains(&x) && (0..height).contains(&y) {
            return at(x, y);
        }
        match self.edges {
            Edges::LatLong(Poles::Across) if !(0..height).contains(&y) => {
                // Half a turn away. In an image of odd width that is the border of two columns.
                let y = y.clamp(0, height - 1);
                let [a, b] = [width / 2, (width + 1) / 2].map(|half| (x + half).rem_euclid(width));
                0.5 * (at(a, y) + at(b, y))
            }
            Edges::LatLong(_) => at(x.rem_euclid(width), y.clamp(0, height - 1)),
            Edges::EqualArea => {
                let (x, y) = wrap_texel(x, y, width);
                at(x as i32, y as i32)
            }
        }
    }
}
