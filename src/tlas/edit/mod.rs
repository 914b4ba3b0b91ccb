//! Edits of a finished tree: leaves come, go and change, and the tree follows, in time that does not grow with it.
//!
//! The leaves of a node are neighbors in memory, and so are the nodes below it. A node that gets one child more moves
//! its children to a free place that has room for them, and leaves theirs to others ([`blocks`]). A new leaf goes down
//! from the root, to the child that grows least in the surface area orientation heuristic (Conty Estevez and Kulla
//! 2018, section 4.1), until a node has room; a full node of leaves gives the new leaf and the leaf next to it a node
//! of their own ([`place`]).
//!
//! What a node says of its children is computed from their exact bounds ([`TreeState`] keeps those of all nodes), by
//! the code that fits a built tree. So an edited tree says what a fresh fit of the same shape would say, however many
//! edits there have been. Only nodes above an edit are fitted again, once for a whole batch.
//!
//! The shape gets worse with every leaf that comes or goes. A subtree in which there were half as many such edits as it
//! has leaves is built again ([`rebuild`]), as in a scapegoat tree (Galperin and Rivest 1993), which costs each edit a
//! constant share of a build at each level of the tree.

mod blocks;
mod place;
mod rebuild;
mod relayout;
#[cfg(test)]
mod tests;

use alloc::vec::Vec;

use smallvec::SmallVec;

use super::arity::{Arity, MAX_LANES};
use super::build::Fitted;
use super::node::{Child, Node, Slot, Spread, words};
use super::tree::Tlas;
use crate::bounds::{LightBounds, Moments};
use blocks::FreeBlocks;
pub(crate) use relayout::relayout;

/// Edits of a subtree's shape, relative to its number of leaves, after which it is built again. *Measured* on edited
/// clouds (docs/ACCURACY.md, "Edits").
///
/// Larger: choices get noisier between builds. Smaller: edits take longer. It must be below 1 (*proved*): a subtree of
/// new leaves alone has more leaves than edits, and would never be built again, however deep it is.
const REBUILT_SHARE: f32 = 0.5;

/// Fewest edits after which a subtree is built again. *Chosen*: two nodes of leaves.
///
/// Larger: small subtrees get worse. Smaller: small subtrees are built for a handful of edits.
const LEAST_EDITS: u32 = 32;

/// Depth from which on a new leaf looks for a subtree above it that is to be built again, without waiting for the end
/// of the batch. *Chosen*: more than twice the depth of a built tree of a million lights.
///
/// Larger: long batches of lights at one place take longer. Smaller: searches of deep trees find nothing.
const DEEP: usize = 32;

/// Free places, relative to those in use, above which a tree is laid out again. *Chosen* as a bound of the memory.
///
/// Larger: more memory. Smaller: edits take longer.
const MOST_FREE: f32 = 0.5;

/// Free places that are never worth a new layout. *Chosen*: a few kilobytes.
const FEW_FREE: usize = 256;

/// The lights in the leaves of a tree that is edited.
pub(crate) trait LeafStore {
    /// What is kept of a light.
    type Leaf: Copy;

    /// Returns bounds and moments of a light in the unit of the tree.
    fn bounds(&self, light: &Self::Leaf) -> (LightBounds, Moments);

    /// Returns what is in a leaf.
    fn get(&self, leaf: u32) -> Self::Leaf;

    /// Returns the light groups of a leaf.
    fn groups(&self, leaf: u32) -> u32;

    /// Takes the light out of a leaf, which is free then.
    fn take(&mut self, leaf: u32) -> Self::Leaf;

    /// Puts a light into a free leaf.
    fn put(&mut self, leaf: u32, light: Self::Leaf);

    /// Sets the number of leaves. New ones are free, and those that vanish are.
    fn resize(&mut self, leaves: usize);
}

/// What edits of a tree need to know beside it.
#[derive(Clone, Default)]
pub(crate) struct TreeState {
    nodes: Vec<NodeState>,
    free_nodes: FreeBlocks,
    free_leaves: FreeBlocks,
}

crate::buffers::debug_counts!(TreeState, state => {
    nodes: state.nodes.len(),
    free_nodes: state.free_nodes.count(),
    free_leaves: state.free_leaves.count(),
});

impl TreeState {
    /// Returns the number of bytes that this takes.
    pub(crate) fn byte_size(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of::<u32>() * (self.free_nodes.count() + self.free_leaves.count())
    }

    /// Returns the number of leaves that are free.
    pub(crate) fn free_leaf_count(&self) -> usize {
        self.free_leaves.count()
    }
}

/// What is kept of a node beside the tree.
#[derive(Clone, Copy, Debug)]
struct NodeState {
    /// Exact bounds and sums of what is below. Until the end of a batch, they lack what it has changed.
    fitted: Fitted,
    /// Leaves that came to the subtree or went since it was built.
    edits: u32,
    /// Whether anything below has changed in this batch.
    is_changed: bool,
}

impl NodeState {
    const NEW: Self = Self { fitted: Fitted::NONE, edits: 0, is_changed: true };
}

/// A tree with what it takes to edit it.
pub(crate) struct TreeEdit<'t, S> {
    pub(crate) tlas: &'t mut Tlas,
    pub(crate) state: &'t mut TreeState,
    pub(crate) store: &'t mut S,
}

/// Edit of a tree in its own arity.
struct WideEdit<'t, const N: usize, S> {
    tlas: &'t mut Tlas,
    state: &'t mut TreeState,
    store: &'t mut S,
}

/// Evaluates an expression with the edited tree in its own arity.
macro_rules! in_arity {
    ($edit:expr, $wide:ident => $body:expr) => {{
        let TreeEdit { tlas, state, store } = $edit;
        match tlas.arity {
            Arity::Four => {
                let mut $wide = WideEdit::<4, S> { tlas, state, store };
                $body
            }
            Arity::Eight => {
                let mut $wide = WideEdit::<8, S> { tlas, state, store };
                $body
            }
            Arity::Sixteen => {
                let mut $wide = WideEdit::<16, S> { tlas, state, store };
                $body
            }
        }
    }};
}

impl<S: LeafStore> TreeEdit<'_, S> {
    /// Prepares a tree that has not been edited before: gives it a root, if it has none, and computes what edits need.
    pub(crate) fn prepare(&mut self) {
        if self.tlas.parents.is_empty() {
            in_arity!(self, wide => wide.add_root());
        }
        let count = self.tlas.parents.len();
        self.state.nodes.clear();
        self.state.nodes.resize(count, NodeState::NEW);
        self.fit_all();
    }

    /// Fits all nodes: when the unit of energies has changed.
    pub(crate) fn fit_all(&mut self) {
        self.state.nodes.iter_mut().for_each(|node| node.is_changed = true);
        in_arity!(self, wide => wide.fit_changed(0, false));
    }

    /// Puts a light in a new leaf.
    pub(crate) fn insert(&mut self, light: S::Leaf) {
        // Where all will be built again at the end of the batch, any place will do.
        if self.is_worn() {
            self.state.nodes[0].edits += 1;
            in_arity!(self, wide => wide.add_loose(light));
        } else {
            in_arity!(self, wide => wide.insert(light));
        }
    }

    /// Whether there were enough edits that all of the tree is to be built again. In a batch, it stays so.
    fn is_worn(&self) -> bool {
        self.state.nodes[0].edits > most_edits(self.leaf_count() as f32)
    }

    /// Removes a leaf. Returns the light that was in it.
    pub(crate) fn remove(&mut self, leaf: u32) -> S::Leaf {
        in_arity!(self, wide => wide.remove(leaf))
    }

    /// Notes that the light in a leaf has changed. One that has left the bounds of its node looks for another.
    pub(crate) fn update(&mut self, leaf: u32) {
        in_arity!(self, wide => wide.update(leaf));
    }

    /// Ends a batch: fits what has changed, and builds again what has changed too much. `arity` is that of large trees.
    /// Returns whether all was built again.
    pub(crate) fn finish(&mut self, arity: Arity) -> bool {
        if self.is_worn() || (self.tlas.arity != arity && self.leaf_count() > self.tlas.arity.lanes()) {
            self.rebuild(arity);
            return true;
        }
        in_arity!(self, wide => wide.fit_changed(0, true));
        self.compact();
        false
    }

    /// Returns the sum of the energies of all leaves, in the unit of the tree. Valid at the end of a batch.
    pub(crate) fn energy(&self) -> f64 {
        self.state.nodes[0].fitted.sum
    }

    /// Returns the tree's cost, as [`Tlas::fit`] does. Valid at the end of a batch.
    pub(crate) fn cost(&self) -> f64 {
        self.state.nodes[0].fitted.relative_cost()
    }

    /// Returns the number of leaves that are in use.
    pub(crate) fn leaf_count(&self) -> usize {
        self.tlas.leaves.len() - self.state.free_leaves.count()
    }

    /// Lays out the tree again if too many places are free.
    fn compact(&mut self) {
        let is_sparse = |free: usize, all: usize| free > FEW_FREE && free as f32 > MOST_FREE * (all - free) as f32;
        let (nodes, leaves) = (self.state.free_nodes.count(), self.state.free_leaves.count());
        if is_sparse(nodes, self.tlas.parents.len()) || is_sparse(leaves, self.tlas.leaves.len()) {
            let (tlas, nodes, leaves) = relayout(&self.tlas.view());
            let lights: Vec<S::Leaf> = leaves.iter().map(|&leaf| self.store.take(leaf)).collect();
            self.store.resize(lights.len());
            (0..).zip(lights).for_each(|(leaf, light)| self.store.put(leaf, light));
            *self.tlas = tlas;
            let nodes = nodes.iter().map(|&node| self.state.nodes[node as usize]).collect();
            *self.state = TreeState { nodes, ..TreeState::default() };
        }
    }
}

/// Returns the most edits of a subtree with `leaves` leaves before it is built again.
fn most_edits(leaves: f32) -> u32 {
    ((REBUILT_SHARE * leaves) as u32).max(LEAST_EDITS)
}

impl<const N: usize, S: LeafStore> WideEdit<'_, N, S> {
    fn nodes(&self) -> &[Node<N>] {
        bytemuck::cast_slice(&self.tlas.nodes)
    }

    fn node(&self, index: usize) -> &Node<N> {
        &self.nodes()[index]
    }

    fn node_mut(&mut self, index: usize) -> &mut Node<N> {
        &mut bytemuck::cast_slice_mut(&mut self.tlas.nodes)[index]
    }

    /// Returns numbers of a node: of its first child node, of its child nodes, of its first leaf, and of its leaves.
    fn children(&self, index: usize) -> [usize; 4] {
        let node = self.node(index);
        let (nodes, width) = (usize::from(node.node_count), usize::from(node.width));
        [node.first_node as usize, nodes, node.first_leaf as usize, width - nodes]
    }

    /// Adds a root over the leaf of a tree without nodes, or over none.
    fn add_root(&mut self) {
        let leaves = self.tlas.leaves.len();
        self.allocate_nodes(1);
        self.tlas.parents[0] = Slot::ROOT;
        *self.node_mut(0) = Node::new(0, 0, 0, leaves);
        (0..leaves).for_each(|leaf| self.tlas.leaves[leaf] = Slot::new::<N>(0, leaf));
    }

    /// Returns the first of `count` free nodes.
    fn allocate_nodes(&mut self, count: usize) -> usize {
        let free = if count == 0 { Some(0) } else { self.state.free_nodes.take(count) };
        free.unwrap_or_else(|| {
            let first = self.tlas.parents.len();
            let all = first + count;
            self.tlas.nodes.resize(all * words::<N>(), 0);
            self.tlas.parents.resize(all, Slot::FREE);
            self.tlas.spreads.resize(all, Spread::default());
            self.state.nodes.resize(all, NodeState::NEW);
            if !self.tlas.groups.is_empty() {
                self.tlas.groups.resize(all * N, 0);
            }
            first
        })
    }

    /// Returns the first of `count` free leaves.
    fn allocate_leaves(&mut self, count: usize) -> usize {
        let free = if count == 0 { Some(0) } else { self.state.free_leaves.take(count) };
        free.unwrap_or_else(|| {
            let first = self.tlas.leaves.len();
            self.tlas.leaves.resize(first + count, Slot::FREE);
            self.store.resize(first + count);
            first
        })
    }

    /// Fits a node and what has changed below it. Where that is too much, builds the subtree again, if `rebuilds`.
    fn fit_changed(&mut self, index: usize, rebuilds: bool) {
        let state = &self.state.nodes[index];
        if !state.is_changed {
            return;
        }
        if rebuilds && index > 0 && state.edits > most_edits(state.fitted.leaf_count()) {
            return self.rebuild_below(index);
        }
        let [first, nodes, ..] = self.children(index);
        (first..first + nodes).for_each(|child| self.fit_changed(child, rebuilds));
        self.fit(index);
    }

    /// Gives a node the bounds of its children.
    #[inline(never)]
    fn fit(&mut self, index: usize) {
        let [first_node, nodes, first_leaf, leaves] = self.children(index);
        let mut lanes = SmallVec::<[Fitted; MAX_LANES]>::new();
        lanes.extend((first_node..first_node + nodes).map(|child| self.state.nodes[child].fitted));
        let leaf = |leaf: usize| Fitted::leaf(self.store.bounds(&self.store.get(leaf as u32)));
        lanes.extend((first_leaf..first_leaf + leaves).map(leaf));
        let mut node = Node::<N>::new(first_node, nodes, first_leaf, nodes + leaves);
        let (fitted, spread) = node.fit(&lanes);
        *self.node_mut(index) = node;
        self.tlas.spreads[index] = spread;
        let state = &mut self.state.nodes[index];
        (state.fitted, state.is_changed) = (fitted, false);
        self.fit_groups(index);
    }

    /// Notes the light groups of what is below each lane of a node.
    fn fit_groups(&mut self, index: usize) {
        if self.tlas.groups.is_empty() {
            return;
        }
        let node = *self.node(index);
        for lane in 0..N {
            self.tlas.groups[index * N + lane] = match node.child(lane) {
                Child::Empty => 0,
                Child::Leaf(leaf) => self.store.groups(leaf),
                Child::Node(child) => {
                    let first = child as usize * N;
                    self.tlas.groups[first..first + N].iter().fold(0, |all, groups| all | groups)
                }
            };
        }
    }

    /// Marks a node and all above it as changed.
    fn mark(&mut self, mut index: usize, edits: u32) {
        loop {
            let state = &mut self.state.nodes[index];
            state.is_changed = true;
            state.edits += edits;
            match self.tlas.parents[index].get::<N>() {
                Some((parent, _)) => index = parent,
                None => return,
            }
        }
    }
}
