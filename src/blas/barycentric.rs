//! Barycentric coordinates as integers, and the numbering of a node's cells.
//!
//! A point is three integers `(i0, i1, i2)` that sum to `2^24`, so that `b1 = i1 · 2^-24` and `b2 = i2 · 2^-24` are
//! exact in an `f32`, and so is every step of a descent: a point is drawn in the cell that a lookup of the same
//! point finds, at every depth, on edges and corners too.
//!
//! The order is Ogaki's: with [`ARITY`] `M`, `R = √M` and `βk = min(R - 1, ⌊(1 - bk) R⌋)`, the rank is
//! `β0² + (β1 - β2) + β0`. Rows are counted from vertex 0; row `r` holds `2 r + 1` cells, upright and inverted ones
//! alternating. `R` successive ranks are a group. The number of a cell is that of a lane, `member · R + group`, so that
//! the sums of all groups are the sum of `R` vectors.
//!
//! An upright cell has the corners of the whole triangle in the same order. An inverted one is turned by half a circle:
//! its corner `k` lies across from the edge that would be edge `k`. In its own coordinates an inverted cell is a
//! triangle like any other, so that the next level does not see the difference.

use crate::warp::triangle::square_to_triangle;

/// Bits of a lattice coordinate. *Format*: those of an `f32`'s mantissa, so that coordinates are exact.
pub(crate) const LATTICE_BITS: u32 = 24;

/// The sum of a point's three coordinates: the edge length of the whole triangle in lattice units.
pub(crate) const LATTICE: u32 = 1 << LATTICE_BITS;

/// How often the whole triangle's edge may be halved. *Proved*: see below. A level halves it [`LEVEL_HALVINGS`] times.
///
/// The smallest cell is at least 16 lattice units wide and still has points strictly inside.
pub(crate) const MAX_HALVINGS: u32 = 20;

/// Cells of a node. *Format*: it decides on the layout of [`CellNode`](super::node::CellNode).
///
/// Chosen: a step is one loop over the lanes of a few vectors (docs/ACCURACY.md, "Wide steps"). Larger: more cells are
/// weighed and stored that hardly differ. Smaller: fewer bytes, but larger cells, whose weights follow distance, cosine
/// and radiance less closely; 4 and 16 had a multiple of the variance on a quad with spots, in a little less time.
pub(crate) const ARITY: usize = 64;

/// Cells along one edge of a node.
pub(crate) const EDGE_CELLS: u32 = (ARITY as u32).isqrt();

/// Halvings of an edge that one level stands for.
pub(crate) const LEVEL_HALVINGS: u32 = EDGE_CELLS.trailing_zeros();

const _: () = assert!(EDGE_CELLS.is_power_of_two() && (EDGE_CELLS * EDGE_CELLS) as usize == ARITY);

/// Converts between a rank and the number of a lane: the one way is the other.
const fn transposed(index: usize) -> usize {
    const R: usize = EDGE_CELLS as usize;
    index % R * R + index / R
}

/// A point of the triangle. The coordinates sum to [`LATTICE`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Lattice(pub(crate) [u32; 3]);

impl Lattice {
    /// The lattice point nearest to `[b1, b2]`, exact for what [`Self::to_barycentrics`] returns.
    ///
    /// Points outside are moved onto the triangle; NaN counts as zero.
    #[inline]
    pub(crate) fn from_barycentrics(b: [f32; 2]) -> Self {
        let [mut i1, mut i2] = b.map(|b| {
            // The cast saturates, and takes NaN to zero.
            ((f64::from(b) * f64::from(LATTICE) + 0.5) as u32).min(LATTICE)
        });
        // Rounding alone can leave the sum one too high. Split the excess; both sides can afford their share,
        // because neither is above LATTICE.
        let excess = (i1 + i2).saturating_sub(LATTICE);
        i1 -= excess.div_ceil(2);
        i2 -= excess / 2;
        Self([LATTICE - i1 - i2, i1, i2])
    }

    /// Returns the lattice point nearest to `[b1, b2]` among those strictly inside of the triangle.
    #[inline(always)]
    pub(crate) fn inside(b: [f64; 2]) -> Self {
        Self(nearest_inside(LATTICE, b))
    }

    /// The point's `[b1, b2]`, exactly.
    #[inline]
    pub(crate) fn to_barycentrics(self) -> [f32; 2] {
        let scale = 1.0 / LATTICE as f32;
        [self.0[1] as f32 * scale, self.0[2] as f32 * scale]
    }
}

/// Which of a node's cells holds a point, and the point's coordinates in that cell.
///
/// `local` sums to `size`, a power of two and a multiple of [`EDGE_CELLS`]; the returned coordinates sum to
/// `size / EDGE_CELLS`.
/// Every point has exactly one index; one strictly inside of a cell has that cell's.
#[inline]
pub(crate) fn child(local: [u32; 3], size: u32) -> (usize, [u32; 3]) {
    let r = EDGE_CELLS;
    debug_assert!(size.is_power_of_two() && size >= r && local.iter().sum::<u32>() == size);
    let shift = size.trailing_zeros() - LEVEL_HALVINGS;
    let t = 1 << shift;
    let [j0, j1, j2] = local;
    let mut a1 = j1 >> shift;
    let a2 = (j2 >> shift).min(r - 1);
    // Only at vertex 1 and at inner corners of the edge across from vertex 0, where b1 and b2 are whole cells: the
    // point becomes the second corner of the cell before it.
    if a1 + a2 == r {
        a1 -= 1;
    }
    let (f1, f2) = (j1 - (a1 << shift), j2 - (a2 << shift));
    // β0 is the row; the place in the row is β1 - β2 + β0 = 2 a2, plus one in an inverted cell. No inverted cell
    // begins in the last row: f1 + f2 is at most t there.
    if f1 + f2 <= t {
        let row = a1 + a2;
        let a0 = r - 1 - row;
        (transposed((row * row + 2 * a2) as usize), [j0 - (a0 << shift), f1, f2])
    } else {
        let row = a1 + a2 + 1;
        let a0 = r - 1 - row;
        (transposed((row * row + 2 * a2 + 1) as usize), [((a0 + 1) << shift) - j0, t - f1, t - f2])
    }
}

/// Where the cell of an index lies: its row, column and orientation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct CellPosition {
    /// The lowest coordinate along each of the three axes, in cells.
    pub(crate) a: [u32; 3],
    /// Whether the cell is turned by half a circle.
    pub(crate) inverted: bool,
}

/// The inverse of the numbering. `index` is below [`ARITY`].
#[inline]
pub(crate) const fn position(index: usize) -> CellPosition {
    let r = EDGE_CELLS;
    debug_assert!(index < ARITY);
    let rank = transposed(index) as u32;
    let row = rank.isqrt();
    let column = rank - row * row;
    let a2 = column / 2;
    let inverted = column % 2 == 1;
    CellPosition { a: [r - 1 - row, row - a2 - column % 2, a2], inverted }
}

/// The positions of all cells of a node.
pub(super) static POSITIONS: [CellPosition; ARITY] = {
    let mut positions = [position(0); ARITY];
    let mut index = 1;
    while index < ARITY {
        positions[index] = position(index);
        index += 1;
    }
    positions
};

/// A cell of any depth: how its own coordinates map to those of the whole triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct LatticeCell {
    /// The point from which coordinates count, up or (inverted) down.
    pub(crate) offset: [i32; 3],
    /// Whether the cell is turned by half a circle against the whole triangle.
    pub(crate) inverted: bool,
    /// Edge length in lattice units.
    pub(crate) size: u32,
}

impl LatticeCell {
    /// The whole triangle.
    #[inline]
    pub(crate) const fn whole() -> Self {
        Self { offset: [0; 3], inverted: false, size: LATTICE }
    }

    /// One of the cells of this one. `index` is below [`ARITY`].
    #[inline]
    pub(crate) fn child(self, index: usize) -> Self {
        let CellPosition { a, inverted } = POSITIONS[index];
        let size = self.size >> LEVEL_HALVINGS;
        let mut offset = self.offset;
        for (o, a) in offset.iter_mut().zip(a) {
            let step = ((a + u32::from(inverted)) * size) as i32;
            *o += if self.inverted { -step } else { step };
        }
        Self { offset, inverted: self.inverted != inverted, size }
    }

    /// A point of this cell, in the whole triangle. `local` sums to `size`.
    #[inline]
    pub(crate) fn global(self, local: [u32; 3]) -> Lattice {
        let along = |k: usize| {
            let step = local[k] as i32;
            // Never negative: the cell lies inside of the triangle.
            (self.offset[k] + if self.inverted { -step } else { step }) as u32
        };
        Lattice([along(0), along(1), along(2)])
    }

    /// Share of the whole triangle's area.
    #[inline]
    pub(crate) fn area(self) -> f32 {
        let edge = self.size as f32 / LATTICE as f32;
        edge * edge
    }

    /// The cell's corners, in the order of its own vertices.
    #[inline]
    pub(crate) fn corners(self) -> [Lattice; 3] {
        let s = self.size;
        [self.global([s, 0, 0]), self.global([0, s, 0]), self.global([0, 0, s])]
    }

    /// A point of the whole triangle in the cell's own coordinates, some of which are negative if it lies outside.
    #[inline]
    pub(crate) fn local(self, point: Lattice) -> [i32; 3] {
        core::array::from_fn(|k| {
            let step = point.0[k] as i32 - self.offset[k];
            if self.inverted { -step } else { step }
        })
    }

    /// Whether a point lies strictly inside of the cell.
    #[inline]
    pub(crate) fn holds(self, point: Lattice) -> bool {
        self.local(point).iter().all(|&i| i > 0)
    }

    /// The corners as exact `[b1, b2]`.
    #[cfg(test)]
    pub(crate) fn corner_barycentrics(self) -> [[f32; 2]; 3] {
        self.corners().map(Lattice::to_barycentrics)
    }
}

/// A point strictly inside of a cell that is `size >= 4` lattice units wide, in the cell's own coordinates (each at
/// least 1, summing to `size`).
///
/// Uniform `u` in `[0, 1]²` gives a uniform point, up to the lattice's resolution; the map is continuous and
/// preserves area, so stratified input gives stratified points. Any `u` is safe.
#[inline]
pub(crate) fn interior_point(size: u32, u: [f64; 2]) -> [u32; 3] {
    nearest_inside(size, square_to_triangle(u))
}

/// The point nearest to `[b1, b2]` strictly inside of a cell that is `size >= 4` lattice units wide.
#[inline(always)]
fn nearest_inside(size: u32, [b1, b2]: [f64; 2]) -> [u32; 3] {
    debug_assert!(size >= 4);
    // Rounding to the nearest point, rather than shrinking the triangle by the rim, leaves the density inside exact.
    // The casts saturate, and take NaN to zero.
    let round = |b: f64| (b * f64::from(size) + 0.5) as u32;
    let j1 = round(b1).max(1).min(size - 2);
    let j2 = round(b2).max(1).min(size - 1 - j1);
    [size - j1 - j2, j1, j2]
}

#[cfg(test)]
mod tests;
