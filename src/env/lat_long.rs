//! Exact averages of a latitude-longitude image over the texels of an equal-area one.
//!
//! In one octant of the equal-area map, let r be the distance from the pole's point along the axes, |u| + |v| in
//! the upper hemisphere, and f the azimuth in quarter turns. A parallel is r = √2 sin(θ/2), a line; a meridian is
//! a ray of constant f from the pole's point. So a cell of the image, cut at the equator and at the quarter
//! meridians, has straight edges in the map, and what it shares with a texel is a convex polygon. Its area is
//! the solid angle that they share.
//!
//! Coordinates here are `[r, b]` with b = r f, a shear of the octant's triangle that keeps areas: a parallel is
//! `r = R`, a meridian is `b = F r`.

use super::source::EnvironmentSource;
use crate::geometry;
use crate::math::cos64;
use alloc::vec::Vec;
use core::f64::consts::{FRAC_PI_2, SQRT_2};

/// Share of a texel below which a polygon is taken for a rounding error of a shared edge.
const SLIVER: f64 = 1e-12;

/// A texel or a part of one. A square that is cut twice along each of two lines has at most 8 vertices.
type TexelPolygon = geometry::Polygon<f64, 12>;

/// A latitude-longitude source, ready to be averaged over texels.
pub(super) struct LatLong<'a> {
    source: &'a EnvironmentSource,
    /// Radii of the upper ends of the rows of a hemisphere, from the pole to the equator.
    radii: Vec<f64>,
    columns: usize,
    rows: usize,
}

/// Where an octant lies in the image.
#[derive(Clone, Copy)]
struct Octant {
    lower: bool,
    /// Quarter turns of the image before the octant's `f = 0`: 0 or 2.
    base: f64,
    /// Whether columns are counted from the image's right edge.
    mirrored: bool,
}

/// Sums over the cells of one texel.
#[derive(Default)]
struct Sums {
    flux: f64,
    area: f64,
}

impl<'a> LatLong<'a> {
    pub(super) fn new(source: &'a EnvironmentSource) -> Self {
        let (columns, rows) = (source.columns(), source.rows());
        let half = rows.div_ceil(2);
        // √2 sin(θ/2) with θ = π j / rows; an odd middle row ends at the equator, r = 1.
        let radius = |j: usize| SQRT_2 * cos64(FRAC_PI_2 * (1.0 - j as f64 / rows as f64));
        let radii = (1..half).map(radius).chain([1.0]).collect();
        Self { source, radii, columns, rows }
    }

    /// Mean radiance over texel `(x, y)` of an equal-area image of `size` texels a side, an even number.
    pub(super) fn texel(&self, x: usize, y: usize, size: usize) -> f64 {
        let half = size / 2;
        let (right, top) = (x >= half, y >= half);
        // Texels from the center lines.
        let k = if right { x - half } else { half - 1 - x };
        let l = if top { y - half } else { half - 1 - y };
        // Azimuth runs clockwise in the image, φ = -2πu: the quadrants x, -y and -x, y have u growing with f.
        let octant = |lower| Octant { lower, base: if right { 0.0 } else { 2.0 }, mirrored: right == top };
        let side = 1.0 / half as f64;
        let upper = |i: usize, j: usize| [(k + l + i + j) as f64 * side, (l + j) as f64 * side];
        // The lower hemisphere is mirrored at the diamond: distances from the square's edges, axes exchanged.
        let lower = |i: usize, j: usize| [(size - k - l - i - j) as f64 * side, (half - k - i) as f64 * side];
        let mut sums = Sums::default();
        let sliver = SLIVER * side * side;
        if k + l + 2 <= half {
            let polygon = TexelPolygon::new([upper(0, 0), upper(1, 0), upper(1, 1), upper(0, 1)]);
            self.add_octant(polygon, octant(false), sliver, &mut sums);
        } else if k + l >= half {
            let polygon = TexelPolygon::new([lower(0, 0), lower(1, 0), lower(1, 1), lower(0, 1)]);
            self.add_octant(polygon, octant(true), sliver, &mut sums);
        } else {
            // The equator is this texel's diagonal.
            let polygon = TexelPolygon::new([upper(0, 0), upper(1, 0), upper(0, 1)]);
            self.add_octant(polygon, octant(false), sliver, &mut sums);
            let polygon = TexelPolygon::new([lower(1, 1), lower(0, 1), lower(1, 0)]);
            self.add_octant(polygon, octant(true), sliver, &mut sums);
        }
        // By the summed area, not the texel's: a uniform region keeps its value to the last bit.
        if sums.area > 0.0 { sums.flux / sums.area } else { 0.0 }
    }

    /// Cuts a polygon of one octant along the parallels.
    fn add_octant(&self, polygon: TexelPolygon, octant: Octant, sliver: f64, sums: &mut Sums) {
        let (low, high) = range(polygon.vertices().iter().map(|p| p[0]));
        let mut rest = polygon;
        let mut row = self.radii.partition_point(|&r| r <= low).min(self.radii.len() - 1);
        while row + 1 < self.radii.len() && self.radii[row] < high {
            let radius = self.radii[row];
            let (part, further) = rest.split(|[r, _]| r - radius);
            self.add_row(part, row, octant, sliver, sums);
            rest = further;
            row += 1;
        }
        self.add_row(rest, row, octant, sliver, sums);
    }

    /// Cuts a polygon of one row along the meridians.
    fn add_row(&self, polygon: TexelPolygon, row: usize, octant: Octant, sliver: f64, sums: &mut Sums) {
        if area(&polygon) <= sliver {
            return;
        }
        let row = if octant.lower { self.rows - 1 - row } else { row };
        // The pole belongs to all meridians: the other vertices tell which ones.
        let (low, high) = range(polygon.vertices().iter().filter(|p| p[0] > 0.0).map(|p| p[1] / p[0]));
        let per_column = 4.0 / self.columns as f64;
        let mut rest = polygon;
        let mut column = (((octant.base + low) / per_column) as usize).min(self.columns - 1);
        loop {
            let end = (column + 1) as f64 * per_column - octant.base;
            let last = column + 1 >= self.columns || end >= high;
            let part = if last {
                rest
            } else {
                let (part, further) = rest.split(|[r, b]| b - end * r);
                rest = further;
                part
            };
            let shared = area(&part);
            if shared > sliver {
                let column = if octant.mirrored { self.columns - 1 - column } else { column };
                sums.flux += shared * self.source.cell(column, row);
                sums.area += shared;
            }
            if last {
                return;
            }
            column += 1;
        }
    }
}

/// Returns the area of a polygon in either sense of rotation.
fn area(polygon: &TexelPolygon) -> f64 {
    0.5 * polygon.fan().map(|(_, double)| double).sum::<f64>().abs()
}

/// Smallest and largest of some numbers.
fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
}
