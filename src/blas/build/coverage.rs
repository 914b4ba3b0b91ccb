//! The average of a texture over a footprint.

use crate::blas::build::footprint::TexelFootprint;
use crate::blas::build::pyramid::TexturePyramid;
use crate::blas::build::texture::wrap_index;
use crate::blas::build::touched::TexelRange;
use crate::blas::node::storable;
use crate::geometry::{self, subdivision_centers};
use crate::math::floor64;
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

/// A footprint, or the part of one in a square of texels. A triangle cut by four lines has at most seven vertices;
/// rounding could add one at each cut.
type FootprintPolygon = geometry::Polygon<f64, 12>;

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
        match pyramid.texture().filtering() {
            Filter::Nearest => nearest(pyramid, footprint),
            Filter::Bilinear => bilinear(pyramid, footprint),
        }
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

/// Splits the polygon by unit squares and visits each piece with its square's corner.
fn squares(polygon: FootprintPolygon, mut each: impl FnMut([f64; 2], &FootprintPolygon)) {
    let span = |polygon: &FootprintPolygon, k: usize| {
        let (lo, hi) = extent(polygon, k);
        // An empty polygon spans nothing.
        if lo <= hi { (floor64(lo) as i64, floor64(hi) as i64) } else { (0, -1) }
    };
    let (y0, y1) = span(&polygon, 1);
    for y in y0..=y1 {
        let row = strip(&polygon, 1, y as f64, (y + 1) as f64);
        let (x0, x1) = span(&row, 0);
        for x in x0..=x1 {
            each([x as f64, y as f64], &strip(&row, 0, x as f64, (x + 1) as f64));
        }
    }
}

/// Ends of a polygon along an axis.
fn extent(polygon: &FootprintPolygon, axis: usize) -> (f64, f64) {
    let ends = (f64::INFINITY, f64::NEG_INFINITY);
    polygon.vertices().iter().fold(ends, |(lo, hi), v| (v[axis].min(lo), v[axis].max(hi)))
}

/// The part of a polygon between two parallels: `lo <= coordinate <= hi` along an axis.
fn strip(polygon: &FootprintPolygon, axis: usize, lo: f64, hi: f64) -> FootprintPolygon {
    let (min, max) = extent(polygon, axis);
    let mut out = *polygon;
    if min < lo {
        out = out.clip_axis(axis, lo, 1.0);
    }
    if max > hi {
        out = out.clip_axis(axis, hi, -1.0);
    }
    out
}

/// Area, not negative.
fn area(polygon: &FootprintPolygon) -> f64 {
    polygon.fan().map(|(_, double)| 0.5 * double.abs()).sum()
}

/// Integrals of the four bilinear weights `(1-x)(1-y)`, `x(1-y)`, `(1-x)y`, `xy` of the unit square at `corner`, over
/// a polygon inside of it.
///
/// The weights are quadratic, so that the rule of the three edge midpoints is exact on each triangle of a fan.
fn bilinear_weights(polygon: &FootprintPolygon, corner: [f64; 2]) -> [f64; 4] {
    let mut weights = [0.0; 4];
    for ([a, b, c], double) in polygon.fan() {
        let area = 0.5 * double.abs();
        for (p, q) in [(a, b), (b, c), (c, a)] {
            let x = 0.5 * (p[0] + q[0]) - corner[0];
            let y = 0.5 * (p[1] + q[1]) - corner[1];
            let third = area / 3.0;
            weights[0] += third * (1.0 - x) * (1.0 - y);
            weights[1] += third * x * (1.0 - y);
            weights[2] += third * (1.0 - x) * y;
            weights[3] += third * x * y;
        }
    }
    // Rounding at the rim could leave a weight just below zero.
    weights.map(|w| w.max(0.0))
}

/// Texels weighted by the area that the footprint covers of each.
fn nearest(pyramid: &TexturePyramid<'_>, footprint: &TexelFootprint) -> f64 {
    let texture = pyramid.texture();
    let (mut sum, mut total) = (0.0, 0.0);
    squares(FootprintPolygon::new(footprint.corners), |corner, piece| {
        let covered = area(piece);
        let [x, y] = core::array::from_fn(|k| footprint.origin[k] + corner[k] as i64);
        sum += covered * f64::from(texture.fetch(x, y));
        total += covered;
    });
    sum / total
}

/// The integral of the interpolated texture, one patch between four texel centers at a time.
fn bilinear(pyramid: &TexturePyramid<'_>, footprint: &TexelFootprint) -> f64 {
    let texture = pyramid.texture();
    let (mut sum, mut total) = (0.0, 0.0);
    // Patches have their corners at texel centers.
    let shifted = footprint.corners.map(|[x, y]| [x - 0.5, y - 0.5]);
    squares(FootprintPolygon::new(shifted), |corner, piece| {
        let weights = bilinear_weights(piece, corner);
        let [x, y]: [i64; 2] = core::array::from_fn(|k| footprint.origin[k] + corner[k] as i64);
        let texels = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
        for (weight, (i, j)) in weights.into_iter().zip(texels) {
            sum += weight * f64::from(texture.fetch(i, j));
            total += weight;
        }
    });
    sum / total
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
        let texel = |at: f64, k: usize| wrap_index(wrap[k], footprint.origin[k] + floor64(at) as i64, size[k]);
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
