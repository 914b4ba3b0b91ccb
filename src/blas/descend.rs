//! From a triangle to a cell of its barycentric domain. One loop serves both verbs: a [`Guide`] either draws the
//! way or follows a given point, and everything that decides on probabilities is the same.

use super::barycentric::{self, Lattice};
use super::cell::Cell;
use super::node::{LEAF, Node, Root};
use crate::warp::{Variate, keep_possible, pick, sum};

/// What the level above knows of a cell beyond the average of the texture over it.
pub(crate) trait Shape {
    /// How much a cell with a weight texture of one would send to the shading point.
    fn worth(&self, cell: &Cell) -> Worth;
}

/// What [`Shape`] says of one cell.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Worth {
    /// Relative to the other cells of the same parent; zero only if nothing can arrive from the cell.
    pub(crate) weight: f32,
    /// Whether the descent can end here as far as everything but the texture is concerned.
    pub(crate) uniform: bool,
}

/// What leads a descent from a cell to one of its children.
pub(crate) trait Guide {
    /// Chooses one of the children, of which at least one has a positive weight.
    fn choose<const M: usize>(&mut self, weights: &[f32; M]) -> usize;
}

/// Draws the way in proportion to the weights.
///
/// One variate chooses a group of `√M` successive children, the other a child of the group. Each cell stands for an
/// upright rectangle of the unit square; where all weights are equal, for a square of a binary grid, so that the
/// points of a net fall one to a cell.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Draw {
    u: [Variate; 2],
}

impl Draw {
    pub(crate) fn new(u: [Variate; 2]) -> Self {
        Self { u }
    }

    /// What is left of the variates.
    pub(crate) fn rest(&self) -> [Variate; 2] {
        self.u
    }

    /// A point strictly inside of the chosen cell, drawn with what is left of the variates.
    pub(crate) fn point(&self, cell: barycentric::Cell) -> Lattice {
        cell.global(barycentric::interior_point(cell.size, self.u.map(|u| u.value())))
    }
}

impl Guide for Draw {
    #[inline]
    fn choose<const M: usize>(&mut self, weights: &[f32; M]) -> usize {
        let r = barycentric::edge_cells::<M>() as usize;
        // No arity has more than eight groups.
        let mut groups = [0.0; 8];
        for (group, members) in groups.iter_mut().zip(weights.chunks_exact(r)) {
            *group = members.iter().sum();
        }
        let group = pick(&groups[..r], sum(&groups[..r]), &mut self.u[1]);
        let members = &weights[group * r..][..r];
        group * r + pick(members, sum(members), &mut self.u[0])
    }
}

/// Follows a point that is given.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Follow {
    local: [u32; 3],
    size: u32,
}

impl Follow {
    pub(crate) fn new(point: Lattice) -> Self {
        Self { local: point.0, size: barycentric::LATTICE }
    }

    /// From a cell that holds the point.
    pub(crate) fn below(cell: barycentric::Cell, point: Lattice) -> Self {
        Self { local: cell.local(point).map(|i| i as u32), size: cell.size }
    }
}

impl Guide for Follow {
    #[inline]
    fn choose<const M: usize>(&mut self, _weights: &[f32; M]) -> usize {
        let (index, local) = barycentric::child::<M>(self.local, self.size);
        self.local = local;
        self.size >>= barycentric::level_halvings::<M>();
        index
    }
}

/// Descends from the whole triangle to a cell over which the density is constant. Returns it with its probability;
/// `None` where nothing can arrive from the cell that the guide leads to.
pub(crate) fn descend<const M: usize>(
    nodes: &[Node<M>],
    root: Root,
    vertices: [glam::Vec3; 3],
    shape: &impl Shape,
    guide: &mut impl Guide,
) -> Option<(Cell, f64)> {
    descend_below(nodes, root.node, Cell::root(vertices), shape, guide)
}

/// [`descend`] from a cell and the node below it.
#[inline]
pub(crate) fn descend_below<const M: usize>(
    nodes: &[Node<M>],
    mut node: u32,
    mut cell: Cell,
    shape: &impl Shape,
    guide: &mut impl Guide,
) -> Option<(Cell, f64)> {
    let mut uniform = false;
    if node == LEAF {
        let worth = shape.worth(&cell);
        if worth.weight == 0.0 {
            return None;
        }
        uniform = worth.uniform;
    }
    let mut pmf = 1.0;
    let smallest = barycentric::LATTICE >> (barycentric::MAX_DEPTH - barycentric::level_halvings::<M>());
    while cell.domain.size >= smallest && (node != LEAF || !uniform) {
        let averages = if node == LEAF { [1.0; M] } else { nodes[node as usize].averages() };
        let children: [Cell; M] = core::array::from_fn(|i| cell.child::<M>(i));
        let worths: [Worth; M] = core::array::from_fn(|i| match averages[i] {
            0.0 => Worth { weight: 0.0, uniform: true },
            _ => shape.worth(&children[i]),
        });
        let mut weights: [f32; M] = core::array::from_fn(|i| averages[i] * worths[i].weight);
        keep_possible(&mut weights, |i| averages[i] > 0.0 && worths[i].weight > 0.0);
        let total = sum(&weights);
        if total == 0.0 {
            return None;
        }
        let index = guide.choose(&weights);
        if weights[index] == 0.0 {
            return None;
        }
        pmf *= f64::from(weights[index]) / total;
        if node != LEAF {
            node = nodes[node as usize].below(index);
        }
        cell = children[index];
        uniform = worths[index].uniform;
    }
    Some((cell, pmf))
}

#[cfg(test)]
mod tests;
