//! Where a leaf goes, and what happens to the nodes around it.

use super::{DEEP, LeafStore, NodeState, WideEdit, most_edits};
use crate::bounds::{LightBounds, orientation_measure};
use crate::geometry::{Aabb, angle};
use crate::math;
use crate::tlas::build::Fitted;
use crate::tlas::node::{Child, Node, Slot, words};

/// Padding of boxes, relative to the longest edge of the box around all lights. *Chosen*: that of a build
/// (`PAD` in `src/tlas/build/bins.rs`).
///
/// Larger: thin shapes do not count. Smaller: of clusters in one line, none grows.
const PAD: f32 = 1e-3;

/// Rounding granted to the angle between a normal and the axis of a cone, in radians. *Chosen*: a light that is taken
/// for one outside only looks for a place again.
const ANGLE_ROUNDING: f32 = 1e-3;

/// What a new leaf would add to the cost of a cluster.
struct Growth<'b> {
    new: &'b LightBounds,
    /// What every edge is extended by.
    pad: f32,
}

impl Growth<'_> {
    /// Returns the cost of the cluster with the new light, less `own` of its cost without; of a growth that is not
    /// below `least`, any number that is not.
    fn of(&self, cluster: &LightBounds, own: f64, least: f64) -> f64 {
        let measure = |theta: f32, two_sided: bool| f64::from(orientation_measure(math::sin_cos(theta).1, two_sided));
        let area = |aabb: &Aabb| {
            let e = aabb.extent() + self.pad;
            f64::from(2.0 * (e.x * e.y + e.y * e.z + e.z * e.x))
        };
        let before = measure(cluster.normals.theta, cluster.two_sided);
        let energy = f64::from(cluster.energy());
        let all = energy + f64::from(self.new.energy());
        let union = area(&cluster.aabb.union(self.new.aabb));
        let without = own * area(&cluster.aabb) * before * energy;
        let growth = union * before * all - without;
        // The cone of normals only grows.
        if growth >= least {
            return growth;
        }
        let both = cluster.union(*self.new);
        union * measure(both.normals.theta, both.two_sided) * all - without
    }
}

impl<const N: usize, S: LeafStore> WideEdit<'_, N, S> {
    /// Puts a light into a new leaf, as near to the root as there is room where it fits best.
    pub(super) fn insert(&mut self, light: S::Leaf) {
        let fitted = Fitted::leaf(self.store.bounds(&light));
        let all = self.state.nodes[0].fitted.bounds.union(fitted.bounds).aabb;
        let growth = Growth { new: &fitted.bounds, pad: PAD * all.extent().max_element() };
        let (mut index, mut depth) = (0, 0);
        loop {
            let state = &mut self.state.nodes[index];
            // As later lights of the batch should see it.
            *state = NodeState {
                fitted: state.fitted.joined(&fitted),
                edits: state.edits.saturating_add(1),
                is_changed: true,
            };
            if usize::from(self.node(index).width) < N {
                self.add_leaf(index, light);
                return;
            }
            match self.best_child(index, &growth) {
                Child::Node(child) => (index, depth) = (child as usize, depth + 1),
                Child::Leaf(leaf) => {
                    self.pair(index, leaf as usize, light);
                    break;
                }
                Child::Empty => return,
            }
        }
        if depth >= DEEP {
            self.rebuild_above(index);
        }
    }

    /// Puts a light into a leaf that no node knows of.
    pub(super) fn add_loose(&mut self, light: S::Leaf) {
        let leaf = self.allocate_leaves(1);
        self.store.put(leaf as u32, light);
        self.tlas.leaves[leaf] = Slot::ROOT;
    }

    /// Builds the largest subtree again that holds a node and has changed too much, if there is one.
    fn rebuild_above(&mut self, index: usize) {
        let above = core::iter::successors(Some(index), |&index| Some(self.tlas.parents[index].get::<N>()?.0));
        let is_worn = |&index: &usize| {
            let state = &self.state.nodes[index];
            state.edits > most_edits(state.fitted.leaf_count())
        };
        if let Some(worn) = above.filter(is_worn).last() {
            self.rebuild_below(worn);
        }
    }

    /// Returns the child of a full node that grows least.
    fn best_child(&self, index: usize, growth: &Growth<'_>) -> Child {
        let (mut best, mut least) = (Child::Empty, f64::INFINITY);
        let node = self.node(index);
        for child in (0..N).map(|lane| node.child(lane)) {
            let added = match child {
                Child::Node(child) => growth.of(&self.state.nodes[child as usize].fitted.bounds, 1.0, least),
                // A leaf becomes a cluster, and stays a lane as well.
                Child::Leaf(leaf) => growth.of(&self.store.bounds(&self.store.get(leaf)).0, 0.0, least),
                Child::Empty => continue,
            };
            // NaN is never the least, but better than nothing.
            if added < least || best == Child::Empty {
                (best, least) = (child, added);
            }
        }
        best
    }

    /// Adds a leaf to a node that has room for it. Its leaves move.
    pub(super) fn add_leaf(&mut self, index: usize, light: S::Leaf) {
        let [_, nodes, first, leaves] = self.children(index);
        let to = self.allocate_leaves(leaves + 1);
        (0..leaves).for_each(|i| self.move_leaf(first + i, to + i));
        self.state.free_leaves.add(first, leaves);
        self.store.put((to + leaves) as u32, light);
        self.tlas.leaves[to + leaves] = Slot::new::<N>(index, nodes + leaves);
        let node = self.node_mut(index);
        node.first_leaf = to as u32;
        node.width += 1;
    }

    /// Gives a leaf of a node and a new light a node of their own. The nodes below the node move.
    fn pair(&mut self, index: usize, leaf: usize, light: S::Leaf) {
        let old = self.take_leaf(index, leaf);
        let child = self.add_node(index);
        for light in [old, light] {
            self.state.nodes[child].fitted =
                self.state.nodes[child].fitted.joined(&Fitted::leaf(self.store.bounds(&light)));
            self.add_leaf(child, light);
        }
    }

    /// Takes a leaf out of a node, whose last leaf takes its place.
    fn take_leaf(&mut self, index: usize, leaf: usize) -> S::Leaf {
        let [_, _, first, leaves] = self.children(index);
        let (slot, last) = (self.tlas.leaves[leaf], first + leaves - 1);
        let light = self.store.take(leaf as u32);
        if leaf != last {
            self.move_leaf(last, leaf);
            self.tlas.leaves[leaf] = slot;
        }
        self.tlas.leaves[last] = Slot::FREE;
        self.state.free_leaves.add(last, 1);
        self.node_mut(index).width -= 1;
        light
    }

    /// Adds a node without children below a node that has room for it. The nodes next to it move. Returns its number.
    fn add_node(&mut self, index: usize) -> usize {
        let [first, nodes, ..] = self.children(index);
        let to = self.allocate_nodes(nodes + 1);
        (0..nodes).for_each(|i| self.move_node(first + i, to + i));
        self.state.free_nodes.add(first, nodes);
        let child = to + nodes;
        self.tlas.parents[child] = Slot::new::<N>(index, nodes);
        *self.node_mut(child) = Node::new(0, 0, 0, 0);
        self.state.nodes[child] = NodeState::NEW;
        let node = self.node_mut(index);
        node.first_node = to as u32;
        node.node_count += 1;
        node.width += 1;
        self.note_leaves(index);
        child
    }

    /// Removes a leaf. Returns the light that was in it.
    pub(super) fn remove(&mut self, leaf: u32) -> S::Leaf {
        let Some((index, _)) = self.tlas.leaves[leaf as usize].get::<N>() else {
            self.tlas.leaves[leaf as usize] = Slot::FREE;
            self.state.free_leaves.add(leaf as usize, 1);
            return self.store.take(leaf);
        };
        self.mark(index, 1);
        let light = self.take_leaf(index, leaf as usize);
        self.tidy(index);
        light
    }

    /// Removes a node without children, passes the leaves of one that its parent has room for on to the parent, and
    /// lets the only child of a node take its place.
    fn tidy(&mut self, mut index: usize) {
        while let Some((parent, lane)) = self.tlas.parents[index].get::<N>() {
            let [first_node, nodes, first, leaves] = self.children(index);
            let room = N - usize::from(self.node(parent).width);
            if nodes == 0 && leaves <= room + 1 {
                // Its lane is free before its leaves take others.
                let lights: smallvec::SmallVec<[S::Leaf; 16]> =
                    (first..first + leaves).map(|leaf| self.store.take(leaf as u32)).collect();
                (first..first + leaves).for_each(|leaf| self.tlas.leaves[leaf] = Slot::FREE);
                self.state.free_leaves.add(first, leaves);
                self.take_node(parent, lane);
                lights.into_iter().for_each(|light| self.add_leaf(parent, light));
                index = parent;
            } else if nodes == 1 && leaves == 0 {
                let slot = self.tlas.parents[index];
                self.move_node(first_node, index);
                self.tlas.parents[index] = slot;
                self.tlas.parents[first_node] = Slot::FREE;
                self.state.free_nodes.add(first_node, 1);
                return;
            } else {
                return;
            }
        }
    }

    /// Takes a child without children out of a node, whose last child node takes its place.
    fn take_node(&mut self, index: usize, lane: usize) {
        let [first, nodes, ..] = self.children(index);
        let (child, last) = (first + lane, first + nodes - 1);
        if child != last {
            self.move_node(last, child);
            self.tlas.parents[child] = Slot::new::<N>(index, lane);
        }
        self.tlas.parents[last] = Slot::FREE;
        self.state.free_nodes.add(last, 1);
        let node = self.node_mut(index);
        node.node_count -= 1;
        node.width -= 1;
        self.note_leaves(index);
    }

    /// Notes that the light in a leaf has changed.
    pub(super) fn update(&mut self, leaf: u32) {
        let Some((index, _)) = self.tlas.leaves[leaf as usize].get::<N>() else { return };
        let light = self.store.get(leaf);
        let bounds = self.store.bounds(&light).0;
        let stays = index == 0 || holds(&self.state.nodes[index].fitted.bounds, &bounds);
        if stays {
            self.mark(index, 0);
        } else {
            let light = self.remove(leaf);
            self.insert(light);
        }
    }

    /// Moves a leaf to a free place, under the same parent.
    fn move_leaf(&mut self, from: usize, to: usize) {
        let light = self.store.take(from as u32);
        self.store.put(to as u32, light);
        self.tlas.leaves[to] = self.tlas.leaves[from];
        self.tlas.leaves[from] = Slot::FREE;
    }

    /// Moves a node to a free place, under the same parent, with what is kept of it.
    fn move_node(&mut self, from: usize, to: usize) {
        self.tlas.nodes.copy_within(from * words::<N>()..(from + 1) * words::<N>(), to * words::<N>());
        self.tlas.spreads[to] = self.tlas.spreads[from];
        self.tlas.parents[to] = self.tlas.parents[from];
        self.tlas.parents[from] = Slot::FREE;
        if !self.tlas.groups.is_empty() {
            self.tlas.groups.copy_within(from * N..(from + 1) * N, to * N);
        }
        self.state.nodes[to] = self.state.nodes[from];
        let [first, nodes, ..] = self.children(to);
        (0..nodes).for_each(|lane| self.tlas.parents[first + lane] = Slot::new::<N>(to, lane));
        self.note_leaves(to);
    }

    /// Tells the leaves of a node which lanes refer to them.
    pub(super) fn note_leaves(&mut self, index: usize) {
        let [_, nodes, first, leaves] = self.children(index);
        (0..leaves).for_each(|i| self.tlas.leaves[first + i] = Slot::new::<N>(index, nodes + i));
    }
}

/// Whether the bounds of a cluster hold those of a light, but for rounding.
fn holds(cluster: &LightBounds, light: &LightBounds) -> bool {
    let (outer, inner) = (&cluster.aabb, &light.aabb);
    let between = angle(cluster.normals.axis, light.normals.axis);
    outer.min.cmple(inner.min).all()
        && inner.max.cmple(outer.max).all()
        && between + light.normals.theta <= cluster.normals.theta + ANGLE_ROUNDING
}
