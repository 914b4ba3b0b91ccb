//! The average of a texture over a footprint.

use crate::blas::build::footprint::TexelFootprint;
use crate::blas::build::pyramid::TexturePyramid;
use crate::blas::build::texture::wrap_index;
use crate::blas::build::touched::TexelRange;
use crate::blas::node::storable;
use crate::blas::build::window::{LargeWindow, SmallWindow, Window};
use crate::geometry::subdivision_centers;
use crate::math::floor_to_i64;
use crate::record::Filter;

/// A positive average is at least this share of the brightest texel that is touched.
///
/// It stands in for what rounding, and the blocks of a large footprint, can miss. A limit: smaller risks fireflies
/// there, and larger spends samples on what is dark.
const IMAGE_FLOOR: f64 = 1e-6;

/// Footprints of up to about this many texels are integrated exactly. Leaves are far smaller, unless a triangle ran
/// out of its budget.
///
/// *Measured* (ACCURACY.md, "Constants of the trees over textures"): half or twice the value changes the variance by
/// less than 1 %. Larger takes longer to build.
const EXACT_TEXELS: f64 = 48.0;

/// Cells along an edge of a larger footprint at whose centers it is looked up.
///
/// *Measured* (the same table): it matters only where a leaf holds copies of the image; twice as many save a fifth of
/// the variance there, with four times the lookups.
const IMAGE_SUBDIVISION: u32 = 8;

/// A triangle is taken for a line when its area is this share of its longest edge's square.
///
/// *Proved*: there, areas have 22 of their 53 bits left. Larger would look up what can be integrated.
const LINE_AREA: f64 = 1e-9;

/// Distance of the two points of Gauss's rule from the middle of an interval from -1 to 1. *Proved*: 1/√3.
const GAUSS: f64 = 0.577_350_269_189_625_8;

/// The average over a footprint in which lookups lie in `range`, from 0 to
/// [`MAX_AVERAGE`](crate::blas::node::MAX_AVERAGE).
///
/// It is zero exactly where the whole touched range is black. Otherwise it is a normal number between the range's
/// ends, and exact (up to rounding, and up to a floor of a millionth of the brightest texel) for footprints of up to
/// about 48 texels.
pub(crate) fn average(pyramid: &TexturePyramid<'_>, footprint: &TexelFootprint, range: TexelRange) -> f32 {
    if range.is_constant() {
        return storable(f64::from(range.max));
    }
    let longest = footprint.corners.iter().fold(0.0f64, |m, p| {
        let q = footprint.corners[0];
        m.max((p[0] - q[0]) * (p[0] - q[0]) + (p[1] - q[1]) * (p[1] - q[1]))
    });
    let line = footprint.double_area() <= LINE_AREA * longest;
    let mean = if line {
        looked_up(pyramid, footprint)
    } else if texels(footprint) > EXACT_TEXELS {
        blocks(pyramid, footprint)
    } else {
        exact(pyramid, footprint, range.max)
    };
    let (min, max) = (f64::from(range.min), f64::from(range.max));
    // NaN, from a footprint that lost its area to rounding, becomes the floor here.
    storable(mean.max(IMAGE_FLOOR * max).clamp(min, max))
}

/// About how many texels a footprint meets: those inside, and those along its rim.
fn texels(footprint: &TexelFootprint) -> f64 {
    let side = (footprint.hi[0] - footprint.lo[0]).max(footprint.hi[1] - footprint.lo[1]);
    0.5 * footprint.double_area() + 2.0 * side
}

/// The mean over a footprint of up to about [`EXACT_TEXELS`].
fn exact(pyramid: &TexturePyramid<'_>, footprint: &TexelFootprint, brightest: f32) -> f64 {
    let texture = pyramid.texture();
    let filter = texture.filtering();
    let margin = match filter {
        Filter::Nearest => 0.0,
        Filter::Bilinear => 0.5,
    };
    let ends = core::array::from_fn(|k| {
        let first = footprint.origin[k] + floor_to_i64(footprint.lo[k] - margin);
        // One more, in case rounding takes a corner across the last line.
        [first, footprint.origin[k] + floor_to_i64(footprint.hi[k] + margin) + 1]
    });
    if let Some(window) = SmallWindow::new(texture, ends) {
        integrated(&window, filter, footprint, brightest)
    } else if let Some(window) = LargeWindow::new(texture, ends) {
        integrated(&window, filter, footprint, brightest)
    } else {
        looked_up(pyramid, footprint)
    }
}

/// The mean over a footprint whose texels are in a window, by Green's theorem.
///
/// With `F(x, y)` the integral of the image along the row `y`, from the window's left edge to `x`, the integral over the
/// footprint is that of `F dy` along its edges. Between grid lines `F` is a polynomial of at most third degree along an
/// edge, so that two points of Gauss's rule integrate it exactly.
///
/// Texels above `brightest` are not touched. They count as that, so that what they add and subtract again is not larger
/// than the result.
fn integrated<const CAPACITY: usize>(
    window: &Window<CAPACITY>,
    filter: Filter,
    footprint: &TexelFootprint,
    brightest: f32,
) -> f64 {
    // Nodes of the grid between whose lines the image is a polynomial: corners of texels, or their centers.
    let shift = match filter {
        Filter::Nearest => 0.0,
        Filter::Bilinear => 0.5,
    };
    let offset: [f64; 2] = core::array::from_fn(|k| (footprint.origin[k] - window.first[k]) as f64 - shift);
    let corners = footprint.corners.map(|corner| [corner[0] + offset[0], corner[1] + offset[1]]);
    let texel = |column: usize, row: usize| f64::from(window.texel(column, row).min(brightest));
    let [width, height] = window.size;
    // Integrals along the rows of nodes, up to each node.
    let mut before = [0.0; CAPACITY];
    for row in 0..height {
        let mut sum = 0.0;
        for column in 1..width {
            let (left, right) = (texel(column - 1, row), texel(column, row));
            sum += match filter {
                Filter::Nearest => left,
                Filter::Bilinear => 0.5 * (left + right),
            };
            before[row * width + column] = sum;
        }
    }
    let along_row = |row: usize, column: usize, x: f64| {
        let left = texel(column, row);
        let start = before[row * width + column];
        match filter {
            Filter::Nearest => start + x * left,
            Filter::Bilinear => start + x * (left + 0.5 * x * (texel(column + 1, row) - left)),
        }
    };
    let mut sum = 0.0;
    for (from, to) in [(0, 1), (1, 2), (2, 0)] {
        for_each_piece(corners[from], corners[to], |[column, row], p, q| {
            let middle = [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])];
            let column = (column.max(0) as usize).min(width.saturating_sub(1));
            let row = (row.max(0) as usize).min(height - 1);
            sum += (q[1] - p[1])
                * match filter {
                    Filter::Nearest => along_row(row, column, middle[0] - column as f64),
                    Filter::Bilinear => {
                        // A host may look half a texel beyond the footprint: the window holds the next node.
                        let (column, row) = (column.min(width.saturating_sub(2)), row.min(height.saturating_sub(2)));
                        let half = [0.5 * (q[0] - p[0]) * GAUSS, 0.5 * (q[1] - p[1]) * GAUSS];
                        let at = |sign: f64| {
                            let x = middle[0] + sign * half[0] - column as f64;
                            let y = middle[1] + sign * half[1] - row as f64;
                            (1.0 - y) * along_row(row, column, x) + y * along_row(row + 1, column, x)
                        };
                        0.5 * (at(-1.0) + at(1.0))
                    }
                };
        });
    }
    let [a, b, c] = corners;
    sum / (0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])))
}

/// Cuts an edge at the lines of the unit grid. Visits every piece that counts, with its square's corner.
#[inline(always)]
fn for_each_piece(from: [f64; 2], to: [f64; 2], mut visit: impl FnMut([i64; 2], [f64; 2], [f64; 2])) {
    let delta = [to[0] - from[0], to[1] - from[1]];
    if delta[1] == 0.0 {
        return;
    }
    let mut square = from.map(floor_to_i64);
    let last = to.map(floor_to_i64);
    let inverse = delta.map(|delta| if delta == 0.0 { 0.0 } else { 1.0 / delta });
    // Where along the edge the next line of each axis is crossed; never, after the last.
    let crossing = |square: [i64; 2], k: usize| {
        if square[k] == last[k] {
            return f64::INFINITY;
        }
        let line = square[k] + i64::from(delta[k] > 0.0);
        (line as f64 - from[k]) * inverse[k]
    };
    let mut next = [crossing(square, 0), crossing(square, 1)];
    let mut start = from;
    loop {
        let k = usize::from(next[1] < next[0]);
        if !(next[k] < 1.0) {
            visit(square, start, to);
            return;
        }
        let end = [from[0] + next[k] * delta[0], from[1] + next[k] * delta[1]];
        visit(square, start, end);
        start = end;
        square[k] += if delta[k] > 0.0 { 1 } else { -1 };
        next[k] = crossing(square, k);
    }
}

/// The mean of lookups at the centers of cells, in a level of the pyramid whose blocks are about as large as these
/// cells. Ignores the half texel that bilinear lookup blurs a block's edge by.
fn blocks(pyramid: &TexturePyramid<'_>, footprint: &TexelFootprint) -> f64 {
    let texture = pyramid.texture();
    let (size, wrap) = (texture.size(), texture.wrapping());
    let span = (footprint.hi[0] - footprint.lo[0]).max(footprint.hi[1] - footprint.lo[1]);
    let mut level = 0;
    while level < pyramid.top() && span > f64::from(IMAGE_SUBDIVISION << level) {
        level += 1;
    }
    mean_of_centers(footprint, |[x, y]| {
        let texel = |at: f64, k: usize| wrap_index(wrap[k], footprint.origin[k] + floor_to_i64(at), size[k]);
        f64::from(pyramid.block(level, texel(x, 0) >> level, texel(y, 1) >> level).mean)
    })
}

/// The mean of lookups, for footprints without area: a point or a line.
fn looked_up(pyramid: &TexturePyramid<'_>, footprint: &TexelFootprint) -> f64 {
    let [x0, y0] = footprint.origin.map(|origin| origin as f64);
    mean_of_centers(footprint, |[x, y]| pyramid.texture().value_at(x0 + x, y0 + y))
}

/// Mean over the centers of the cells of a regular subdivision.
fn mean_of_centers(footprint: &TexelFootprint, value: impl Fn([f64; 2]) -> f64) -> f64 {
    let [a, b, c] = footprint.corners;
    let mut sum = 0.0;
    for [b1, b2] in subdivision_centers(IMAGE_SUBDIVISION) {
        sum += value([0, 1].map(|k| a[k] + b1 * (b[k] - a[k]) + b2 * (c[k] - a[k])));
    }
    sum / f64::from(IMAGE_SUBDIVISION * IMAGE_SUBDIVISION)
}

#[cfg(test)]
mod tests;
