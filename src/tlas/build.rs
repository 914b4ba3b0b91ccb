//! Binned build of a binary light tree by the surface area orientation heuristic (Conty Estevez and Kulla 2018,
//! section 4.1).

use alloc::vec;
use alloc::vec::Vec;

use super::collapse::collapse;
use super::node::Tlas;
use crate::bounds::{LightBounds, Moments};
use crate::geometry::Aabb;

/// Bins per axis.
const BINS: usize = 12;
/// Below this depth lights are split into equal halves, so that no input can make the tree deeper than this plus
/// the logarithm of its size.
const MAX_SAOH_DEPTH: u32 = 48;
/// Padding of flat boxes, relative to the longest edge of the box that is split.
const PAD: f32 = 1e-3;
/// From this size on the two halves of a split are built in parallel.
#[cfg(feature = "rayon")]
const PARALLEL: usize = 4096;

/// Node of the binary tree. The left child follows its parent, which is why a subtree of `n` leaves takes exactly
/// `2 n - 1` places and both halves can be built at once.
#[derive(Clone, Copy, Debug)]
pub(super) struct BinaryNode {
    pub(super) bounds: LightBounds,
    pub(super) moments: Moments,
    pub(super) count: u32,
    /// The number of the light in a leaf, the distance to the right child elsewhere.
    pub(super) link: u32,
}

/// A light on its way into the tree.
#[derive(Clone, Copy)]
struct Item {
    bounds: LightBounds,
    moments: Moments,
    light: u32,
}

/// Builds a tree of arity `N` over lights. Returns it with the lights in the order of its leaves.
pub(crate) fn build<const N: usize>(lights: &[(LightBounds, Moments)]) -> (Tlas<N>, Vec<u32>) {
    let mut items: Vec<Item> =
        lights.iter().zip(0..).map(|(&(bounds, moments), light)| Item { bounds, moments, light }).collect();
    let Some(first) = items.first() else {
        return (Tlas { nodes: Vec::new(), parents: Vec::new(), spreads: Vec::new(), leaves: Vec::new() }, Vec::new());
    };
    let blank = BinaryNode { bounds: first.bounds, moments: first.moments, count: 1, link: 0 };
    let mut binary = vec![blank; 2 * items.len() - 1];
    subdivide(&mut items, &mut binary, 0);
    collapse(&binary)
}

/// Builds the subtree over `items` into `nodes`, which holds exactly its `2 n - 1` places.
fn subdivide(items: &mut [Item], nodes: &mut [BinaryNode], depth: u32) {
    if let [item] = items {
        nodes[0] = BinaryNode { bounds: item.bounds, moments: item.moments, count: 1, link: item.light };
        return;
    }
    let middle = split(items, depth);
    let (left_items, right_items) = items.split_at_mut(middle);
    let (root, below) = nodes.split_at_mut(1);
    let (left, right) = below.split_at_mut(2 * middle - 1);
    let size = left.len() + right.len();
    both(|| subdivide(left_items, left, depth + 1), || subdivide(right_items, right, depth + 1), size);
    let two_sided = left[0].bounds.two_sided && right[0].bounds.two_sided;
    let flip = two_sided && left[0].moments.normal.dot(right[0].moments.normal) < 0.0;
    root[0] = BinaryNode {
        bounds: left[0].bounds.union(right[0].bounds),
        moments: left[0].moments.union(right[0].moments, flip),
        count: left[0].count + right[0].count,
        link: 2 * middle as u32,
    };
}

/// Runs both, side by side where that pays and the feature `rayon` is on.
#[cfg(feature = "rayon")]
fn both(left: impl FnOnce() + Send, right: impl FnOnce() + Send, size: usize) {
    if size >= PARALLEL {
        rayon::join(left, right);
    } else {
        left();
        right();
    }
}

/// Runs both, one after the other.
#[cfg(not(feature = "rayon"))]
fn both(left: impl FnOnce(), right: impl FnOnce(), _size: usize) {
    left();
    right();
}

/// Orders the items so that the cheapest split found lies at the returned place, strictly inside.
fn split(items: &mut [Item], depth: u32) -> usize {
    let centers = items.iter().fold(Aabb::EMPTY, |aabb, item| {
        let center = item.bounds.aabb.center();
        aabb.union(Aabb { min: center, max: center })
    });
    let extent = centers.extent();
    let half = items.len() / 2;
    if depth >= MAX_SAOH_DEPTH {
        let axis = extent.max_position();
        let key = |item: &Item| item.bounds.aabb.center()[axis];
        items.select_nth_unstable_by(half, |a, b| key(a).total_cmp(&key(b)).then(a.light.cmp(&b.light)));
        return half;
    }
    let Some((axis, boundary)) = cheapest(items, &centers) else { return half };
    let bin = Binning::new(&centers, axis);
    let middle = partition(items, |item| bin.index(&item.bounds) < boundary);
    if middle == 0 || middle == items.len() { half } else { middle }
}

/// Moves the items that fulfil the predicate to the front, keeping the order of both parts, and counts them.
fn partition(items: &mut [Item], belongs_left: impl Fn(&Item) -> bool) -> usize {
    let right: Vec<Item> = items.iter().copied().filter(|item| !belongs_left(item)).collect();
    let mut left = 0;
    for i in 0..items.len() {
        if belongs_left(&items[i]) {
            items[left] = items[i];
            left += 1;
        }
    }
    items[left..].copy_from_slice(&right);
    left
}

/// Assigns a cluster to one of [`BINS`] slabs along an axis by its centre.
struct Binning {
    axis: usize,
    start: f32,
    scale: f32,
}

impl Binning {
    fn new(centers: &Aabb, axis: usize) -> Self {
        Self { axis, start: centers.min[axis], scale: BINS as f32 / centers.extent()[axis] }
    }

    fn index(&self, bounds: &LightBounds) -> usize {
        // A float that is too large or NaN saturates in the cast.
        (((bounds.aabb.center()[self.axis] - self.start) * self.scale) as usize).min(BINS - 1)
    }
}

/// The axis and the boundary between bins of least cost, or `None` where all centres coincide.
fn cheapest(items: &[Item], centers: &Aabb) -> Option<(usize, usize)> {
    let extent = centers.extent();
    let box_extent = items.iter().fold(Aabb::EMPTY, |aabb, item| aabb.union(item.bounds.aabb)).extent();
    let longest = box_extent.max_element();
    let pad = PAD * longest;
    let mut best = None;
    let mut best_cost = f32::INFINITY;
    for axis in (0..3).filter(|&axis| extent[axis] > 0.0) {
        let binning = Binning::new(centers, axis);
        let mut bins: [Option<LightBounds>; BINS] = [None; BINS];
        for item in items {
            add(&mut bins[binning.index(&item.bounds)], item.bounds);
        }
        // Long thin boxes are better cut across than along (the paper's k_r).
        let regularity = longest / box_extent[axis].max(pad);
        for (boundary, cost) in costs(&bins, pad) {
            let cost = regularity * cost;
            if cost < best_cost {
                best_cost = cost;
                best = Some((axis, boundary));
            }
        }
    }
    best
}

fn add(cluster: &mut Option<LightBounds>, bounds: LightBounds) {
    *cluster = Some(cluster.map_or(bounds, |cluster| cluster.union(bounds)));
}

/// Cost of a split in front of each bin that has lights on both sides.
fn costs(bins: &[Option<LightBounds>; BINS], pad: f32) -> impl Iterator<Item = (usize, f32)> {
    let mut right_costs = [None; BINS];
    let mut right = None;
    for i in (1..BINS).rev() {
        if let Some(bounds) = bins[i] {
            add(&mut right, bounds);
        }
        right_costs[i] = right.map(|cluster: LightBounds| cluster.cost(pad));
    }
    let mut left = None;
    (1..BINS).filter_map(move |i| {
        if let Some(bounds) = bins[i - 1] {
            add(&mut left, bounds);
        }
        let left: LightBounds = left?;
        Some((i, left.cost(pad) + right_costs[i]?))
    })
}
