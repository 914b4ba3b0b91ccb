//! What cells are chosen by: the texture over them, and what the level above knows of them.

use super::cell::CENTER_WEIGHTS;
use crate::blas::barycentric::{ARITY, LatticeCell};
use crate::blas::node::{self, CellBlock, LEAF};

/// What the level above knows of a cell beyond the average of the texture over it.
pub(crate) trait CellTarget {
    /// What the target keeps of a cell besides its place on the lattice: its corners in space, for example.
    type Cell: Copy;

    /// The whole triangle.
    fn whole(&self) -> Self::Cell;

    /// One of the children of a cell. If that was weighed, `cell` is as weighing has left it.
    fn child(&self, cell: &Self::Cell, index: usize) -> Self::Cell;

    /// Weighs one cell with a texture of one. It may note in the cell what it has found out.
    fn weigh(&self, at: LatticeCell, cell: &mut Self::Cell) -> CellWeight;

    /// Weighs the children of a cell whose average is not zero. It may note in the cell what it has found out.
    #[inline]
    fn weigh_children(&self, at: LatticeCell, cell: &mut Self::Cell, texture: &TextureChildren<'_>) -> CellWeights {
        let mut weights = CellWeights { weights: [0.0; ARITY], is_final: [true; ARITY] };
        for i in (0..ARITY).filter(|&i| texture.averages[i] > 0.0) {
            let found = self.weigh(at.child(i), &mut self.child(cell, i));
            (weights.weights[i], weights.is_final[i]) = (found.weight, found.is_final);
        }
        weights
    }
}

/// Weight of one cell.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CellWeight {
    /// Relative to the other cells of the same parent; zero only if nothing can arrive from the cell.
    pub(crate) weight: f32,
    /// Whether the descent can end here as far as everything but the texture is concerned.
    pub(crate) is_final: bool,
}

/// Weights of the children of a cell.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CellWeights {
    /// See [`CellWeight::weight`].
    pub(crate) weights: [f32; ARITY],
    /// See [`CellWeight::is_final`].
    pub(crate) is_final: [bool; ARITY],
}

/// The texture over the children of a cell.
pub(crate) struct TextureChildren<'a> {
    blocks: &'a [CellBlock],
    node: u32,
    /// Relative average weights.
    pub(crate) averages: [f32; ARITY],
}

impl<'a> TextureChildren<'a> {
    /// The children of a node. Below a [`LEAF`] all averages are one.
    #[inline(always)]
    pub(super) fn new(blocks: &'a [CellBlock], node: u32) -> Self {
        let averages = if node == LEAF { [1.0; ARITY] } else { node::averages(blocks, node) };
        Self { blocks, node, averages }
    }

    /// Where the weight of each child has its center, by corner of the child, as far as the next level shows.
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
            for (k, weights) in CENTER_WEIGHTS.iter().enumerate() {
                let sum: f32 = weights.iter().zip(&averages).map(|(w, a)| w * a).sum();
                centers[k][i] = sum / total;
            }
        }
        centers
    }
}
