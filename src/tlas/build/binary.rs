//! Top-down build of a binary light tree by the surface area orientation heuristic (Conty Estevez and Kulla 2018,
//! section 4.1).

use super::bins::Extent;
use super::cluster::Item;
use crate::parallel::{self, WORTHWHILE};
use crate::progress::Progress;

/// Depth below which lights are split into equal halves, so that no input can make the tree deeper than this plus the
/// logarithm of its size. A smaller depth would spoil good trees of very uneven scenes (balanced trees of 2^28 leaves
/// have a depth of 28), a larger one only lengthens the worst walk. *Proved* as a bound; the value is chosen with room
/// for unevenness.
const MAX_SAOH_DEPTH: u32 = 48;

/// Cost of a cluster of lights of different classes, which no lane may stand for. *Format*: no sum of costs is below
/// it.
pub(super) const JOINED: f32 = f32::INFINITY;

/// Node of the binary tree. The left child follows its parent, which is why a subtree of `n` leaves takes exactly
/// `2 n - 1` places and both halves can be built at once.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BinaryNode {
    /// What the cluster costs in the heuristic.
    pub(super) cost: f32,
    pub(super) count: u32,
    /// The number of the light in a leaf, the distance to the right child elsewhere.
    pub(super) link: u32,
}

/// Builds a subtree for each class of sizes into `nodes`, and joins them: the first class on the left of each join, all
/// others on the right. `classes` are the numbers of items of each class, in the order of `items`.
pub(super) fn join(items: &mut [Item], nodes: &mut [BinaryNode], classes: &[usize], progress: &Progress<'_>) {
    let [first, others @ ..] = classes else { return };
    if others.is_empty() {
        return subdivide(items, nodes, 0, progress);
    }
    let (root, below) = nodes.split_at_mut(1);
    root[0] = BinaryNode { cost: JOINED, count: items.len() as u32, link: 2 * *first as u32 };
    let (left_items, right_items) = items.split_at_mut(*first);
    let (left, right) = below.split_at_mut(2 * first - 1);
    subdivide(left_items, left, 0, progress);
    join(right_items, right, others, progress);
}

/// Builds the subtree over `items` into `nodes`, which holds exactly its `2 n - 1` places.
pub(super) fn subdivide(items: &mut [Item], nodes: &mut [BinaryNode], depth: u32, progress: &Progress<'_>) {
    let count = items.len();
    let is_large = count >= WORTHWHILE;
    if is_large && progress.check().is_err() {
        return;
    }
    let extent = Extent::of(items);
    let (root, below) = nodes.split_at_mut(1);
    root[0] = BinaryNode { cost: extent.all.cost(), count: count as u32, link: items[0].light };
    if count == 1 {
        return;
    }
    let middle = split(items, &extent, depth);
    root[0].link = 2 * middle as u32;
    let (left_items, right_items) = items.split_at_mut(middle);
    let (left, right) = below.split_at_mut(2 * middle - 1);
    parallel::both(
        || subdivide(left_items, left, depth + 1, progress),
        || subdivide(right_items, right, depth + 1, progress),
        count,
    );
    if is_large {
        let counted = |part: usize| if part < WORTHWHILE { part } else { 0 };
        progress.add(counted(middle) + counted(count - middle));
    }
}

/// Orders the items so that the cheapest split found lies at the returned place, strictly inside.
fn split(items: &mut [Item], extent: &Extent, depth: u32) -> usize {
    let half = items.len() / 2;
    if items.len() == 2 {
        return half;
    }
    if depth >= MAX_SAOH_DEPTH {
        let axis = extent.longest_axis();
        let key = |item: &Item| item.double_center()[axis];
        items.select_nth_unstable_by(half, |a, b| key(a).total_cmp(&key(b)).then(a.light.cmp(&b.light)));
        return half;
    }
    let Some(split) = extent.cheapest_split(items) else { return half };
    let middle = partition(items, |item| split.is_left(item));
    if middle == 0 || middle == items.len() { half } else { middle }
}

/// Moves the items that belong to the left to the front, and counts them.
pub(super) fn partition(items: &mut [Item], is_left: impl Fn(&Item) -> bool) -> usize {
    let (mut from, mut to) = (0, items.len());
    loop {
        while from < to && is_left(&items[from]) {
            from += 1;
        }
        while from < to && !is_left(&items[to - 1]) {
            to -= 1;
        }
        if from == to {
            return from;
        }
        items.swap(from, to - 1);
        from += 1;
        to -= 1;
    }
}
