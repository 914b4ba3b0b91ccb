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

//!
//! A texel's edges are cut at parallels and meridians. Every piece adds to the area of its own cell what lies between
//! it and the cell's meridian of lower azimuth, and to all cells of its row with less azimuth their full width: the
//! coverage of a scan converter. What is added on one side of the texel is taken away on the other.

use super::source::EnvironmentSource;
use crate::math::cos64;
use alloc::vec::Vec;
use core::f64::consts::{FRAC_PI_2, SQRT_2};

/// Share of a texel below which an area is taken for a rounding error of a shared edge. *Proved*: coordinates are
/// rounded to 1e-16 of the map, which is 1e-12 of a texel of the largest one.
///
/// Larger: lit texels could be taken for black. Smaller: black ones could be taken for lit.
const SLIVER: f64 = 1e-12;

/// A latitude-longitude source, ready to be averaged over texels.
pub(super) struct LatLong<'a> {
    source: &'a EnvironmentSource<'a>,
    /// Radii of the upper ends of the rows of a hemisphere, from the pole to the equator.
    radii: Vec<f64>,
    /// Row of every radius that is a whole number of texels.
    row_of_line: Vec<u32>,
    columns: usize,
    rows: usize,
    /// Texels a side of the equal-area image, an even number.
    size: usize,
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

/// A corner of a texel, in texels from the pole's point: a whole radius and a whole `b`.
type Corner = [usize; 2];

/// A corner, and the cell that it lies in.
#[derive(Clone, Copy, Default)]
struct PlacedCorner {
    point: [f64; 2],
    row: usize,
    column: usize,
}

/// How a texel covers the cells of one octant.
#[derive(Default)]
pub(super) struct CellCoverage {
    /// By rows: what edges add to the area of a cell, and to that of the cells before it, for a width of one.
    cells: Vec<[f64; 2]>,
}

/// Sums over the cells of one texel.
#[derive(Default)]
struct Sums {
    flux: f64,
    area: f64,
}

impl<'a> LatLong<'a> {
    pub(super) fn new(source: &'a EnvironmentSource<'a>, size: usize) -> Self {
        let (columns, rows) = (source.columns(), source.rows());
        let half = rows.div_ceil(2);
        // √2 sin(θ/2) with θ = π j / rows; an odd middle row ends at the equator, r = 1.
        let radius = |j: usize| SQRT_2 * cos64(FRAC_PI_2 * (1.0 - j as f64 / rows as f64));
        let radii: Vec<f64> = (1..half).map(radius).chain([1.0]).collect();
        let side = 2.0 / size as f64;
        let row_of_line = |line: usize| {
            let radius = line as f64 * side;
            radii.partition_point(|&r| r <= radius).min(radii.len() - 1) as u32
        };
        let row_of_line = (0..=size / 2).map(row_of_line).collect();
        Self { source, radii, row_of_line, columns, rows, size }
    }

    /// Mean radiance over texel `(x, y)` of the equal-area image.
    pub(super) fn texel(&self, coverage: &mut CellCoverage, x: usize, y: usize) -> f64 {
        let size = self.size;
        let half = size / 2;
        let (right, top) = (x >= half, y >= half);
        // Texels from the center lines.
        let k = if right { x - half } else { half - 1 - x };
        let l = if top { y - half } else { half - 1 - y };
        // Azimuth runs clockwise in the image, φ = -2πu: the quadrants x, -y and -x, y have u growing with f.
        let octant = |lower| Octant { lower, base: if right { 0.0 } else { 2.0 }, mirrored: right == top };
        let upper = |i: usize, j: usize| [k + l + i + j, l + j];
        // The lower hemisphere is mirrored at the diamond: distances from the square's edges, axes exchanged.
        let lower = |i: usize, j: usize| [size - k - l - i - j, half - k - i];
        let mut sums = Sums::default();
        let mut add = |lower: bool, corners: &[Corner]| self.add_octant(coverage, corners, octant(lower), &mut sums);
        if k + l + 2 <= half {
            add(false, &[upper(0, 0), upper(1, 0), upper(1, 1), upper(0, 1)]);
        } else if k + l >= half {
            add(true, &[lower(0, 0), lower(1, 0), lower(1, 1), lower(0, 1)]);
        } else {
            // The equator is this texel's diagonal.
            add(false, &[upper(0, 0), upper(1, 0), upper(0, 1)]);
            add(true, &[lower(1, 1), lower(0, 1), lower(1, 0)]);
        }
        // By the summed area, not the texel's: a uniform region keeps its value to the last bit.
        if sums.area > 0.0 { sums.flux / sums.area } else { 0.0 }
    }

    /// Adds the cells under a convex polygon of one octant, of at most four corners.
    fn add_octant(&self, coverage: &mut CellCoverage, corners: &[Corner], octant: Octant, sums: &mut Sums) {
        let side = 2.0 / self.size as f64;
        let columns_a_quarter = 0.25 * self.columns as f64;
        let mut placed = [PlacedCorner::default(); 4];
        let (mut rows, mut columns) = ([usize::MAX, 0], [usize::MAX, 0]);
        for (placed, corner) in placed.iter_mut().zip(corners) {
            let row = self.row_of_line[corner[0]] as usize;
            rows = [rows[0].min(row), rows[1].max(row)];
            let mut column = 0;
            if corner[0] > 0 {
                let turns = octant.base + corner[1] as f64 / corner[0] as f64;
                column = ((turns * columns_a_quarter) as usize).min(self.columns - 1);
                columns = [columns[0].min(column), columns[1].max(column)];
            }
            *placed = PlacedCorner { point: corner.map(|n| n as f64 * side), row, column };
        }
        let width = columns[1] - columns[0] + 1;
        coverage.cells.clear();
        coverage.cells.resize(width * (rows[1] - rows[0] + 1), [0.0; 2]);
        let placed = &mut placed[..corners.len()];
        for i in 0..placed.len() {
            let (mut from, mut to) = (placed[i], placed[(i + 1) % corners.len()]);
            // The pole belongs to all meridians: an edge that ends there runs along one.
            if from.point[0] == 0.0 {
                from.column = to.column;
            } else if to.point[0] == 0.0 {
                to.column = from.column;
            }
            self.add_edge(&mut coverage.cells, from, to, octant, [rows[0], columns[0], width]);
        }
        // The upper hemisphere's corners run the other way around.
        let sign = if octant.lower { 1.0 } else { -1.0 };
        let sliver = SLIVER * side * side;
        let cell_width = sign / columns_a_quarter;
        for (row, cells) in (rows[0]..).zip(coverage.cells.chunks_exact(width)) {
            let row = if octant.lower { self.rows - 1 - row } else { row };
            let mut before = 0.0;
            for (column, [own, all_before]) in (columns[0]..columns[1] + 1).zip(cells).rev() {
                let shared = sign * own + before * cell_width;
                before += all_before;
                if shared > sliver {
                    let column = if octant.mirrored { self.columns - 1 - column } else { column };
                    sums.flux += shared * self.source.cell(column, row);
                    sums.area += shared;
                }
            }
        }
    }

    /// Cuts an edge at parallels and meridians, and adds the area under its pieces. `window` has the first row and
    /// column of the cells, and the number of their columns.
    #[inline]
    fn add_edge(
        &self,
        cells: &mut [[f64; 2]],
        from: PlacedCorner,
        to: PlacedCorner,
        octant: Octant,
        window: [usize; 3],
    ) {
        let [r, b] = from.point;
        let [dr, db] = [to.point[0] - r, to.point[1] - b];
        // The equator.
        if dr == 0.0 {
            return;
        }
        let per_column = 4.0 / self.columns as f64;
        let meridian = |column: usize| column as f64 * per_column - octant.base;
        let (mut row, mut column) = (from.row, from.column);
        let next_row = |row: usize| {
            if row == to.row {
                return f64::INFINITY;
            }
            let line = if row < to.row { row } else { row - 1 };
            (self.radii[line] - r) / dr
        };
        let next_column = |column: usize| {
            if column == to.column {
                return f64::INFINITY;
            }
            let f = meridian(if column < to.column { column + 1 } else { column });
            (f * r - b) / (db - f * dr)
        };
        let (mut row_at, mut column_at) = (next_row(row), next_column(column));
        let mut start = 0.0;
        loop {
            let end = row_at.min(column_at).min(1.0).max(start);
            let piece = dr * (end - start);
            let middle = 0.5 * (start + end);
            let (r, b) = (r + middle * dr, b + middle * db);
            let cell = &mut cells[(row - window[0]) * window[2] + column - window[1]];
            cell[0] += (b - meridian(column) * r) * piece;
            cell[1] += r * piece;
            if end >= 1.0 {
                return;
            }
            start = end;
            if row_at <= column_at {
                if row < to.row {
                    row += 1;
                } else {
                    row -= 1;
                }
                row_at = next_row(row);
            } else {
                if column < to.column {
                    column += 1;
                } else {
                    column -= 1;
                }
                column_at = next_column(column);
            }
        }
    }
}
