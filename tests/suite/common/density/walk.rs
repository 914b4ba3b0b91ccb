//! Cells of a triangle, of which those whose integral is most in doubt are divided first.

extern crate alloc;

use alloc::collections::BinaryHeap;
use core::cmp::Ordering;

use super::{DEEPEST_DOUBT, OnTriangle, middle, quarter, step, tip};
use crate::common::pcg::Pcg32;

/// A dyadic part of a triangle.
pub(super) struct Cell {
    pub(super) corners: [[f64; 2]; 3],
    pub(super) depth: u32,
    pub(super) bin: usize,
    /// In barycentrics of its own, and the density there.
    pub(super) probes: Vec<([f64; 2], f64)>,
}

impl Cell {
    /// Of the triangle.
    fn share(&self) -> f64 {
        0.25f64.powi(self.depth as i32)
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
    /// Difference of the largest and the least density that was seen.
    pub(super) range: f64,
    /// In the middles of its quarters.
    pub(super) values: [f64; 4],
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
    pub(super) unresolved: f64,
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
            unresolved: 0.0,
            variance: 0.0,
            pcg: Pcg32::new(on.id.triangle.into(), 63),
        }
    }

    pub(super) fn divide(&mut self, cell: Cell) {
        let mut parts: [Vec<([f64; 2], f64)>; 4] = Default::default();
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
        let are_equal = values.iter().all(|v| (v - values[0]).abs() <= 1e-4 * v);
        // Averages are rounded, so that four can be the same by chance: then their quarters must be, too.
        let mut parts = Vec::new();
        if cell.depth < DEEPEST_DOUBT && are_equal {
            let of_quarter = |q| (0..4).map(move |i| middle(quarter(q, i)));
            parts.extend(quarters.into_iter().flat_map(of_quarter).map(|b| self.on.density(b)));
        }
        // A horizon may leave no more than a tip of a cell.
        if self.on.is_limited() && are_equal {
            parts.extend((0..3).map(|k| self.on.density(tip(cell.corners, k))));
        }
        let all = || values.iter().chain(&parts).copied().chain(cell.probes.iter().map(|p| p.1));
        let (low, high) = all().fold((f64::INFINITY, 0.0f64), |(low, high), v| (low.min(v), high.max(v)));
        let range = if high - low > 1e-4 * high { high - low } else { 0.0 };
        if range == 0.0 || cell.depth >= self.on.deepest {
            self.settle(&cell, range, &values);
        } else {
            let key = cell.share() * range;
            self.doubt += key;
            self.open.push(Open { key, cell, range, values });
        }
    }

    /// Adds what is known of a cell.
    pub(super) fn settle(&mut self, cell: &Cell, range: f64, values: &[f64; 4]) {
        let share = cell.share();
        self.unresolved += share * range;
        let mean = if range > 0.0 && self.on.is_limited() {
            // Samples that fell where the random places may miss what they show.
            if !cell.probes.is_empty() {
                self.variance += (0.25 * share * range).powi(2);
            }
            self.at_random(cell)
        } else {
            values.iter().sum::<f64>() / 4.0
        };
        self.bins[cell.bin] += share * mean;
    }

    /// Mean over random places, two in each quarter of a cell.
    fn at_random(&mut self, cell: &Cell) -> f64 {
        let mut sum = 0.0;
        for [a, b, c] in cell.quarters() {
            let [first, second] = [(); 2].map(|()| {
                let [u, v] = [self.pcg.f32(), self.pcg.f32()].map(f64::from);
                let [s, t] = if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] };
                self.on.density(core::array::from_fn(|i| a[i] + (b[i] - a[i]) * s + (c[i] - a[i]) * t))
            });
            sum += first + second;
            // Of the mean of the two, with the share of a quarter.
            self.variance += (cell.share() * (first - second)).powi(2) / 64.0;
        }
        sum / 8.0
    }
}
