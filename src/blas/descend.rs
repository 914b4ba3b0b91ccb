//! From a triangle to a cell of its barycentric domain. One loop serves both verbs: a [`Guide`] either draws the
//! way or follows a given point, and everything that decides on probabilities is the same.

use super::barycentric::{self, ARITY, Lattice};
use super::cell::{self, Cell};
use super::node::{self, Block, LEAF, Root};
use crate::warp::{Variate, keep_possible, pick, sum};

/// What the level above knows of a cell beyond the average of the texture over it.
pub(crate) trait Shape {
    /// How much a cell with a weight texture of one would send to the shading point.
    fn worth(&self, cell: &Cell) -> Worth;

    /// The same of all parts of a cell whose average is not zero. `even` is what was said of the cell itself.
    fn worths(&self, cell: &Cell, texture: &Parts<'_>, _even: bool) -> Worths {
        let mut worths = Worths { weights: [0.0; ARITY], uniform: [true; ARITY], even: [true; ARITY] };
        for i in (0..ARITY).filter(|&i| texture.averages[i] > 0.0) {
            let worth = self.worth(&cell.child(i));
            (worths.weights[i], worths.uniform[i], worths.even[i]) = (worth.weight, worth.uniform, worth.even);
        }
        worths
    }
}

/// The texture on the parts of a cell.
pub(crate) struct Parts<'a> {
    blocks: &'a [Block],
    node: u32,
    /// Relative average weights.
    pub(crate) averages: [f32; ARITY],
}

impl Parts<'_> {
    /// Where the weight of each part has its centre, by corner of the part, as far as the next level shows.
    #[inline]
    pub(crate) fn centers(&self) -> [[f32; ARITY]; 3] {
        let mut centers = [[1.0 / 3.0; ARITY]; 3];
        if self.node == LEAF {
            return centers;
        }
        for (i, average) in self.averages.iter().enumerate() {
            let below = node::below(self.blocks, self.node, i);
            if below == LEAF || *average == 0.0 {
                continue;
            }
            let averages = node::averages(self.blocks, below);
            let total: f32 = averages.iter().sum();
            for (k, weights) in cell::center_weights().iter().enumerate() {
                let sum: f32 = weights.iter().zip(&averages).map(|(w, a)| w * a).sum();
                centers[k][i] = sum / total;
            }
        }
        centers
    }
}

/// What [`Shape`] says of one cell.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Worth {
    /// Relative to the other cells of the same parent; zero only if nothing can arrive from the cell.
    pub(crate) weight: f32,
    /// Whether the descent can end here as far as everything but the texture is concerned.
    pub(crate) uniform: bool,
    /// Whether what is seen behind the cell is the same all over it.
    pub(crate) even: bool,
}

/// What [`Shape`] says of the parts of a cell.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Worths {
    /// See [`Worth::weight`].
    pub(crate) weights: [f32; ARITY],
    /// See [`Worth::uniform`].
    pub(crate) uniform: [bool; ARITY],
    /// See [`Worth::even`].
    pub(crate) even: [bool; ARITY],
}

/// What leads a descent from a cell to one of its children.
pub(crate) trait Guide {
    /// Chooses one of the children, of which at least one has a positive weight.
    fn choose(&mut self, weights: &[f32; ARITY]) -> usize;
}

/// Draws the way in proportion to the weights.
///
/// One variate chooses a group of [`barycentric::EDGE_CELLS`] successive children, the other a child of the group. Each cell stands for an
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
    fn choose(&mut self, weights: &[f32; ARITY]) -> usize {
        let r = barycentric::EDGE_CELLS as usize;
        let mut groups = [0.0; barycentric::EDGE_CELLS as usize];
        for (group, members) in groups.iter_mut().zip(weights.chunks_exact(r)) {
            *group = members.iter().sum();
        }
        let group = pick(&groups, sum(&groups), &mut self.u[1]);
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
    fn choose(&mut self, _weights: &[f32; ARITY]) -> usize {
        let (index, local) = barycentric::child(self.local, self.size);
        self.local = local;
        self.size >>= barycentric::LEVEL_HALVINGS;
        index
    }
}

/// Descends from the whole triangle to a cell over which the density is constant. Returns it with its probability;
/// `None` where nothing can arrive from the cell that the guide leads to.
pub(crate) fn descend(
    blocks: &[Block],
    root: Root,
    vertices: [glam::Vec3; 3],
    shape: &impl Shape,
    guide: &mut impl Guide,
) -> Option<(Cell, f64)> {
    descend_below(blocks, root.node, Cell::root(vertices), shape, guide)
}

/// [`descend`] from a cell and the node below it.
#[inline]
pub(crate) fn descend_below(
    blocks: &[Block],
    mut node: u32,
    mut cell: Cell,
    shape: &impl Shape,
    guide: &mut impl Guide,
) -> Option<(Cell, f64)> {
    let (mut uniform, mut even) = (false, false);
    if node == LEAF {
        let worth = shape.worth(&cell);
        if worth.weight == 0.0 {
            return None;
        }
        (uniform, even) = (worth.uniform, worth.even);
    }
    let mut pmf = 1.0;
    let smallest = barycentric::LATTICE >> (barycentric::MAX_DEPTH - barycentric::LEVEL_HALVINGS);
    while cell.domain.size >= smallest && (node != LEAF || !uniform) {
        let parts =
            Parts { blocks, node, averages: if node == LEAF { [1.0; ARITY] } else { node::averages(blocks, node) } };
        let averages = &parts.averages;
        let worths = shape.worths(&cell, &parts, even);
        let mut weights: [f32; ARITY] = core::array::from_fn(|i| averages[i] * worths.weights[i]);
        keep_possible(&mut weights, |i| averages[i] > 0.0 && worths.weights[i] > 0.0);
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
            node = node::below(blocks, node, index);
        }
        cell = cell.child(index);
        (uniform, even) = (worths.uniform[index], worths.even[index]);
    }
    Some((cell, pmf))
}

#[cfg(test)]
mod tests;
