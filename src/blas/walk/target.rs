//! What cells are chosen by besides the texture over them.

use crate::blas::barycentric::{ARITY, LatticeCell};

/// What the level above knows of a cell beyond the average of the texture over it.
///
/// Everything in an implementation that is to be compiled for wider vectors must be `#[inline(always)]`.
pub(crate) trait CellTarget {
    /// What the target keeps of a cell besides its place on the lattice: its corners in space, for example.
    type Cell: Copy;

    /// The whole triangle.
    fn whole(&self) -> Self::Cell;

    /// One of the children of a cell.
    fn child(&self, cell: &Self::Cell, index: usize) -> Self::Cell;

    /// Weighs the children of a cell, relative to each other, as if their texture were one: writes the weights. One is
    /// zero only if nothing can arrive from the child; it may be infinite. Where an average is zero, any weight will
    /// do.
    ///
    /// Arrays are written rather than returned because what is returned may be copied.
    fn weigh_children(&self, at: LatticeCell, cell: &Self::Cell, averages: &[f32; ARITY], weights: &mut [f32; ARITY]);

    /// Whether the descent can end at a cell as far as everything but the texture is concerned. It may note in the cell
    /// what it has found out. `levels` counts those that were taken since the texture is constant; without, the texture
    /// varies, and the answer does not matter.
    fn is_final(&self, at: LatticeCell, cell: &mut Self::Cell, levels: Option<u32>) -> bool;
}
