//! A tree as words among others, so that any number of small trees can share one array.

use alloc::vec::Vec;

use super::arity::Arity;
use super::node::{Slot, Spread, words};
use super::tree::{Tlas, TlasView};

/// Words of a [`Spread`]. *Format.*
const SPREAD_WORDS: usize = size_of::<Spread>() / size_of::<u32>();

impl Arity {
    /// Returns the number of words of a node.
    const fn words(self) -> usize {
        match self {
            Self::Four => words::<4>(),
            Self::Eight => words::<8>(),
            Self::Sixteen => words::<16>(),
        }
    }
}

impl Tlas {
    /// Returns the numbers of nodes and of leaves.
    pub(crate) fn counts(&self) -> [usize; 2] {
        [self.parents.len(), self.leaves.len()]
    }

    /// Appends all buffers, one after the other.
    pub(crate) fn append_words(&self, to: &mut Vec<u32>) {
        to.extend_from_slice(&self.nodes);
        to.extend_from_slice(bytemuck::cast_slice(&self.parents));
        to.extend_from_slice(bytemuck::cast_slice(&self.spreads));
        to.extend_from_slice(bytemuck::cast_slice(&self.leaves));
    }
}

impl<'a> TlasView<'a> {
    /// Returns the number of words of a tree with these numbers of nodes and leaves; `None` where it overflows.
    pub(crate) fn word_count(arity: Arity, nodes: usize, leaves: usize) -> Option<usize> {
        nodes.checked_mul(arity.words() + 1 + SPREAD_WORDS)?.checked_add(leaves)
    }

    /// Returns the tree whose words come first, and the words after it. Without enough words, all of it is empty.
    #[inline]
    pub(crate) fn from_words(mut from: &'a [u32], arity: Arity, nodes: usize, leaves: usize) -> (Self, &'a [u32]) {
        let mut take = |count: usize| {
            let (taken, rest) = from.split_at_checked(count).unwrap_or((&[], &[]));
            from = rest;
            taken
        };
        let view = Self {
            arity,
            nodes: take(nodes * arity.words()),
            parents: bytemuck::try_cast_slice::<_, Slot>(take(nodes)).unwrap_or(&[]),
            spreads: bytemuck::try_cast_slice::<_, Spread>(take(nodes * SPREAD_WORDS)).unwrap_or(&[]),
            leaves: bytemuck::try_cast_slice::<_, Slot>(take(leaves)).unwrap_or(&[]),
            // An instance is in its groups as a whole.
            groups: &[],
        };
        (view, from)
    }
}
