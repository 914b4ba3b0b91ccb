//! Where to split lights in two: bins along the axes, compared by the surface area orientation heuristic (Conty
//! Estevez and Kulla 2018, section 4.1).

use glam::Vec3A;

use super::cluster::{Cluster, Item, Units};
use crate::parallel::reduce;

/// Largest number of bins per axis. *Measured* (docs/ACCURACY.md, "Building without cones"): from 8 to 24 bins the
/// choice is as good, and each bin costs build time.
const BINS: usize = 10;
/// Smallest number of bins per axis, for sets of fewer lights than that. More bins than lights stay empty, fewer leave
/// no choice.
/// *Measured*: docs/ACCURACY.md, "Constants of the build"; not sensitive.
const FEWEST_BINS: usize = 4;
/// Padding of flat boxes, relative to the longest edge of the box that is split. Without any, all splits of a flat set
/// cost nothing; much more would hide thin shapes.
/// *Measured*: docs/ACCURACY.md, "Constants of the build"; not sensitive.
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
        let reference = items[0].normal;
        let part = |items: &[Item]| {
            let mut extent =
                Self { all: Cluster::EMPTY, center_low: Vec3A::INFINITY, center_high: Vec3A::NEG_INFINITY, reference };
            for item in items {
                extent.all.add(item, turned(item, reference));
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
    pub(super) fn cheapest_split(&self, items: &[Item]) -> Option<Split> {
        let spread = self.center_high - self.center_low;
        // Few lights leave most bins empty.
        let count = items.len().clamp(FEWEST_BINS, BINS);
        let binning = Binning::new(self.center_low, spread, count);
        let bins = binning.fill(items, self.reference);
        let edges = self.all.high - self.all.low;
        let longest = edges.max_element();
        let units = Units { pad: PAD, per_length: 1.0 / longest, per_energy: 1.0 / self.all.energy };
        let mut best = None;
        let mut best_cost = f32::INFINITY;
        for axis in (0..3).filter(|&axis| spread[axis] > 0.0) {
            // Long thin boxes are better cut across than along (the paper's k_r).
            let regularity = longest / edges[axis].max(PAD * longest);
            for (boundary, cost) in costs(&bins[axis][..count], &units) {
                let cost = regularity * cost;
                if cost < best_cost {
                    best_cost = cost;
                    best = Some(Split { binning, axis, boundary });
                }
            }
        }
        best
    }
}

#[inline(always)]
fn turned(item: &Item, reference: Vec3A) -> Vec3A {
    if item.two_sided && item.normal.dot(reference) < 0.0 { -item.normal } else { item.normal }
}

/// A boundary between two bins of one axis.
pub(super) struct Split {
    binning: Binning,
    axis: usize,
    boundary: usize,
}

impl Split {
    #[inline(always)]
    pub(super) fn is_left(&self, item: &Item) -> bool {
        self.binning.indices(item)[self.axis] < self.boundary
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

type Bins = [[Cluster; BINS]; 3];

impl Binning {
    fn new(start: Vec3A, spread: Vec3A, bins: usize) -> Self {
        Self { start, scale: Vec3A::splat(bins as f32) / spread, last: bins as u32 - 1 }
    }

    #[inline(always)]
    fn indices(&self, item: &Item) -> [usize; 3] {
        let places = (item.double_center() - self.start) * self.scale;
        // A float that is too large or NaN saturates in the cast.
        let index = |place: f32| (place as u32).min(self.last) as usize;
        [index(places.x), index(places.y), index(places.z)]
    }

    fn fill(&self, items: &[Item], reference: Vec3A) -> Bins {
        let part = |items: &[Item]| {
            let mut bins = [[Cluster::EMPTY; BINS]; 3];
            for item in items {
                let normal = turned(item, reference);
                let indices = self.indices(item);
                for axis in 0..3 {
                    bins[axis][indices[axis]].add(item, normal);
                }
            }
            bins
        };
        reduce(items, part, |mut a, b| {
            let pairs = a.as_flattened_mut().iter_mut().zip(b.as_flattened());
            pairs.for_each(|(a, b)| *a = a.union(b));
            a
        })
    }
}

/// Returns the cost of a split in front of each bin that has lights on both sides.
fn costs(bins: &[Cluster], units: &Units) -> impl Iterator<Item = (usize, f32)> {
    let mut right_costs = [None; BINS];
    let mut right = Cluster::EMPTY;
    for i in (1..bins.len()).rev() {
        right = right.union(&bins[i]);
        // All lights have energy.
        right_costs[i] = (right.energy > 0.0).then(|| right.cost_in(units));
    }
    let mut left = Cluster::EMPTY;
    (1..bins.len()).filter_map(move |i| {
        left = left.union(&bins[i - 1]);
        let right = right_costs[i]?;
        (left.energy > 0.0).then(|| (i, left.cost_in(units) + right))
    })
}
