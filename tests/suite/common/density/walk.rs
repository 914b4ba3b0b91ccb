//! Cells of a triangle, of which those whose integral is most in doubt are divided first.

extern crate alloc;

use alloc::collections::BinaryHeap;
use core::cmp::Ordering;

use super::{DEEPEST_DOUBT, Density, HEAVY, NEGLIGIBLE_DOUBT, OnTriangle, middle, quarter, step, tip};
use crate::common::pcg::Pcg32;

/// A dyadic part of a triangle.
pub(super) struct Cell {
    pub(super) corners: [[f64; 2]; 3],
    pub(super) depth: u32,
    pub(super) bin: usize,
    /// In barycentrics of its own, and the density there.
    pub(super) probes: Vec<([f64; 2], Density)>,
}

impl Cell {
    /// Share of the triangle that the cell covers.
    fn share(&self) -> f64 {
        0.25f64.powi(self.depth as i32)
    }

    /// From barycentrics of the cell to those of the triangle.
    fn place(&self, b: [f64; 2]) -> [f64; 2] {
        let [p, q, r] = self.corners;
        core::array::from_fn(|i| p[i] + (q[i] - p[i]) * b[0] + (r[i] - p[i]) * b[1])
    }

    fn quarters(&self) -> [[[f64; 2]; 3]; 4] {
        core::array::from_fn(|i| quarter(self.corners, i))
    }
}

/// A cell that is to be divided.
pub(super) struct Open {
    /// How wrong the integral over it can be.
    pub(super) key: f64,
    pub(super) cell: Cell,
    pub(super) range: Range,
    /// In the middles of its quarters.
    pub(super) values: [Density; 4],
}

/// Ratio of the largest to the least scale in a cell up to which its solid angle helps.
const MOST_SCALES: f64 = 2.0;

/// Whether all of these values lie on the linear function of the barycentrics that the first three of them give, up to
/// rounding.
fn is_linear(values: &[([f64; 2], f64)]) -> bool {
    let [(p, f), (q, g), (r, h)] = [values[0], values[1], values[2]];
    let (e, d) = ([q[0] - p[0], q[1] - p[1]], [r[0] - p[0], r[1] - p[1]]);
    let determinant = e[0] * d[1] - e[1] * d[0];
    let [u, v] = [((g - f) * d[1] - (h - f) * e[1]) / determinant, ((h - f) * e[0] - (g - f) * d[0]) / determinant];
    values.iter().all(|(b, value)| {
        let linear = f + u * (b[0] - p[0]) + v * (b[1] - p[1]);
        *value > 0.0 && (linear - value).abs() <= 1e-4 * value
    })
}

/// Differences of the largest and the least density that were seen in a cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct Range {
    by_area: f64,
    by_angle: f64,
    solid_angle: f64,
}

/// Difference of the largest and the least value, zero up to rounding.
fn range(values: impl Iterator<Item = f64>) -> f64 {
    let (low, high) = values.fold((f64::INFINITY, 0.0f64), |(low, high), v| (low.min(v), high.max(v)));
    if high - low > 1e-4 * high { high - low } else { 0.0 }
}

impl Range {
    /// How wrong the integral over a cell can be.
    fn doubt(&self, share: f64) -> f64 {
        (share * self.by_area).min(self.solid_angle * self.by_angle)
    }

    /// Whether the density varies less per solid angle than per area.
    fn is_by_angle(&self, share: f64) -> bool {
        self.solid_angle * self.by_angle < share * self.by_area
    }
}

impl Ord for Open {
    fn cmp(&self, other: &Self) -> Ordering {
        self.key.total_cmp(&other.key)
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Open {}

pub(super) struct Walk<'a, 'b> {
    on: &'a OnTriangle<'b>,
    pub(super) bins: Vec<f64>,
    bin_depth: u32,
    least_depth: u32,
    pub(super) open: BinaryHeap<Open>,
    pub(super) variance: f64,
    /// Sum of the keys of all open cells.
    pub(super) doubt: f64,
    pcg: Pcg32,
}

impl<'a, 'b> Walk<'a, 'b> {
    pub(super) fn new(on: &'a OnTriangle<'b>, bin_depth: u32, least_depth: u32) -> Self {
        Self {
            on,
            bins: vec![0.0; 1 << (2 * bin_depth)],
            bin_depth,
            least_depth: least_depth.max(bin_depth),
            open: BinaryHeap::new(),
            doubt: 0.0,
            variance: 0.0,
            pcg: Pcg32::new(on.id.triangle.into(), 63),
        }
    }

    pub(super) fn divide(&mut self, cell: Cell) {
        let mut parts: [Vec<([f64; 2], Density)>; 4] = Default::default();
        let quarters = cell.quarters();
        for (b, value) in cell.probes {
            let (i, local) = step(b);
            parts[i].push((local, value));
        }
        for (i, (corners, probes)) in quarters.into_iter().zip(parts).enumerate() {
            let bin = if cell.depth < self.bin_depth { 4 * cell.bin + i } else { cell.bin };
            self.look_at(Cell { corners, depth: cell.depth + 1, bin, probes });
        }
    }

    /// Integrates over a cell in which nothing seems to differ, and keeps another one for later.
    pub(super) fn look_at(&mut self, cell: Cell) {
        if cell.depth < self.least_depth {
            return self.divide(cell);
        }
        let quarters = cell.quarters();
        let values = quarters.map(|q| self.on.density(middle(q)));
        let densest = values.iter().fold(0.0, |densest: f64, value| densest.max(value.by_area()));
        if !self.on.is_limited() && cell.depth < self.on.deepest && cell.share() * densest > self.on.coarser * HEAVY {
            return self.divide(cell);
        }
        let are_equal = range(values.iter().map(|v| v.pdf)) == 0.0 || range(values.iter().map(|v| v.level())) == 0.0;
        if !are_equal && self.settle_smooth(&cell, &quarters, &values) {
            return;
        }
        // Averages are rounded, so that four can be the same by chance: then their quarters must be, too.
        let mut parts = Vec::new();
        if cell.depth < DEEPEST_DOUBT && are_equal {
            let of_quarter = |q| (0..4).map(move |i| middle(quarter(q, i)));
            parts.extend(quarters.into_iter().flat_map(of_quarter).map(|b| self.on.density(b)));
        }
        // A horizon, or the rim of what is black, may leave no more than a tip of a cell.
        if are_equal && (self.on.is_limited() || densest == 0.0) {
            parts.extend((0..3).map(|k| self.on.density(tip(cell.corners, k))));
        }
        let all = || values.iter().chain(&parts).copied().chain(cell.probes.iter().map(|p| p.1));
        let share = cell.share();
        let range = Range {
            by_area: range(all().map(Density::level)),
            by_angle: range(all().map(|v| v.pdf)),
            solid_angle: self.on.solid_angle(cell.corners, share),
        };
        let key = range.doubt(share);
        let may_be_small = !self.on.is_limited() && (self.on.is_by_angle || self.on.coarser > 1.0);
        let is_small = may_be_small && key < self.on.coarser * NEGLIGIBLE_DOUBT;
        if key == 0.0 || is_small || cell.depth >= self.on.deepest {
            self.settle(&cell, range, &values);
        } else {
            self.doubt += key;
            self.open.push(Open { key, cell, range, values });
        }
    }

    /// Adds a cell in which the density per area is linear, up to rounding. Returns whether it is.
    fn settle_smooth(&mut self, cell: &Cell, quarters: &[[[f64; 2]; 3]; 4], values: &[Density; 4]) -> bool {
        let mut seen: Vec<_> = quarters.iter().zip(values).map(|(q, v)| (middle(*q), v.by_area())).collect();
        if !is_linear(&seen) {
            return false;
        }
        let coarse: f64 = seen.iter().map(|v| v.1).sum::<f64>() / 4.0;
        let mut integral = coarse;
        // As with equal values, four are enough where cells are small.
        if cell.depth < DEEPEST_DOUBT {
            let on = self.on;
            let look = |b| (b, on.density(b).by_area());
            seen.extend(quarters.iter().flat_map(|q| (0..4).map(move |i| look(middle(quarter(*q, i))))));
            let fine: f64 = seen[4..].iter().map(|v| v.1).sum::<f64>() / 16.0;
            // What is left is a curve, of which half the steps leave a fourth (Richardson 1911).
            integral = (4.0 * fine - coarse) / 3.0;
            seen.extend((0..3).map(|k| look(tip(cell.corners, k))));
        }
        seen.extend(cell.probes.iter().map(|(b, v)| (cell.place(*b), v.by_area())));
        let is_smooth = is_linear(&seen);
        if is_smooth {
            self.bins[cell.bin] += cell.share() * integral;
        }
        is_smooth
    }

    /// Adds what is known of a cell.
    pub(super) fn settle(&mut self, cell: &Cell, range: Range, values: &[Density; 4]) {
        let share = cell.share();
        let doubt = range.doubt(share);
        self.bins[cell.bin] += if doubt > 0.0 {
            // Samples that fell where the random places may miss what they show.
            if !cell.probes.is_empty() {
                self.variance += (0.25 * doubt).powi(2);
            }
            self.at_random(cell, range)
        } else if range.is_by_angle(share) {
            range.solid_angle * values.iter().map(|v| v.pdf).sum::<f64>() / 4.0
        } else {
            share * values.iter().map(|v| v.by_area()).sum::<f64>() / 4.0
        };
    }

    /// Integral by random places, two in each quarter of a cell.
    fn at_random(&mut self, cell: &Cell, range: Range) -> f64 {
        let share = cell.share();
        let quarters = cell.quarters();
        let values = quarters.map(|[a, b, c]| {
            [(); 2].map(|()| {
                let [u, v] = [self.pcg.f32(), self.pcg.f32()].map(f64::from);
                let [s, t] = if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] };
                self.on.density(core::array::from_fn(|i| a[i] + (b[i] - a[i]) * s + (c[i] - a[i]) * t))
            })
        });
        let mean = |value: fn(Density) -> f64| values.as_flattened().iter().map(|v| value(*v)).sum::<f64>() / 8.0;
        // Their quotient is biased where the scale varies much.
        let (least, largest) = values
            .as_flattened()
            .iter()
            .fold((f64::INFINITY, 0.0f64), |(least, largest), v| (least.min(v.scale), largest.max(v.scale)));
        let is_by_angle = range.is_by_angle(share) && largest <= MOST_SCALES * least;
        let (value, unit): (fn(Density) -> f64, f64) = if is_by_angle {
            // Weighed by the solid angle that each place stands for, whose sum is known.
            (|v| v.pdf, range.solid_angle)
        } else {
            (Density::by_area, share)
        };
        for [first, second] in values {
            // The variance of the mean of the two, with the share of a quarter.
            self.variance += (unit * (value(first) - value(second))).powi(2) / 64.0;
        }
        if is_by_angle {
            unit * mean(Density::by_area) / mean(|v| v.scale).max(f64::MIN_POSITIVE)
        } else {
            unit * mean(Density::by_area)
        }
    }
}
