//! Regions of space and orientation, divided where reports are.
//!
//! Each orientation has a tree of planes perpendicular to the axes. A region is divided in the middle of the longest
//! side of the box around its reports, so that empty space costs a few planes at most, however large the scene.

use alloc::boxed::Box;
use alloc::collections::BinaryHeap;
use alloc::string::ToString;
use alloc::vec;
use alloc::vec::Vec;
use core::cmp::Reverse;

use glam::Vec3;

use super::table::{NOTHING, ORIENTATIONS, REGION, RegionNode, find};
use crate::math;

/// Where the reports of a region are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RegionExtent {
    pub(crate) count: u64,
    pub(crate) low: Vec3,
    pub(crate) high: Vec3,
}

impl RegionExtent {
    pub(crate) const EMPTY: Self = Self { count: 0, low: Vec3::INFINITY, high: Vec3::NEG_INFINITY };

    /// Adds a position.
    pub(crate) fn add(&mut self, position: Vec3) {
        self.merge(&Self { count: 1, low: position, high: position });
    }

    /// Adds all of another. Neither sums of integers nor extremes depend on the order.
    pub(crate) fn merge(&mut self, other: &Self) {
        self.count = self.count.saturating_add(other.count);
        self.low = self.low.min(other.low);
        self.high = self.high.max(other.high);
    }

    /// Returns the axis and the coordinate of the plane through the middle, if that has two sides.
    fn middle(&self) -> Option<(usize, f32)> {
        let size = self.high - self.low;
        let axis = (0..3).fold(0, |best, axis| if size[axis] > size[best] { axis } else { best });
        let plane = 0.5 * self.low[axis] + 0.5 * self.high[axis];
        (plane > self.low[axis] && plane <= self.high[axis]).then_some((axis, plane))
    }
}

/// The regions as they grow.
#[derive(Clone)]
pub(crate) struct RegionBuilder {
    nodes: Vec<RegionNode>,
    /// Node of each region.
    leaves: Vec<u32>,
    /// Where the reports of each region are, since it was divided.
    pub(crate) extents: Vec<RegionExtent>,
    /// Where all reports of an orientation are.
    around: [RegionExtent; ORIENTATIONS],
}

crate::buffers::debug_counts!(RegionBuilder, regions => {
    nodes: regions.nodes.len(),
    regions: regions.leaves.len(),
});

impl RegionBuilder {
    /// Returns one region for each orientation.
    pub(crate) fn new() -> Self {
        let count = ORIENTATIONS as u32;
        Self {
            nodes: (0..count).map(|first| RegionNode { kind: REGION, plane: 0.0, first }).collect(),
            leaves: (0..count).collect(),
            extents: vec![RegionExtent::EMPTY; ORIENTATIONS],
            around: [RegionExtent::EMPTY; ORIENTATIONS],
        }
    }

    /// Returns the same regions as if nothing had been reported.
    pub(crate) fn without_reports(mut self) -> Self {
        self.extents.fill(RegionExtent::EMPTY);
        self
    }

    /// Number of regions.
    pub(crate) fn len(&self) -> usize {
        self.leaves.len()
    }

    /// Returns the first node in which as many other regions differ, and what the node is in these and in those.
    pub(crate) fn difference(&self, other: &Self) -> Option<(usize, [Box<str>; 2])> {
        let node = self.nodes.iter().zip(&other.nodes).position(|(own, other)| own != other)?;
        Some((node, [self, other].map(|regions| regions.nodes[node].to_string().into())))
    }

    /// Returns the region of a position of an orientation.
    pub(crate) fn find(&self, orientation: usize, position: Vec3) -> Option<u32> {
        position.is_finite().then(|| find(&self.nodes, orientation, position))?
    }

    /// Adds where the reports of all regions have been.
    pub(crate) fn add(&mut self, extents: &[RegionExtent]) {
        self.extents.iter_mut().zip(extents).for_each(|(extent, other)| extent.merge(other));
    }

    /// Takes note of where the reports of each orientation are, before regions are divided.
    pub(crate) fn surround(&mut self) {
        for root in 0..ORIENTATIONS {
            let mut around = self.around[root];
            self.visit(root, &mut |region, builder| around.merge(&builder.extents[region as usize]));
            self.around[root] = around;
        }
    }

    fn visit(&self, node: usize, visit: &mut impl FnMut(u32, &Self)) {
        let RegionNode { kind, first, .. } = self.nodes[node];
        if kind == REGION {
            visit(first, self);
        } else {
            self.visit(first as usize, visit);
            self.visit(first as usize + 1, visit);
        }
    }

    /// Divides a region in two. Returns the number of the new one: the old number stays with what is below the plane.
    pub(crate) fn divide(&mut self, region: u32) -> Option<u32> {
        let (axis, plane) = self.extents[region as usize].middle()?;
        let (first, new) = (self.nodes.len() as u32, self.leaves.len() as u32);
        self.nodes[self.leaves[region as usize] as usize] = RegionNode { kind: axis as u32, plane, first };
        for number in [region, new] {
            self.nodes.push(RegionNode { kind: REGION, plane: 0.0, first: number });
        }
        self.leaves[region as usize] = first;
        self.leaves.push(first + 1);
        self.extents[region as usize] = RegionExtent::EMPTY;
        self.extents.push(RegionExtent::EMPTY);
        Some(new)
    }

    /// Divides regions until none holds more than `most` of these positions, or there are `limit` regions, those with
    /// the most positions first: where the limit is reached, a small place that many look at is still found in a large
    /// scene.
    pub(crate) fn cover(&mut self, points: &mut [(usize, Vec3)], most: usize, limit: usize) {
        let (mut from, mut waiting) = (0, BinaryHeap::new());
        let waits = |region: u32, start: usize, end: usize| (end - start, Reverse(region), start);
        points.sort_by_key(|(orientation, _)| *orientation);
        for root in 0..ORIENTATIONS {
            let count = points[from..].iter().take_while(|(orientation, _)| *orientation == root).count();
            points[from..from + count].iter().for_each(|(_, position)| self.around[root].add(*position));
            waiting.push(waits(root as u32, from, from + count));
            from += count;
        }
        while let Some((count, Reverse(region), start)) = waiting.pop() {
            if count <= most || self.len() >= limit {
                break;
            }
            let points = &mut points[start..start + count];
            let mut extent = RegionExtent::EMPTY;
            points.iter().for_each(|(_, position)| extent.add(*position));
            let Some((axis, plane)) = extent.middle() else { continue };
            self.extents[region as usize] = extent;
            let Some(new) = self.divide(region) else { continue };
            points.sort_by_key(|(_, position)| position[axis] >= plane);
            let below = points.iter().take_while(|(_, p)| !(p[axis] >= plane)).count();
            waiting.push(waits(region, start, start + below));
            waiting.push(waits(new, start + below, start + count));
        }
        self.extents.fill(RegionExtent::EMPTY);
    }

    /// Returns the nodes as a table holds them, with regions renumbered: `number` returns the new number, or `None`
    /// for a region of which nothing is known. What is far from all reports is in no region.
    pub(crate) fn freeze(&self, number: impl Fn(u32) -> Option<u32>) -> Vec<RegionNode> {
        let nothing = RegionNode { kind: NOTHING, plane: 0.0, first: 0 };
        let mut nodes = vec![nothing; ORIENTATIONS];
        for (root, around) in self.around.iter().enumerate() {
            let mut at = root;
            if around.count > 0 {
                // Above rounding, so that reports of a single position have a region as well.
                let size = around.low.abs().max(around.high.abs()).max_element();
                let least = f32::EPSILON * size + f32::MIN_POSITIVE;
                let margin = math::at_least(MARGIN * (around.high - around.low).max_element(), least);
                let ends = [around.low - margin, around.high + margin];
                for (axis, side) in (0..3).flat_map(|axis| [(axis, 0), (axis, 1)]) {
                    let first = nodes.len();
                    let plane = ends[side][axis];
                    nodes[at] = RegionNode { kind: axis as u32, plane, first: first as u32 };
                    nodes.extend([nothing; 2]);
                    at = first + 1 - side;
                }
                self.copy(root, at, &mut nodes, &number);
            }
        }
        nodes
    }

    fn copy(&self, from: usize, to: usize, nodes: &mut Vec<RegionNode>, number: &impl Fn(u32) -> Option<u32>) {
        let RegionNode { kind, plane, first } = self.nodes[from];
        if kind == REGION {
            let region = number(first);
            nodes[to] = region.map_or(nodes[to], |first| RegionNode { kind: REGION, plane: 0.0, first });
            return;
        }
        let place = nodes.len();
        nodes[to] = RegionNode { kind, plane, first: place as u32 };
        nodes.extend([RegionNode { kind: NOTHING, plane: 0.0, first: 0 }; 2]);
        for side in 0..2 {
            self.copy(first as usize + side, place + side, nodes, number);
        }
    }

    /// Returns the two halves of a node, or the region that it is.
    pub(super) fn halves(&self, node: usize) -> Result<[usize; 2], u32> {
        let RegionNode { kind, first, .. } = self.nodes[node];
        if kind == REGION { Err(first) } else { Ok([first as usize, first as usize + 1]) }
    }
}

/// How far regions reach beyond all reports, relative to the extent of these. *Chosen.*
///
/// Larger: what was learned at the edge holds farther away. Smaller: points next to those that were reported have no
/// region.
const MARGIN: f32 = 0.01;
