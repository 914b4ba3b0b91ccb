//! Checks of a tree that comes from outside, after which no walk can leave it or go round in circles.

use super::arity::Arity;
use super::node::{Child, Node, Slot, wide};
use super::tree::{TlasView, WideTree, for_arity};
use crate::error::Error;

/// Largest coordinate and largest step of a box. *Proved*: with codes of a byte, squares of distances stay below 1e36
/// and so finite. Hosts keep below 1e9; a smaller bound would refuse nothing that is built.
const FARTHEST: f32 = 1e15;

impl TlasView<'_> {
    /// Checks that the words are whole nodes, every reference stays inside and points forward, every parent pointer
    /// leads back, every leaf is referred to once, and every value is finite and in its range.
    pub(crate) fn validate(&self) -> Result<(), Error> {
        for_arity!(self, tree => {
            Error::unless_equal("number of bytes of nodes", size_of_val(self.nodes), size_of_val(tree.nodes))?;
            tree.validate()
        })
    }
}

impl<const N: usize> WideTree<'_, N> {
    fn validate(&self) -> Result<(), Error> {
        Error::unless_equal("number of parents", self.parents.len(), self.nodes.len())?;
        Error::unless_equal("number of spreads", self.spreads.len(), self.nodes.len())?;
        if !self.groups.is_empty() {
            Error::unless_equal("number of light groups of nodes", self.groups.len(), self.nodes.len() * N)?;
        }
        if self.nodes.is_empty() {
            Error::unless_equal("number of leaves without a node", self.leaves.len().min(2), self.leaves.len().min(1))?;
            return match self.leaves {
                [leaf] if *leaf != Slot::ROOT => Err(Error::bytes("parent of the only leaf", 0, 0, 1)),
                _ => Ok(()),
            };
        }
        let mut leaves = 0;
        let mut nodes = 1;
        Error::unless_equal("parent of the root", usize::from(self.parents[0] != Slot::ROOT), 0)?;
        for index in 0..self.nodes.len() {
            if !self.nodes[index].is_sound() {
                return Err(Error::bytes("values of node", index, 0, 0));
            }
            for lane in 0..N {
                self.validate_lane(index, lane)?;
                match self.nodes[index].child(lane) {
                    Child::Leaf(_) => leaves += 1,
                    Child::Node(_) => nodes += 1,
                    Child::Empty => {}
                }
            }
        }
        // Each lane's child points back to that lane, so as many references as children means each exactly once.
        Error::unless_equal("references to leaves", leaves, self.leaves.len())?;
        Error::unless_equal("references to nodes", nodes, self.nodes.len())
    }

    fn validate_lane(&self, index: usize, lane: usize) -> Result<(), Error> {
        let node = &self.nodes[index];
        let here = Slot::new::<N>(index, lane);
        let slot = match node.child(lane) {
            Child::Empty => return Ok(()),
            Child::Leaf(leaf) => self.leaves.get(leaf as usize),
            Child::Node(child) if child as usize <= index => {
                return Err(Error::bytes("child node", index, child as usize, index + 1));
            }
            Child::Node(child) => self.parents.get(child as usize),
        };
        if slot != Some(&here) {
            return Err(Error::bytes("parent of the child in this lane", index, lane, lane));
        }
        let spread = &self.spreads[index];
        let finite =
            [spread.count, spread.mean, spread.variance].iter().all(|value| value.is_finite() && *value >= 0.0);
        if finite { Ok(()) } else { Err(Error::bytes("spread", index, 0, 0)) }
    }
}

impl<const N: usize> Node<N> {
    /// Whether there are no more children than lanes, and no value is one that sampling could stumble over. Codes of
    /// one byte are all good.
    fn is_sound(&self) -> bool {
        let (origin, steps, energies) = (self.origin, self.steps, self.energies);
        let energies = energies.iter().map(|&energy| wide(energy)).enumerate();
        self.node_count <= self.width
            && usize::from(self.width) <= N
            && origin.iter().all(|value| value.abs() <= FARTHEST)
            && steps.iter().all(|&step| (0.0..=FARTHEST).contains(&wide(step)))
            && energies
                .map(|(lane, energy)| (lane < self.width.into(), energy))
                .all(|(is_child, energy)| if is_child { (0.0..f32::INFINITY).contains(&energy) } else { energy == 0.0 })
    }
}
