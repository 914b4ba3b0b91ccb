//! Lights of different light groups apart.
//!
//! A cluster that holds lights of several groups has the energy of all of them. Where a bright one is left out, its
//! cluster would still be chosen as often, and what is dim elsewhere would starve. So lights of the same groups get
//! trees of their own, which the root joins, as it does for lights of different size ([`classes`](super::classes)).

use alloc::collections::BTreeMap;
use alloc::vec;
use alloc::vec::Vec;

use smallvec::SmallVec;

use super::binary::partition;
use super::classes::{MOST_CLASSES, divide};
use super::cluster::Item;
use crate::tlas::arity::{Arity, MAX_LANES};
use crate::tlas::node::{Child, Node};
use crate::tlas::tree::Tlas;

/// Most sets of groups with trees of their own. Chosen, not swept: keys, fills, and what everything else is in.
///
/// Larger: fewer lanes of the root for each. Smaller: lights of more sets share the last tree.
const MOST_SETS: usize = 4;

/// Sorts lights into at most `most` classes, by sets of groups first and by size then. Returns the number of lights in
/// each class. Sets with less energy than the first ones share the last.
pub(super) fn divide_groups(items: &mut [Item], groups: &[u32], most: usize) -> SmallVec<[usize; MOST_CLASSES]> {
    let set = |item: &Item| groups[item.light() as usize];
    let mut energies = BTreeMap::new();
    items.iter().for_each(|item| *energies.entry(set(item)).or_insert(0.0) += f64::from(item.energy()));
    let mut sets: Vec<(u32, f64)> = energies.into_iter().collect();
    sets.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    sets.truncate(MOST_SETS.min(most));
    let most = (most / sets.len().max(1)).clamp(1, MOST_CLASSES);
    let mut classes = SmallVec::new();
    let mut rest = items;
    for (i, (own, _)) in sets.iter().enumerate() {
        let is_last = i + 1 == sets.len();
        let count = if is_last { rest.len() } else { partition(rest, |item| set(item) == *own) };
        let (own, others) = rest.split_at_mut(count);
        classes.extend(divide(own, most));
        rest = others;
    }
    classes
}

impl Tlas {
    /// Notes for every lane the light groups that any light below it is in.
    pub(super) fn note_groups(&mut self, groups: impl Fn(u32) -> u32) {
        match self.arity {
            Arity::Four => self.note::<4>(groups),
            Arity::Eight => self.note::<8>(groups),
            Arity::Sixteen => self.note::<16>(groups),
        }
    }

    fn note<const N: usize>(&mut self, groups: impl Fn(u32) -> u32) {
        let nodes: &[Node<N>] = bytemuck::cast_slice(&self.nodes);
        let mut noted = vec![0; nodes.len() * N];
        // Children come after their parents.
        for (index, node) in nodes.iter().enumerate().rev() {
            let mut lanes = [0; MAX_LANES];
            for (lane, below) in lanes.iter_mut().enumerate().take(N) {
                *below = match node.child(lane) {
                    Child::Empty => 0,
                    Child::Leaf(leaf) => groups(leaf),
                    Child::Node(child) => {
                        let first = child as usize * N;
                        noted[first..first + N].iter().fold(0, |all, groups| all | groups)
                    }
                };
            }
            noted[index * N..(index + 1) * N].copy_from_slice(&lanes[..N]);
        }
        self.groups = noted;
    }
}
