//! Top-down build of a binary light tree by the surface area orientation heuristic (Conty Estevez and Kulla 2018,
//! section 4.1).

use bytemuck::Zeroable;

use super::bins::{Extent, Scratch};
use super::cluster::Item;
use crate::parallel::{self, WORTHWHILE};
use crate::progress::Progress;

/// Depth below which lights are split into equal halves, so that no input can make the tree deeper than this plus the
/// logarithm of its size. A smaller depth would spoil good trees of very uneven scenes (balanced trees of 2^28 leaves
/// have a depth of 28), a larger one only lengthens the worst walk. *Proved* as a bound; the value is chosen with room
/// for unevenness.
const MAX_SAOH_DEPTH: u32 = 48;

/// Items that are marked at once where a set is parted. *Chosen*: a word of marks holds two blocks.
const BLOCK: usize = 32;

/// Cost of a cluster of lights of different classes, which no lane may stand for. *Format*: no sum of costs is below
/// it.
pub(super) const JOINED: f32 = f32::INFINITY;

/// Node of the binary tree. The left child follows its parent, which is why a subtree of `n` leaves takes exactly
/// `2 n - 1` places and both halves can be built at once.
#[derive(Clone, Copy, Debug, Zeroable)]
pub(super) struct BinaryNode {
    /// What the cluster costs in the heuristic; 0 for a leaf, which nothing asks for.
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
    if count < WORTHWHILE {
        subdivide_few(items, nodes, depth, &mut Scratch::new());
        return;
    }
    if progress.check().is_err() {
        return;
    }
    let Halves { left, right, middle } = halve(items, nodes, depth, &mut Scratch::new());
    parallel::both(
        || subdivide(left.0, left.1, depth + 1, progress),
        || subdivide(right.0, right.1, depth + 1, progress),
        count,
    );
    let counted = |part: usize| if part < WORTHWHILE { part } else { 0 };
    progress.add(counted(middle) + counted(count - middle));
}

/// Does what [`subdivide`] does, on one thread.
fn subdivide_few(items: &mut [Item], nodes: &mut [BinaryNode], depth: u32, scratch: &mut Scratch) {
    if let [item] = items {
        nodes[0] = BinaryNode { cost: 0.0, count: 1, link: item.light() };
        return;
    }
    let Halves { left, right, .. } = halve(items, nodes, depth, scratch);
    subdivide_few(left.0, left.1, depth + 1, scratch);
    subdivide_few(right.0, right.1, depth + 1, scratch);
}

/// Items and nodes below a node.
struct Halves<'a> {
    left: (&'a mut [Item], &'a mut [BinaryNode]),
    right: (&'a mut [Item], &'a mut [BinaryNode]),
    /// Number of items on the left.
    middle: usize,
}

/// Orders the items, of which there are two or more, and writes the root of the subtree over them.
fn halve<'a>(items: &'a mut [Item], nodes: &'a mut [BinaryNode], depth: u32, scratch: &mut Scratch) -> Halves<'a> {
    let extent = Extent::of(items);
    let middle = split(items, &extent, depth, scratch);
    let (root, below) = nodes.split_at_mut(1);
    root[0] = BinaryNode { cost: extent.all.cost(), count: items.len() as u32, link: 2 * middle as u32 };
    let (left_items, right_items) = items.split_at_mut(middle);
    let (left, right) = below.split_at_mut(2 * middle - 1);
    Halves { left: (left_items, left), right: (right_items, right), middle }
}

/// Orders the items so that the cheapest split found lies at the returned place, strictly inside.
fn split(items: &mut [Item], extent: &Extent, depth: u32, scratch: &mut Scratch) -> usize {
    let half = items.len() / 2;
    if items.len() == 2 {
        return half;
    }
    if depth >= MAX_SAOH_DEPTH {
        let axis = extent.longest_axis();
        let key = |item: &Item| item.double_center()[axis];
        items.select_nth_unstable_by(half, |a, b| key(a).total_cmp(&key(b)).then(a.light().cmp(&b.light())));
        return half;
    }
    let Some(split) = extent.cheapest_split(items, scratch) else { return half };
    let middle = partition(items, |item| split.is_left(item));
    if middle == 0 || middle == items.len() { half } else { middle }
}

/// Moves the items that belong to the left to the front, and counts them. Of the items that are not on their side, the
/// first one changes places with the last one, and so on inwards.
///
/// The side of an item is as good as random, and a branch on it would be mispredicted half of the time. So the items
/// of a block are marked first, and only those with a mark are visited (Edelkamp and Weiss 2016).
pub(super) fn partition(items: &mut [Item], is_left: impl Fn(&Item) -> bool) -> usize {
    let (mut from, mut to) = (0, items.len());
    // Items at either end that are not on their side, counted from the end.
    let (mut low, mut high) = (0, 0);
    while to - from > 2 * BLOCK {
        if low == 0 {
            low = marks(items[from..from + BLOCK].iter(), |item| !is_left(item));
        }
        if high == 0 {
            high = marks(items[to - BLOCK..to].iter().rev(), &is_left);
        }
        while low != 0 && high != 0 {
            items.swap(from + low.trailing_zeros() as usize, to - 1 - high.trailing_zeros() as usize);
            low &= low - 1;
            high &= high - 1;
        }
        from += if low == 0 { BLOCK } else { 0 };
        to -= if high == 0 { BLOCK } else { 0 };
    }
    from + partition_few(&mut items[from..to], is_left)
}

/// Does what [`partition`] does to at most 64 items.
fn partition_few(items: &mut [Item], is_left: impl Fn(&Item) -> bool) -> usize {
    let left = marks(items.iter(), is_left);
    let count = left.count_ones();
    let in_front = 1u64.checked_shl(count).map_or(u64::MAX, |end| end - 1);
    let (mut low, mut high) = (in_front & !left, left & !in_front);
    while low != 0 {
        let last = high.ilog2();
        items.swap(low.trailing_zeros() as usize, last as usize);
        low &= low - 1;
        high ^= 1 << last;
    }
    count as usize
}

/// Returns the places of the items that have a property, as bits.
#[inline(always)]
fn marks<'a>(items: impl Iterator<Item = &'a Item>, is_marked: impl Fn(&Item) -> bool) -> u64 {
    items.enumerate().fold(0, |bits, (i, item)| bits | u64::from(is_marked(item)) << i)
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use super::*;
    use crate::bounds::LightBounds;

    /// Partitions the items with a branch for each item.
    fn partition_one_by_one(items: &mut [Item], is_left: impl Fn(&Item) -> bool) -> usize {
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

    #[test]
    fn blocks_give_the_order_of_single_items() {
        let mut bits = 1u32;
        for count in [1, 2, 3, 31, 63, 64, 65, 66, 127, 128, 129, 500] {
            for threshold in [0, 1 << 28, 1 << 31, 7 << 29, u32::MAX] {
                let mut next = || {
                    bits = bits.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
                    bits
                };
                let bounds = LightBounds { flux: 1.0, ..LightBounds::NONE };
                let sides: Vec<bool> = (0..count).map(|_| next() < threshold).collect();
                let mut items: Vec<Item> = (0..count).map(|i| Item::new(&bounds, i)).collect();
                let mut others = items.clone();
                let is_left = |item: &Item| sides[item.light() as usize];
                let middle = partition(&mut items, is_left);
                assert_eq!(middle, partition_one_by_one(&mut others, is_left));
                assert!(items.iter().map(Item::light).eq(others.iter().map(Item::light)), "{count} {threshold}");
            }
        }
    }
}
