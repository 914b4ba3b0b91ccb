//! The average of a texture over a footprint.

use smallvec::SmallVec;

use crate::blas::axis::{Stretch, stretches};
use crate::blas::footprint::Footprint;
use crate::blas::polygon::Polygon;
use crate::blas::pyramid::Prepared;
use crate::blas::touched::Range;
use crate::math::floor64;
use crate::record::Filter;

/// The largest average that is stored. Larger ones only steer sampling, and their sums must not overflow.
pub(crate) const MAX_AVERAGE: f32 = 1e30;

/// A positive average is at least this share of the brightest texel that is touched.
///
/// It stands in for what rounding, and the blocks of a large footprint, can miss.
const FLOOR: f64 = 1e-6;

/// Footprints of up to about this many texels are integrated exactly. Leaves are far smaller, unless a triangle ran
/// out of its budget.
const EXACT_TEXELS: f64 = 48.0;

/// Larger ones are integrated over a level of the pyramid that has up to this many blocks to a side.
const BLOCKS: f64 = 8.0;

/// A triangle is taken for a line when its area is this share of its longest edge's square.
const LINE: f64 = 1e-9;

/// The average over a footprint in which look-ups lie in `range`, from 0 to [`MAX_AVERAGE`].
///
/// It is zero exactly where the whole touched range is black. Otherwise it is a normal number between the range's
/// ends, and exact (up to rounding, and up to a floor of a millionth of the brightest texel) for footprints of up to
/// about 48 texels.
pub(crate) fn average(prepared: &Prepared<'_>, footprint: &Footprint, range: Range) -> f32 {
    if range.is_constant() {
        return storable(f64::from(range.max));
    }
    let longest = footprint.corners.iter().fold(0.0f64, |m, p| {
        let q = footprint.corners[0];
        m.max((p[0] - q[0]) * (p[0] - q[0]) + (p[1] - q[1]) * (p[1] - q[1]))
    });
    let line = footprint.double_area() <= LINE * longest;
    let mean = if line {
        looked_up(prepared, footprint)
    } else if texels(footprint) > EXACT_TEXELS {
        blocks(prepared, footprint)
    } else {
        match prepared.texture().filtering() {
            Filter::Nearest => nearest(prepared, footprint),
            Filter::Bilinear => bilinear(prepared, footprint),
        }
    };
    let (min, max) = (f64::from(range.min), f64::from(range.max));
    // NaN, from a footprint that lost its area to rounding, becomes the floor here.
    storable(mean.max(FLOOR * max).clamp(min, max))
}

/// About how many texels a footprint meets: those inside, and those along its rim.
fn texels(footprint: &Footprint) -> f64 {
    let side = (footprint.hi[0] - footprint.lo[0]).max(footprint.hi[1] - footprint.lo[1]);
    0.5 * footprint.double_area() + 2.0 * side
}

/// Narrows to what nodes hold: zero, or a normal `f32` up to [`MAX_AVERAGE`].
pub(crate) fn storable(value: f64) -> f32 {
    if value > 0.0 { (value as f32).clamp(f32::MIN_POSITIVE, MAX_AVERAGE) } else { 0.0 }
}

/// Splits the polygon by unit squares and hands each piece over with its square's corner.
fn squares(polygon: Polygon, mut each: impl FnMut([f64; 2], &Polygon)) {
    let span = |polygon: &Polygon, k: usize| {
        let (lo, hi) = polygon
            .vertices()
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (v[k].min(lo), v[k].max(hi)));
        // An empty polygon spans nothing.
        if lo <= hi { (floor64(lo) as i64, floor64(hi) as i64) } else { (0, -1) }
    };
    let (y0, y1) = span(&polygon, 1);
    for y in y0..=y1 {
        let row = polygon.clip(1, y as f64, (y + 1) as f64);
        let (x0, x1) = span(&row, 0);
        for x in x0..=x1 {
            each([x as f64, y as f64], &row.clip(0, x as f64, (x + 1) as f64));
        }
    }
}

/// Texels weighted by the area that the footprint covers of each.
fn nearest(prepared: &Prepared<'_>, footprint: &Footprint) -> f64 {
    let texture = prepared.texture();
    let (mut sum, mut total) = (0.0, 0.0);
    squares(Polygon::triangle(footprint.corners), |corner, piece| {
        let area = piece.area();
        let [x, y] = core::array::from_fn(|k| footprint.origin[k] + corner[k] as i64);
        sum += area * f64::from(texture.fetch(x, y));
        total += area;
    });
    sum / total
}

/// The integral of the interpolated texture, one patch between four texel centres at a time.
fn bilinear(prepared: &Prepared<'_>, footprint: &Footprint) -> f64 {
    let texture = prepared.texture();
    let (mut sum, mut total) = (0.0, 0.0);
    // Patches have their corners at texel centres.
    let shifted = footprint.corners.map(|[x, y]| [x - 0.5, y - 0.5]);
    squares(Polygon::triangle(shifted), |corner, piece| {
        let weights = piece.bilinear_weights(corner);
        let [x, y]: [i64; 2] = core::array::from_fn(|k| footprint.origin[k] + corner[k] as i64);
        let texels = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
        for (weight, (i, j)) in weights.into_iter().zip(texels) {
            sum += weight * f64::from(texture.fetch(i, j));
            total += weight;
        }
    });
    sum / total
}

/// The mean of look-ups at the centres of 64 cells, for footprints without area: a point or a line.
fn looked_up(prepared: &Prepared<'_>, footprint: &Footprint) -> f64 {
    let [a, b, c] = footprint.corners;
    let mut sum = 0.0;
    let mut count = 0.0;
    for i in 0..8 {
        for j in 0..8 - i {
            for third in [1.0, 2.0] {
                if third == 2.0 && i + j == 7 {
                    continue;
                }
                let (b1, b2) = ((f64::from(i) + third / 3.0) / 8.0, (f64::from(j) + third / 3.0) / 8.0);
                let at = |k: usize| a[k] + b1 * (b[k] - a[k]) + b2 * (c[k] - a[k]) + footprint.origin[k] as f64;
                sum += prepared.texture().value_at(at(0), at(1));
                count += 1.0;
            }
        }
    }
    sum / count
}

/// A block of the pyramid along one axis, and what it covers.
struct Piece {
    block: u32,
    /// Texels of the block that count.
    texels: [u32; 2],
    /// Set if a single texel holds for the whole piece.
    held: Option<u32>,
    interval: [f64; 2],
}

/// The integral over a level of the pyramid as if its blocks were texels. Ignores the half texel that bilinear
/// look-up blurs a block's edge by. A footprint over many copies of the image becomes its box.
fn blocks(prepared: &Prepared<'_>, footprint: &Footprint) -> f64 {
    let texture = prepared.texture();
    let size = texture.size();
    let columns_and_rows: [SmallVec<[Stretch; 4]>; 2] = core::array::from_fn(|k| {
        let from = footprint.origin[k] + floor64(footprint.lo[k]) as i64;
        let to = footprint.origin[k] + floor64(footprint.hi[k]) as i64;
        stretches(texture.wrapping()[k], size[k], from, to, footprint.origin[k])
    });
    let span: [f64; 2] = core::array::from_fn(|k| (footprint.hi[k] - footprint.lo[k]).min(4.0 * f64::from(size[k])));
    let mut level = 0;
    while level < prepared.top() && span[0].max(span[1]) > BLOCKS * f64::from(1 << level) {
        level += 1;
    }
    let as_box = columns_and_rows.iter().flatten().any(Stretch::is_all_periods);
    let [columns, rows] = [0, 1].map(|k| pieces(&columns_and_rows[k], level, [footprint.lo[k], footprint.hi[k]]));
    let polygon = Polygon::triangle(footprint.corners);
    let (mut sum, mut total) = (0.0, 0.0);
    for row in &rows {
        let [y0, y1] = row.interval;
        let strip = if as_box { polygon } else { polygon.clip(1, y0, y1) };
        for column in &columns {
            let [x0, x1] = column.interval;
            let area = if as_box { (x1 - x0) * (y1 - y0) } else { strip.clip(0, x0, x1).area() };
            sum += area * mean(prepared, level, column, row);
            total += area;
        }
    }
    sum / total
}

/// The mean over a block. Beyond a clamped edge, that over up to eight texels of the edge.
fn mean(prepared: &Prepared<'_>, level: u32, column: &Piece, row: &Piece) -> f64 {
    let texel = |x: u32, y: u32| f64::from(prepared.texture().texel(x, y));
    let along = |[first, last]: [u32; 2], at: &dyn Fn(u32) -> f64| {
        let count = (last - first + 1).min(8);
        let texel = |i: u32| first + (2 * i + 1) * (last - first + 1) / (2 * count);
        (0..count).map(|i| at(texel(i))).sum::<f64>() / f64::from(count)
    };
    match (column.held, row.held) {
        (None, None) => f64::from(prepared.block(level, column.block, row.block).mean),
        (Some(x), None) => along(row.texels, &|y| texel(x, y)),
        (None, Some(y)) => along(column.texels, &|x| texel(x, y)),
        (Some(x), Some(y)) => texel(x, y),
    }
}

fn pieces(stretches: &[Stretch], level: u32, span: [f64; 2]) -> SmallVec<[Piece; 24]> {
    let mut out = SmallVec::new();
    for stretch in stretches {
        for block in stretch.first >> level..=stretch.last >> level {
            let first = stretch.first.max(block << level);
            let last = stretch.last.min((block << level) + ((1 << level) - 1));
            let interval = if stretch.is_all_periods() {
                // Only the share of each block counts.
                [0.0, f64::from(last - first + 1)]
            } else {
                let [lo, hi] = stretch.interval(first, last);
                let lo = lo.max(span[0]);
                // A sliver still has a width here.
                [lo, hi.min(span[1]).max(lo + 1e-6)]
            };
            out.push(Piece { block, texels: [first, last], held: stretch.held_texel(), interval });
        }
    }
    out
}

#[cfg(test)]
mod tests;
