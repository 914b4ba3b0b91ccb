//! The tree as arrays of plain words, which do not depend on the arity, and as nodes of one arity.
//!
//! Everything outside of this folder sees [`Tlas`] and [`TlasView`] alone. A walk looks at the arity once, by
//! [`for_arity`], and works on a [`WideTree`] from then on.

use alloc::vec::Vec;

use super::arity::Arity;
use super::node::{Node, Slot, Spread};
use crate::buffers::buffers;

/// Largest number of leaves of a tree. *Format*: with 16 lanes a node, numbers of slots fit into 32 bits.
pub(crate) const MAX_LEAVES: usize = (1 << 28) - 1;

buffers! {
    /// A wide light tree.
    pub(crate) Tlas,
    /// A light tree in borrowed memory.
    TlasView
    plain {
        /// Number of children of a node.
        arity: Arity,
    }
    buffers {
        /// Nodes of the arity, as words: the root first, and a child always after its parent. Empty where there is no
        /// leaf or a single one.
        nodes: u32 = b"NODE" version 1,
        /// Parent of each node.
        parents: Slot = b"PARE" version 1,
        /// Spread of the energies below each node.
        spreads: Spread = b"SPRE" version 1,
        /// Parent of each leaf.
        leaves: Slot = b"LSLO" version 1,
        /// Light groups that any light below each lane is in, by nodes. Empty if all lights are in all groups.
        groups: u32 = b"NGRP" version 1,
    }
}

/// A light tree of arity `N` in borrowed memory.
#[derive(Clone, Copy, Debug)]
pub(super) struct WideTree<'a, const N: usize> {
    pub(super) nodes: &'a [Node<N>],
    pub(super) parents: &'a [Slot],
    pub(super) spreads: &'a [Spread],
    pub(super) leaves: &'a [Slot],
    pub(super) groups: &'a [u32],
}

/// Evaluates an expression with the tree of a [`TlasView`] in its own arity.
macro_rules! for_arity {
    ($view:expr, $tree:ident => $body:expr) => {
        match $view.arity {
            Arity::Four => {
                let $tree = $view.wide::<4>();
                $body
            }
            Arity::Eight => {
                let $tree = $view.wide::<8>();
                $body
            }
            Arity::Sixteen => {
                let $tree = $view.wide::<16>();
                $body
            }
        }
    };
}
pub(super) use for_arity;

impl Tlas {
    /// Returns a tree without leaves.
    pub(super) fn empty(arity: Arity) -> Self {
        Self {
            arity,
            nodes: Vec::new(),
            parents: Vec::new(),
            spreads: Vec::new(),
            leaves: Vec::new(),
            groups: Vec::new(),
        }
    }
}

impl<'a> TlasView<'a> {
    /// Whether a leaf is in use, as all are in a tree that has not been edited.
    pub(crate) fn has_leaf(&self, leaf: u32) -> bool {
        self.leaves[leaf as usize] != Slot::FREE
    }

    /// Returns the number of leaves that an edit has left free.
    pub(crate) fn free_leaf_count(&self) -> usize {
        self.leaves.iter().filter(|slot| **slot == Slot::FREE).count()
    }

    /// Returns the tree with nodes of its arity, which must be `N`. Words that are no whole number of nodes, which
    /// validation refuses, give no node.
    #[inline(always)]
    pub(super) fn wide<const N: usize>(&self) -> WideTree<'a, N> {
        WideTree {
            nodes: bytemuck::try_cast_slice(self.nodes).unwrap_or(&[]),
            parents: self.parents,
            spreads: self.spreads,
            leaves: self.leaves,
            groups: self.groups,
        }
    }
}

impl<const N: usize> WideTree<'_, N> {
    /// Returns the node and the lane that refer to a node, or `None` for the root.
    #[inline]
    pub(super) fn parent(&self, node: usize) -> Option<(usize, usize)> {
        self.parents[node].get::<N>()
    }

    /// Returns the nodes and lanes on the way from a leaf to the root.
    pub(super) fn path(&self, leaf: u32) -> impl Iterator<Item = (usize, usize)> {
        core::iter::successors(self.leaves[leaf as usize].get::<N>(), |&(node, _)| self.parent(node))
    }
}
