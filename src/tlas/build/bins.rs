//! Where to split lights in two: bins along the axes, compared by the surface area orientation heuristic (Conty
//! Estevez and Kulla 2018, section 4.1).

use glam::Vec3A;

use super::cluster::{Cluster, Item, Units};
use crate::parallel::{SUM_CHUNK, reduce};

/// Largest number of bins per axis. *Measured* (docs/ACCURACY.md, "Building without cones"): from 8 to 24 bins the
/// choice is as good, and each bin costs build time.
const MOST_BINS: usize = 10;
/// Smallest number of bins per axis, for sets of fewer lights than that. More bins than lights stay empty, fewer leave
/// no choice.
/// *Measured*: docs/CONSTANTS.md, "Constants of the build"; not sensitive.
const FEWEST_BINS: usize = 4;
/// Padding of flat boxes, relative to the longest edge of the box that is split. Without any, all splits of a flat set
/// cost nothing; much more would hide thin shapes.
/// *Measured*: docs/CONSTANTS.md, "Constants of the build"; not sensitive.
const PAD: f32 = 1e-3;

/// A set of lights that is to be split.
pub(super) struct Extent {
    pub(super) all: Cluster,
    /// Box around the doubled centers.
    center_low: Vec3A,
    center_high: Vec3A,
    /// The normal that those of two-sided lights are turned to: their sign says nothing.
    reference: Vec3A,
}

impl Extent {
    /// Measures lights, of which there is at least one.
    pub(super) fn of(items: &[Item]) -> Self {
        let reference = items[0].normal();
        let part = |items: &[Item]| {
            let mut extent =
                Self { all: Cluster::EMPTY, center_low: Vec3A::INFINITY, center_high: Vec3A::NEG_INFINITY, reference };
            for item in items {
                extent.all.add(item, item.turned_normal(reference));
                let center = item.double_center();
                extent.center_low = extent.center_low.min(center);
                extent.center_high = extent.center_high.max(center);
            }
            extent
        };
        reduce(items, part, |a, b| Self {
            all: a.all.union(&b.all),
            center_low: a.center_low.min(b.center_low),
            center_high: a.center_high.max(b.center_high),
            reference,
        })
    }

    /// Returns the axis along which the centers differ most.
    pub(super) fn longest_axis(&self) -> usize {
        (self.center_high - self.center_low).max_position()
    }

    /// Returns the cheapest split found, or `None` where all centers coincide.
    pub(super) fn cheapest_split(&self, items: &[Item], scratch: &mut Scratch) -> Option<Split> {
        let Scratch { bins, sides } = scratch;
        let spread = self.center_high - self.center_low;
        // Few lights leave most bins empty.
        let count = items.len().clamp(FEWEST_BINS, MOST_BINS);
        let binning = Binning::new(self.center_low, spread, count);
        let edges = self.all.high - self.all.low;
        let longest = edges.max_element();
        let units = Units { pad: PAD, per_length: 1.0 / longest, per_energy: 1.0 / self.all.energy };
        let one_measure = self.all.has_one_normal().then(|| self.all.orientation_measure());
        bins.iter_mut().for_each(|bins| bins[..count].fill(Cluster::EMPTY));
        binning.fill(items, self.reference, one_measure.is_some(), bins);
        let axes = || (0..3).filter(|&axis| spread[axis] > 0.0);
        sides.count = 0;
        axes().for_each(|axis| sides.push(&bins[axis][..count]));
        let mut costs = sides.costs(&units, one_measure);
        let mut best = None;
        let mut best_cost = f32::INFINITY;
        for axis in axes() {
            // Long thin boxes are better cut across than along (the paper's k_r).
            let regularity = longest / edges[axis].max(PAD * longest);
            for (boundary, cost) in (1..count).zip(costs.by_ref()) {
                let cost = regularity * cost;
                // Where one side is empty, this is NaN, which is no less than anything.
                if cost < best_cost {
                    best_cost = cost;
                    best = Some((axis, boundary));
                }
            }
        }
        best.map(|(axis, boundary)| binning.split(axis, boundary))
    }
}

/// Memory for one split at a time: to clear what a split needs of it is faster than to make all of it each time.
pub(super) struct Scratch {
    bins: Bins,
    sides: SplitSides,
}

impl Scratch {
    pub(super) fn new() -> Self {
        Self {
            bins: [[Cluster::EMPTY; MOST_BINS]; 3],
            sides: SplitSides { clusters: [[Cluster::EMPTY; COST_LANES]; FOURS], count: 0 },
        }
    }
}

/// A boundary between two bins of one axis.
pub(super) struct Split {
    binning: Binning,
    /// Number of the first bin on the right of the boundary, in the component of its axis; NaN in the others.
    boundary: Vec3A,
}

impl Split {
    #[inline(always)]
    pub(super) fn is_left(&self, item: &Item) -> bool {
        // As bins are numbered, a NaN is in the first one.
        !self.binning.places(item).cmpge(self.boundary).any()
    }
}

/// Assigns lights to slabs along each axis by their centers.
#[derive(Clone, Copy)]
struct Binning {
    start: Vec3A,
    scale: Vec3A,
    /// Number of the last bin.
    last: u32,
}

type Bins = [[Cluster; MOST_BINS]; 3];

impl Binning {
    fn new(start: Vec3A, spread: Vec3A, bins: usize) -> Self {
        Self { start, scale: Vec3A::splat(bins as f32) / spread, last: bins as u32 - 1 }
    }

    fn split(self, axis: usize, boundary: usize) -> Split {
        let mut only = Vec3A::NAN;
        only[axis] = boundary as f32;
        Split { binning: self, boundary: only }
    }

    /// Returns the place of a light along each axis, in bins.
    #[inline(always)]
    fn places(&self, item: &Item) -> Vec3A {
        (item.double_center() - self.start) * self.scale
    }

    #[inline(always)]
    fn indices(&self, item: &Item) -> [usize; 3] {
        let places = self.places(item);
        // A float that is too large or NaN saturates in the cast.
        let index = |place: f32| (place as u32).min(self.last) as usize;
        [index(places.x), index(places.y), index(places.z)]
    }

    /// Adds lights to empty bins. `is_flat` leaves out where they face.
    fn fill(&self, items: &[Item], reference: Vec3A, is_flat: bool, bins: &mut Bins) {
        if items.len() <= SUM_CHUNK {
            self.add(items, reference, is_flat, bins);
            return;
        }
        let part = |items: &[Item]| {
            let mut bins = [[Cluster::EMPTY; MOST_BINS]; 3];
            self.add(items, reference, is_flat, &mut bins);
            bins
        };
        *bins = reduce(items, part, |mut a, b| {
            let pairs = a.as_flattened_mut().iter_mut().zip(b.as_flattened());
            pairs.for_each(|(a, b)| *a = a.union(b));
            a
        });
    }

    fn add(&self, items: &[Item], reference: Vec3A, is_flat: bool, bins: &mut Bins) {
        if is_flat {
            self.add_with(items, bins, |bin, item| bin.add_without_normal(item));
        } else {
            self.add_with(items, bins, |bin, item| bin.add(item, item.turned_normal(reference)));
        }
    }

    #[inline(always)]
    fn add_with(&self, items: &[Item], bins: &mut Bins, add: impl Fn(&mut Cluster, &Item)) {
        for item in items {
            let indices = self.indices(item);
            for axis in 0..3 {
                add(&mut bins[axis][indices[axis]], item);
            }
        }
    }
}

/// Clusters whose costs are computed at once.
const COST_LANES: usize = 4;
/// Most fours of clusters that are compared for one split: two sides of each boundary.
const FOURS: usize = (3 * 2 * (MOST_BINS - 1)).div_ceil(COST_LANES);

/// What is on the left and on the right of each boundary that is compared.
struct SplitSides {
    clusters: [[Cluster; COST_LANES]; FOURS],
    count: usize,
}

impl SplitSides {
    /// Adds both sides of each boundary between the bins of an axis.
    fn push(&mut self, bins: &[Cluster]) {
        let boundaries = bins.len() - 1;
        let sides = &mut self.clusters.as_flattened_mut()[self.count..self.count + 2 * boundaries];
        let mut left = Cluster::EMPTY;
        for (bin, sides) in bins.iter().zip(sides.chunks_exact_mut(2)) {
            left = left.union(bin);
            sides[0] = left;
        }
        let mut right = Cluster::EMPTY;
        for (bin, sides) in bins[1..].iter().zip(sides.chunks_exact_mut(2)).rev() {
            right = right.union(bin);
            sides[1] = right;
        }
        self.count += 2 * boundaries;
    }

    /// Returns the cost of a split at each boundary: that of both sides together. All clusters have the given `M_Ω` if
    /// there is one.
    fn costs(&self, units: &Units, one_measure: Option<f32>) -> impl Iterator<Item = f32> {
        let mut costs = [[0.0; COST_LANES]; FOURS];
        for (costs, clusters) in costs.iter_mut().zip(&self.clusters[..self.count.div_ceil(COST_LANES)]) {
            *costs = Cluster::costs(clusters, units, one_measure).to_array();
        }
        (0..self.count).step_by(2).map(move |i| costs.as_flattened()[i] + costs.as_flattened()[i + 1])
    }
}
