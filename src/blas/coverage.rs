//! The average of a texture over a footprint.

use crate::blas::footprint::Footprint;
use crate::blas::polygon::Polygon;
use crate::blas::pyramid::Prepared;
use crate::blas::texture::wrap_index;
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

/// Larger ones are looked up in so many cells along an edge.
const SUBDIVISION: u32 = 8;

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

/// The mean of look-ups at the centres of cells, in a level of the pyramid whose blocks are about as large as these
/// cells. Ignores the half texel that bilinear look-up blurs a block's edge by.
fn blocks(prepared: &Prepared<'_>, footprint: &Footprint) -> f64 {
    let texture = prepared.texture();
    let (size, wrap) = (texture.size(), texture.wrapping());
    let span = (footprint.hi[0] - footprint.lo[0]).max(footprint.hi[1] - footprint.lo[1]);
    let mut level = 0;
    while level < prepared.top() && span > f64::from(SUBDIVISION << level) {
        level += 1;
    }
    mean_of_centres(footprint, |[x, y]| {
        let texel = |at: f64, k: usize| wrap_index(wrap[k], footprint.origin[k] + floor64(at) as i64, size[k]);
        f64::from(prepared.block(level, texel(x, 0) >> level, texel(y, 1) >> level).mean)
    })
}

/// The mean of look-ups, for footprints without area: a point or a line.
fn looked_up(prepared: &Prepared<'_>, footprint: &Footprint) -> f64 {
    let [x0, y0] = footprint.origin.map(|origin| origin as f64);
    mean_of_centres(footprint, |[x, y]| prepared.texture().value_at(x0 + x, y0 + y))
}

/// Mean over the centres of the cells of a regular subdivision.
fn mean_of_centres(footprint: &Footprint, value: impl Fn([f64; 2]) -> f64) -> f64 {
    let [a, b, c] = footprint.corners;
    let mut sum = 0.0;
    for i in 0..SUBDIVISION {
        for j in 0..SUBDIVISION - i {
            for third in 1..=2 {
                if third == 2 && i + j == SUBDIVISION - 1 {
                    continue;
                }
                let [b1, b2] = [i, j].map(|i| f64::from(3 * i + third) / f64::from(3 * SUBDIVISION));
                sum += value([0, 1].map(|k| a[k] + b1 * (b[k] - a[k]) + b2 * (c[k] - a[k])));
            }
        }
    }
    sum / f64::from(SUBDIVISION * SUBDIVISION)
}

#[cfg(test)]
mod tests;
