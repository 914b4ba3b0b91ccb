//! Where to split lights in two: bins along the axes, compared by the surface area orientation heuristic (Conty
//! Estevez and Kulla 2018, section 4.1).
//!
//! Here a cluster's normals lie in a box, as its positions do: to add a light takes a few vector instructions and
//! no trigonometry, where the union of two cones takes two arcs and a turn. The cones of the finished tree are made of
//! the lights themselves.

use glam::Vec3A;

use crate::bounds::{LightBounds, orientation_measure};
use crate::parallel::reduce;

/// Most bins per axis.
const BINS: usize = 10;
/// Fewest bins per axis.
const FEWEST_BINS: usize = 4;
/// Padding of flat boxes, relative to the longest edge of the box that is split.
const PAD: f32 = 1e-3;

/// A light on its way into the tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    low: Vec3A,
    high: Vec3A,
    normal: Vec3A,
    energy: f32,
    two_sided: bool,
    pub(super) light: u32,
}

impl Item {
    pub(super) fn new(bounds: &LightBounds, light: u32) -> Self {
        Self {
            low: bounds.aabb.min.into(),
            high: bounds.aabb.max.into(),
            normal: bounds.normals.axis.into(),
            energy: bounds.energy(),
            two_sided: bounds.two_sided,
            light,
        }
    }

    /// Twice the centre of the box; coordinates are small enough to be added.
    #[inline(always)]
    pub(super) fn double_center(&self) -> Vec3A {
        self.low + self.high
    }
}

/// What the heuristic knows of several lights.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cluster {
    low: Vec3A,
    high: Vec3A,
    normal_low: Vec3A,
    normal_high: Vec3A,
    energy: f32,
    two_sided: bool,
}

impl Cluster {
    const EMPTY: Self = Self {
        low: Vec3A::INFINITY,
        high: Vec3A::NEG_INFINITY,
        normal_low: Vec3A::INFINITY,
        normal_high: Vec3A::NEG_INFINITY,
        energy: 0.0,
        two_sided: false,
    };

    /// Adds a light whose normal has been turned to the side that is wanted.
    #[inline(always)]
    fn add(&mut self, item: &Item, normal: Vec3A) {
        self.low = self.low.min(item.low);
        self.high = self.high.max(item.high);
        self.normal_low = self.normal_low.min(normal);
        self.normal_high = self.normal_high.max(normal);
        self.energy += item.energy;
        self.two_sided |= item.two_sided;
    }

    #[inline(always)]
    fn union(self, other: &Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            normal_low: self.normal_low.min(other.normal_low),
            normal_high: self.normal_high.max(other.normal_high),
            energy: self.energy + other.energy,
            two_sided: self.two_sided || other.two_sided,
        }
    }

    /// `M_A · M_Ω · energy` of the heuristic.
    pub(super) fn cost(&self) -> f32 {
        self.cost_in(&Units { pad: 0.0, per_length: 1.0, per_energy: 1.0 })
    }

    #[inline]
    fn cost_in(&self, units: &Units) -> f32 {
        let e = (self.high - self.low) * units.per_length + Vec3A::splat(units.pad);
        let area = 2.0 * (e.x * e.y + e.y * e.z + e.z * e.x);
        area * orientation_measure(self.least_cos(), self.two_sided) * (self.energy * units.per_energy)
    }

    /// Least cosine of the angle between a normal and the middle of all.
    #[inline]
    fn least_cos(&self) -> f32 {
        let middle = 0.5 * (self.normal_low + self.normal_high);
        let half = 0.5 * (self.normal_high - self.normal_low);
        let length2 = middle.length_squared();
        if length2 < 1e-4 {
            return -1.0;
        }
        let inverse = 1.0 / crate::math::sqrt(length2);
        // By the corner of the box that is farthest back, and by the ball around the box; the larger one is true, too.
        let by_corner = (length2 - middle.abs().dot(half)) * inverse;
        let by_ball = 0.5 * (1.0 + length2 - half.length_squared()) * inverse;
        by_corner.max(by_ball).clamp(-1.0, 1.0)
    }
}

/// What costs are told in, so that they can be compared for lights that are tiny or dark.
struct Units {
    /// What edges are made longer by, so that flat boxes still compare.
    pad: f32,
    per_length: f32,
    per_energy: f32,
}

/// A set of lights that is to be split.
pub(super) struct Extent {
    pub(super) all: Cluster,
    /// Box around the doubled centres.
    center_low: Vec3A,
    center_high: Vec3A,
    /// The normal that those of two-sided lights are turned to: their sign says nothing.
    reference: Vec3A,
}

impl Extent {
    /// Of lights, of which there is at least one.
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

    /// The axis along which the centres differ most.
    pub(super) fn longest_axis(&self) -> usize {
        (self.center_high - self.center_low).max_position()
    }

    /// The cheapest split found, or `None` where all centres coincide.
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

/// Assigns lights to slabs along each axis by their centres.
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

/// Cost of a split in front of each bin that has lights on both sides.
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
