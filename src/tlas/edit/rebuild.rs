//! Parts of an edited tree, or all of it, built again.

use alloc::vec::Vec;

use super::{LeafStore, NodeState, TreeEdit, TreeState, WideEdit};
use crate::bounds::LightBounds;
use crate::progress::Progress;
use crate::tlas::arity::Arity;
use crate::tlas::build::{arrange, build_in_groups};
use crate::tlas::node::{Child, Node, Slot};

/// Energy of a light that is switched off, for the build, which expects all lights to have some. *Chosen*: far below
/// that of any light.
const SWITCHED_OFF_ENERGY: f32 = 1e-36;

/// Returns the bounds by which a light finds its place.
fn placing(mut bounds: LightBounds) -> LightBounds {
    if !(bounds.energy() > SWITCHED_OFF_ENERGY) {
        bounds.flux = SWITCHED_OFF_ENERGY;
    }
    bounds
}

impl<S: LeafStore> TreeEdit<'_, S> {
    /// Builds the whole tree again, of this arity or of one that holds all lights in one node.
    pub(super) fn rebuild(&mut self, arity: Arity) {
        let leaves = 0..self.tlas.leaves.len() as u32;
        let leaves: Vec<u32> = leaves.filter(|&leaf| self.tlas.leaves[leaf as usize] != Slot::FREE).collect();
        let groups: Vec<u32> = if self.tlas.groups.is_empty() {
            Vec::new()
        } else {
            leaves.iter().map(|&leaf| self.store.groups(leaf)).collect()
        };
        let lights: Vec<S::Leaf> = leaves.iter().map(|&leaf| self.store.get(leaf)).collect();
        let bounds: Vec<LightBounds> = lights.iter().map(|light| placing(self.store.bounds(light).0)).collect();
        let light = |i: u32| bounds[i as usize];
        // Nobody can cancel it.
        let Ok((tlas, order)) = build_in_groups(arity, lights.len(), &light, &groups, &Progress::new(None, 1.0)) else {
            return;
        };
        for leaf in leaves {
            self.store.take(leaf);
        }
        self.store.resize(order.len());
        (0..).zip(order).for_each(|(leaf, i)| self.store.put(leaf, lights[i as usize]));
        let has_groups = !self.tlas.groups.is_empty();
        *self.tlas = tlas;
        *self.state = TreeState::default();
        self.prepare();
        // A tree of one leaf or none has been given its root here.
        if has_groups && self.tlas.groups.is_empty() {
            self.tlas.groups.resize(self.tlas.arity.lanes(), 0);
            self.fit_all();
        }
    }
}

impl<const N: usize, S: LeafStore> WideEdit<'_, N, S> {
    /// Builds the subtree below a node again.
    pub(super) fn rebuild_below(&mut self, index: usize) {
        let mut lights = Vec::new();
        self.take_below(index, &mut lights);
        let bounds: Vec<LightBounds> = lights.iter().map(|light| placing(self.store.bounds(light).0)).collect();
        let Some((built, order)) = arrange(self.tlas.arity, &bounds) else {
            *self.node_mut(index) = Node::new(0, 0, 0, 0);
            lights.into_iter().for_each(|light| self.add_leaf(index, light));
            return self.fit(index);
        };
        let nodes: &[Node<N>] = bytemuck::cast_slice(&built.nodes);
        // Where each node of the new subtree is in this tree. Children come after their parents.
        let mut places = Vec::new();
        places.resize(nodes.len(), index);
        for (i, node) in nodes.iter().enumerate() {
            let (place, children) = (places[i], usize::from(node.node_count));
            let leaves = usize::from(node.width) - children;
            let (first_node, first_leaf) = (self.allocate_nodes(children), self.allocate_leaves(leaves));
            for lane in 0..children {
                places[node.first_node as usize + lane] = first_node + lane;
                self.tlas.parents[first_node + lane] = Slot::new::<N>(place, lane);
            }
            for leaf in 0..leaves {
                let light = lights[order[node.first_leaf as usize + leaf] as usize];
                self.store.put((first_leaf + leaf) as u32, light);
            }
            *self.node_mut(place) = Node::new(first_node, children, first_leaf, children + leaves);
            self.note_leaves(place);
            self.state.nodes[place] = NodeState::NEW;
        }
        places.iter().rev().for_each(|&place| self.fit(place));
    }

    /// Takes all lights below a node out of their leaves, and frees all places below it.
    fn take_below(&mut self, index: usize, lights: &mut Vec<S::Leaf>) {
        let node = *self.node(index);
        for lane in 0..N {
            match node.child(lane) {
                Child::Empty => break,
                Child::Node(child) => {
                    self.take_below(child as usize, lights);
                    self.tlas.parents[child as usize] = Slot::FREE;
                }
                Child::Leaf(leaf) => {
                    lights.push(self.store.take(leaf));
                    self.tlas.leaves[leaf as usize] = Slot::FREE;
                }
            }
        }
        let [first_node, nodes, first_leaf, leaves] = self.children(index);
        self.state.free_nodes.add(first_node, nodes);
        self.state.free_leaves.add(first_leaf, leaves);
    }
}
