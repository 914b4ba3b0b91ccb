//! The average of a texture over a footprint.

use crate::blas::build::footprint::TexelFootprint;
use crate::blas::build::pyramid::TexturePyramid;
use crate::blas::build::texture::wrap_index;
use crate::blas::build::touched::TexelRange;
use crate::blas::build::window::{LargeWindow, SmallWindow, Window};
use crate::blas::node::storable;
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
/// *Measured* (CONSTANTS.md, "Constants of the trees over textures"): half or twice the value changes the variance by
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
/// [`MAX_AVERAGE`](crate::blas::node::MAX_AVERAGE). `window` is the footprint's
/// [`window`](crate::blas::build::touched::window).
///
/// It is zero exactly where the whole touched range is black. Otherwise it is a normal number between the range's
/// ends, and exact (up to rounding, and up to a floor of a millionth of the brightest texel) for footprints of up to
/// about 48 texels.
pub(super) fn average(
    pyramid: &TexturePyramid<'_>,
    footprint: &TexelFootprint,
    range: TexelRange,
    window: Option<&SmallWindow>,
) -> f32 {
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
        exact(pyramid, footprint, range.max, window)
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
fn exact(
    pyramid: &TexturePyramid<'_>,
    footprint: &TexelFootprint,
    brightest: f32,
    window: Option<&SmallWindow>,
) -> f64 {
    let texture = pyramid.texture();
    let is_nearest = texture.filtering() == Filter::Nearest;
    if let Some(window) = window {
        return integrated(window, footprint, brightest, is_nearest);
    }
    let margin = if is_nearest { 0.0 } else { 0.5 };
    let ends = core::array::from_fn(|k| {
        let end = |at: f64| footprint.origin[k] + floor_to_i64(at);
        [end(footprint.lo[k] - margin), end(footprint.hi[k] + margin)]
    });
    match LargeWindow::new(texture, ends) {
        Some(window) => integrated(&window, footprint, brightest, is_nearest),
        None => looked_up(pyramid, footprint),
    }
}

/// A place of the grid between whose lines the image is a polynomial: the corner of a texel, or its center.
#[derive(Clone, Copy, Default)]
struct GridNode {
    /// The integral along the row from the window's first node.
    before: f64,
    /// The image's value to the right of the node.
    value: f64,
    /// Half of what the image gains up to the next node.
    half_gain: f64,
}

impl GridNode {
    /// The integral along the row up to a place `x` behind the node.
    #[inline(always)]
    fn integral(&self, x: f64) -> f64 {
        self.before + x * (self.value + x * self.half_gain)
    }
}

/// The mean over a footprint whose texels are in a window.
fn integrated<const CAPACITY: usize>(
    window: &Window<CAPACITY>,
    footprint: &TexelFootprint,
    brightest: f32,
    is_nearest: bool,
) -> f64 {
    if is_nearest {
        integrated_along_edges::<CAPACITY, true>(window, footprint, brightest)
    } else {
        integrated_along_edges::<CAPACITY, false>(window, footprint, brightest)
    }
}

/// The mean over a footprint whose texels are in a window, by Green's theorem.
///
/// With `F(x, y)` the integral of the image along the row `y`, from the window's left edge to `x`, the integral over
/// the footprint is that of `F dy` along its edges. Between grid lines `F` is a polynomial of at most third degree
/// along an edge, so that two points of Gauss's rule integrate it exactly; with nearest lookup it is linear, and its
/// middle does.
///
/// Texels above `brightest` are not touched. They count as that, so that what they add and subtract again is not larger
/// than the result.
fn integrated_along_edges<const CAPACITY: usize, const NEAREST: bool>(
    window: &Window<CAPACITY>,
    footprint: &TexelFootprint,
    brightest: f32,
) -> f64 {
    let shift = if NEAREST { 0.0 } else { 0.5 };
    let offset: [f64; 2] = core::array::from_fn(|k| (footprint.origin[k] - window.first[k]) as f64 - shift);
    let corners = footprint.corners.map(|corner| [corner[0] + offset[0], corner[1] + offset[1]]);
    let [width, height] = window.size;
    let mut nodes = [GridNode::default(); CAPACITY];
    for (row, nodes) in nodes.chunks_exact_mut(width).take(height).enumerate() {
        let texels = window.row(row);
        let clamped = |texel: f32| f64::from(if texel < brightest { texel } else { brightest });
        let (mut before, mut value) = (0.0, clamped(texels[0]));
        for (column, node) in nodes.iter_mut().enumerate() {
            let next = clamped(texels[(column + 1).min(width - 1)]);
            let half_gain = if NEAREST { 0.0 } else { 0.5 * (next - value) };
            *node = GridNode { before, value, half_gain };
            before += value + half_gain;
            value = next;
        }
    }
    // Rounding could take a corner across the window's rim; polynomials hold a little beyond their square, too.
    let last = [width, height].map(|n| n.saturating_sub(if NEAREST { 1 } else { 2 }) as i64);
    let mut sum = 0.0;
    for (from, to) in [(0, 1), (1, 2), (2, 0)] {
        for_each_piece(corners[from], corners[to], |[column, row], p, q| {
            let [column, row] = [column.clamp(0, last[0]), row.clamp(0, last[1])];
            let at = row as usize * width + column as usize;
            let (x, y) = (0.5 * (p[0] + q[0]) - column as f64, 0.5 * (p[1] + q[1]) - row as f64);
            let mean = if NEAREST {
                nodes[at].integral(x)
            } else {
                // The next row is in the window, which holds what bilinear lookup touches.
                let (above, below) = (&nodes[at], &nodes[(at + width).min(CAPACITY - 1)]);
                let (dx, dy) = (0.5 * GAUSS * (q[0] - p[0]), 0.5 * GAUSS * (q[1] - p[1]));
                let along = |x: f64, y: f64| (1.0 - y) * above.integral(x) + y * below.integral(x);
                0.5 * (along(x - dx, y - dy) + along(x + dx, y + dy))
            };
            sum += (q[1] - p[1]) * mean;
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
