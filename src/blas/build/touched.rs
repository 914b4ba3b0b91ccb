//! The darkest and the brightest texel that a lookup inside of a footprint can touch.

use crate::blas::build::axis::{TexelRun, stretches};
use crate::blas::build::footprint::{EdgeNormal, TexelFootprint};
use crate::blas::build::pyramid::TexturePyramid;
use crate::blas::build::texture::Texture;
use crate::blas::build::window::SmallWindow;
use crate::math::floor_to_i64;
use crate::record::Filter;

/// Minimum and maximum of the touched texels. Every lookup in the footprint lies between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TexelRange {
    /// The darkest.
    pub(crate) min: f32,
    /// The brightest.
    pub(crate) max: f32,
}

impl TexelRange {
    /// Whether every lookup gives the same.
    pub(crate) fn is_constant(self) -> bool {
        self.min == self.max
    }
}

/// How far a texel reaches beyond its own square: bilinear lookup weighs it by a tent two texels wide.
fn support(filter: Filter) -> f64 {
    match filter {
        Filter::Nearest => 0.0,
        Filter::Bilinear => 0.5,
    }
}

/// Blocks along a large footprint; they are not looked into.
///
/// *Measured* (CONSTANTS.md, "Constants of the trees over textures"): half or twice the value changes the variance by
/// less than 3 %, and only where leaves hold copies of the image. More takes longer to build.
const FOOTPRINT_BLOCKS: u32 = 8;

/// Returns the texels that a lookup in a small footprint can touch.
#[inline]
pub(super) fn window(pyramid: &TexturePyramid<'_>, footprint: &TexelFootprint) -> Option<SmallWindow> {
    let span = (footprint.hi[0] - footprint.lo[0]).max(footprint.hi[1] - footprint.lo[1]);
    let texture = pyramid.texture();
    let is_small = span <= f64::from(2 * FOOTPRINT_BLOCKS);
    if is_small { SmallWindow::new(texture, ends(footprint, reach(texture, footprint))) } else { None }
}

/// How far from a footprint the squares of texels may be that it touches.
fn reach(texture: &Texture<'_>, footprint: &TexelFootprint) -> [f64; 2] {
    let support = support(texture.filtering());
    footprint.slack.map(|slack| slack + support)
}

/// The first and the last texel along each axis of the plane.
fn ends(footprint: &TexelFootprint, reach: [f64; 2]) -> [[i64; 2]; 2] {
    core::array::from_fn(|k| {
        let end = |at: f64| footprint.origin[k] + floor_to_i64(at);
        [end(footprint.lo[k] - reach[k]), end(footprint.hi[k] + reach[k])]
    })
}

/// Returns whether every lookup in a footprint gives the same, and what: as [`range`], but a range that is not constant
/// is any that is not.
pub(super) fn constant(pyramid: &TexturePyramid<'_>, footprint: &TexelFootprint) -> Option<f32> {
    // The corners' own texels are touched for certain. Most often they tell.
    let [a, b, c] = footprint.corners.map(|[x, y]| {
        let [i, j] = [floor_to_i64(x) + footprint.origin[0], floor_to_i64(y) + footprint.origin[1]];
        pyramid.texture().fetch(i, j)
    });
    if a != b || a != c {
        return None;
    }
    let range = search(pyramid, footprint, window(pyramid, footprint).as_ref(), false);
    range.is_constant().then_some(range.max)
}

/// Returns the range over a footprint; over blocks of texels that it meets, if it is larger than 16 texels. The
/// footprint is closed and, where a host's `f32` could round across its edge, a little larger. `window` is the
/// footprint's [`window`].
///
/// Where a footprint spans many copies of the image along an axis, all of the image along that axis counts.
pub(super) fn range(
    pyramid: &TexturePyramid<'_>,
    footprint: &TexelFootprint,
    window: Option<&SmallWindow>,
) -> TexelRange {
    search(pyramid, footprint, window, true)
}

/// Returns the range. With `exact` false it is enough that a range which is not constant is found not to be.
fn search(
    pyramid: &TexturePyramid<'_>,
    footprint: &TexelFootprint,
    window: Option<&SmallWindow>,
    exact: bool,
) -> TexelRange {
    let texture = pyramid.texture();
    let reach = reach(texture, footprint);
    if let Some(window) = window {
        return range_in_window(window, footprint, reach, exact);
    }
    let ends = ends(footprint, reach);
    let span = (footprint.hi[0] - footprint.lo[0]).max(footprint.hi[1] - footprint.lo[1]);
    let along = |k: usize| {
        let [from, to] = ends[k];
        stretches(texture.wrapping()[k], texture.size()[k], from, to, footprint.origin[k])
    };
    let (columns, rows) = (along(0), along(1));
    let finest =
        (0..pyramid.top()).take_while(|level| span > f64::from((2 * FOOTPRINT_BLOCKS) << level)).count() as u32;
    let range = TexelRange { min: f32::INFINITY, max: 0.0 };
    let mut search = RangeSearch { pyramid, footprint, normals: footprint.normals(), reach, exact, finest, range };
    for row in &rows {
        for column in &columns {
            search.stretch(column, row);
        }
    }
    if search.range.min <= search.range.max {
        search.range
    } else {
        // A footprint always lies on the plane. If rounding lost it, all of the image may be under it.
        let whole = pyramid.whole();
        TexelRange { min: whole.min, max: whole.max }
    }
}

/// Returns the range over a footprint that touches no texels outside of a window.
fn range_in_window(window: &SmallWindow, footprint: &TexelFootprint, reach: [f64; 2], exact: bool) -> TexelRange {
    let (min, max) = window.ends();
    if min == max {
        return TexelRange { min, max };
    }
    let mut range = TexelRange { min: f32::INFINITY, max: 0.0 };
    // A texel's square, grown, meets the triangle if its center lies within these bounds along every normal.
    let half = reach.map(|reach| 0.5 + reach);
    let bounds = footprint.normals().map(|EdgeNormal { normal: n, lo, hi }| {
        let grown = n[0].abs() * half[0] + n[1].abs() * half[1];
        (n, lo - grown, hi + grown)
    });
    let [x0, y0]: [f64; 2] = core::array::from_fn(|k| (window.first[k] - footprint.origin[k]) as f64 + 0.5);
    for row in 0..window.size[1] {
        for column in 0..window.size[0] {
            let value = window.texel(column, row);
            if value >= range.min && value <= range.max {
                continue;
            }
            let (x, y) = (x0 + column as f64, y0 + row as f64);
            if bounds.iter().all(|(n, lo, hi)| (*lo..=*hi).contains(&(n[0] * x + n[1] * y))) {
                range = TexelRange { min: range.min.min(value), max: range.max.max(value) };
                if !exact && range.min < range.max {
                    return range;
                }
            }
        }
    }
    // A footprint always lies on the plane. If rounding lost it, all of the window may be under it.
    if range.min <= range.max { range } else { TexelRange { min, max } }
}

struct RangeSearch<'a> {
    pyramid: &'a TexturePyramid<'a>,
    footprint: &'a TexelFootprint,
    normals: [EdgeNormal; 3],
    reach: [f64; 2],
    exact: bool,
    /// Blocks of this level are not looked into.
    finest: u32,
    range: TexelRange,
}

impl RangeSearch<'_> {
    /// Starts at the level where the stretch is two blocks wide at most.
    fn stretch(&mut self, column: &TexelRun, row: &TexelRun) {
        let mut level = 0;
        while (column.last >> level) - (column.first >> level) > 1 || (row.last >> level) - (row.first >> level) > 1 {
            level += 1;
        }
        for y in row.first >> level..=row.last >> level {
            for x in column.first >> level..=column.last >> level {
                self.visit(column, row, level, x, y);
            }
        }
    }

    fn visit(&mut self, column: &TexelRun, row: &TexelRun, level: u32, x: u32, y: u32) {
        let block = self.pyramid.block(level, x, y);
        // Nothing new in there; this is what makes the search short.
        if block.min >= self.range.min && block.max <= self.range.max {
            return;
        }
        if !self.exact && self.range.min < self.range.max {
            return;
        }
        let clip = |stretch: &TexelRun, i: u32| {
            (stretch.first.max(i << level), stretch.last.min((i << level) + ((1 << level) - 1)))
        };
        let ((x0, x1), (y0, y1)) = (clip(column, x), clip(row, y));
        if x0 > x1 || y0 > y1 {
            return;
        }
        let grow = |[lo, hi]: [f64; 2], k: usize| [lo - self.reach[k], hi + self.reach[k]];
        let (along, across) = (grow(column.interval(x0, x1), 0), grow(row.interval(y0, y1), 1));
        if !self.footprint.meets(&self.normals, along, across) {
            return;
        }
        if level <= self.finest || block.min == block.max {
            self.range.min = self.range.min.min(block.min);
            self.range.max = self.range.max.max(block.max);
            return;
        }
        for child in 0..4 {
            let (cx, cy) = (2 * x + (child & 1), 2 * y + (child >> 1));
            // The last block of an odd count stands alone; outside of the stretch there is nothing.
            if cx <= column.last >> (level - 1) && cy <= row.last >> (level - 1) {
                self.visit(column, row, level - 1, cx, cy);
            }
        }
    }
}
