//! The tree as arrays of plain words, which do not depend on the arity, and as nodes of one arity.
//!
//! Everything outside of this folder sees [`Tlas`] and [`TlasView`] alone. A walk looks at the arity once, by
//! [`for_arity`], and works on a [`WideTree`] from then on.

use alloc::vec::Vec;

use super::arity::Arity;
use super::node::{Node, Slot, Spread};

/// Largest number of leaves of a tree. *Format*: with 16 lanes a node, numbers of slots fit into 32 bits.
pub(crate) const MAX_LEAVES: usize = (1 << 28) - 1;

/// A wide light tree.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tlas {
    pub(crate) arity: Arity,
    /// Nodes of the arity, as words: the root first, and a child always after its parent. Empty where there is no leaf
    /// or a single one.
    pub(crate) nodes: Vec<u32>,
    /// One a node.
    pub(crate) parents: Vec<Slot>,
    /// One a node.
    pub(crate) spreads: Vec<Spread>,
    /// One a leaf.
    pub(crate) leaves: Vec<Slot>,
}

/// A light tree in borrowed memory.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TlasView<'a> {
    pub(crate) arity: Arity,
    pub(crate) nodes: &'a [u32],
    pub(crate) parents: &'a [Slot],
    pub(crate) spreads: &'a [Spread],
    pub(crate) leaves: &'a [Slot],
}

/// A light tree of arity `N` in borrowed memory.
#[derive(Clone, Copy, Debug)]
pub(super) struct WideTree<'a, const N: usize> {
    pub(super) nodes: &'a [Node<N>],
    pub(super) parents: &'a [Slot],
    pub(super) spreads: &'a [Spread],
    pub(super) leaves: &'a [Slot],
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
    /// Returns the tree as borrowed slices, which all sampling works on.
    #[inline]
    pub(crate) fn view(&self) -> TlasView<'_> {
        TlasView {
            arity: self.arity,
            nodes: &self.nodes,
            parents: &self.parents,
            spreads: &self.spreads,
            leaves: &self.leaves,
        }
    }
}

impl<'a> TlasView<'a> {
    /// Returns the tree with nodes of its arity, which must be `N`. Words that are no whole number of nodes, which
    /// validation refuses, give no node.
    #[inline(always)]
    pub(super) fn wide<const N: usize>(&self) -> WideTree<'a, N> {
        WideTree {
            nodes: bytemuck::try_cast_slice(self.nodes).unwrap_or(&[]),
            parents: self.parents,
            spreads: self.spreads,
            leaves: self.leaves,
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
