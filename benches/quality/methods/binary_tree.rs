//! The binary light tree of pbrt-v4's `BVHLightSampler`, with nodes of full floats: binned surface area orientation
//! heuristic, one importance a child, and a trail of bits for the probability of a given light.

use ::fanlight::ShadingPoint;
use glam::Vec3;

use super::light_bounds::LightBounds;

const BUCKETS: usize = 12;
const LEAF: u32 = 1 << 31;

struct Node {
    bounds: LightBounds,
    /// Light of a leaf with [`LEAF`], else the second child; the first one follows its parent.
    link: u32,
}

pub(crate) struct BinaryTree {
    nodes: Vec<Node>,
    /// Way to each light, the first step in the lowest bit.
    trails: Vec<u64>,
}

impl BinaryTree {
    pub(crate) fn new(lights: &[LightBounds]) -> Self {
        let mut items: Vec<(LightBounds, u32)> =
            lights.iter().copied().zip(0..).filter(|(light, _)| light.phi > 0.0).collect();
        let mut tree = Self { nodes: Vec::with_capacity(2 * items.len()), trails: vec![0; lights.len()] };
        tree.subdivide(&mut items, 0, 0);
        tree
    }

    fn subdivide(&mut self, items: &mut [(LightBounds, u32)], trail: u64, depth: u32) -> LightBounds {
        let at = self.nodes.len();
        if let [(bounds, light)] = *items {
            self.trails[light as usize] = trail;
            self.nodes.push(Node { bounds, link: light | LEAF });
            return bounds;
        }
        assert!(depth < 64, "the trail is too short");
        let middle = split(items);
        let (first, second) = items.split_at_mut(middle);
        self.nodes.push(Node { bounds: first[0].0, link: 0 });
        let a = self.subdivide(first, trail, depth + 1);
        self.nodes[at].link = self.nodes.len() as u32;
        let b = self.subdivide(second, trail | (1 << depth), depth + 1);
        self.nodes[at].bounds = LightBounds::union(a, b);
        self.nodes[at].bounds
    }

    /// Bounds of a node, and its children or, of a leaf, its light.
    pub(super) fn node(&self, at: usize) -> (&LightBounds, Result<[usize; 2], usize>) {
        let Node { bounds, link } = &self.nodes[at];
        let is_leaf = link & LEAF != 0;
        (bounds, if is_leaf { Err((link & !LEAF) as usize) } else { Ok([at + 1, *link as usize]) })
    }

    /// Draws a light. `u` comes back rescaled.
    pub(crate) fn sample(&self, x: &ShadingPoint, u: &mut f64) -> Option<(usize, f64)> {
        let (mut at, mut pmf) = (0, 1.0);
        loop {
            let node = &self.nodes[at];
            if node.link & LEAF != 0 {
                let visible = at > 0 || node.bounds.importance(x) > 0.0;
                return visible.then_some(((node.link & !LEAF) as usize, pmf));
            }
            let share = self.second_share(at, x)?;
            if *u < 1.0 - share {
                *u /= 1.0 - share;
                pmf *= 1.0 - share;
                at += 1;
            } else {
                *u = (*u - (1.0 - share)) / share;
                pmf *= share;
                at = node.link as usize;
            }
        }
    }

    /// Probability of drawing a light.
    pub(crate) fn pmf(&self, x: &ShadingPoint, light: usize) -> f64 {
        let (mut at, mut pmf, mut trail) = (0, 1.0, self.trails[light]);
        loop {
            let node = &self.nodes[at];
            if node.link & LEAF != 0 {
                return if at > 0 || node.bounds.importance(x) > 0.0 { pmf } else { 0.0 };
            }
            let Some(share) = self.second_share(at, x) else { return 0.0 };
            if trail & 1 == 1 {
                pmf *= share;
                at = node.link as usize;
            } else {
                pmf *= 1.0 - share;
                at += 1;
            }
            trail >>= 1;
        }
    }

    /// Probability of the second child, or `None` if neither can send anything.
    #[inline]
    fn second_share(&self, at: usize, x: &ShadingPoint) -> Option<f64> {
        let first = self.nodes[at + 1].bounds.importance(x);
        let second = self.nodes[self.nodes[at].link as usize].bounds.importance(x);
        (first + second > 0.0).then(|| f64::from(second) / (f64::from(first) + f64::from(second)))
    }

    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.trails[..])
    }
}

/// Orders items around the cheapest split and returns its place.
fn split(items: &mut [(LightBounds, u32)]) -> usize {
    let half = items.len() / 2;
    let infinity = Vec3::splat(f32::INFINITY);
    let (mut low, mut high) = ((infinity, infinity), (-infinity, -infinity));
    for (bounds, _) in &*items {
        low = (low.0.min(bounds.min), low.1.min(bounds.center()));
        high = (high.0.max(bounds.max), high.1.max(bounds.center()));
    }
    let diagonal = high.0 - low.0;
    let bucket = |bounds: &LightBounds, axis: usize| {
        let offset = (bounds.center()[axis] - low.1[axis]) / (high.1[axis] - low.1[axis]);
        ((BUCKETS as f32 * offset) as usize).min(BUCKETS - 1)
    };
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in (0..3).filter(|&axis| high.1[axis] > low.1[axis]) {
        let mut buckets = [None; BUCKETS];
        for (bounds, _) in &*items {
            add(&mut buckets[bucket(bounds, axis)], *bounds);
        }
        let regularity = diagonal.max_element() / diagonal[axis];
        for (i, cost) in costs(&buckets) {
            let cost = cost * regularity;
            if cost > 0.0 && best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, i));
            }
        }
    }
    let Some((_, axis, last)) = best else { return half };
    let mut middle = 0;
    for i in 0..items.len() {
        if bucket(&items[i].0, axis) <= last {
            items.swap(i, middle);
            middle += 1;
        }
    }
    if middle == 0 || middle == items.len() { half } else { middle }
}

fn add(sum: &mut Option<LightBounds>, bounds: LightBounds) {
    *sum = Some(sum.map_or(bounds, |sum| LightBounds::union(sum, bounds)));
}

/// Cost of a split after each bucket.
fn costs(buckets: &[Option<LightBounds>; BUCKETS]) -> impl Iterator<Item = (usize, f32)> {
    let sum = |range: &[Option<LightBounds>]| {
        range.iter().flatten().copied().reduce(LightBounds::union).map_or(0.0, |bounds| bounds.cost())
    };
    (0..BUCKETS - 1).map(move |i| (i, sum(&buckets[..=i]) + sum(&buckets[i + 1..])))
}
