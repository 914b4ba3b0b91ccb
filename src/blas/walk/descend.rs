//! The loop of a descent. It serves sampling and density alike: a [`Guide`] either draws the way or follows a given
//! point, and everything that decides on probabilities is shared.

use super::guide::Guide;
use super::target::{CellTarget, TextureChildren};
use crate::blas::barycentric::{LATTICE, LEVEL_HALVINGS, LatticeCell, MAX_HALVINGS};
use crate::blas::node::{self, CellBlock, LEAF, Root};
use crate::warp::{keep_possible, sum};

/// The smallest cell that can be divided, in lattice units.
const SMALLEST_DIVISIBLE: u32 = LATTICE >> (MAX_HALVINGS - LEVEL_HALVINGS);

/// Descends from the whole triangle to a cell over which the density is constant. Returns it with its probability;
/// `None` where nothing can arrive from the cell that the guide leads to.
pub(crate) fn descend(
    blocks: &[CellBlock],
    root: Root,
    target: &impl CellTarget,
    guide: &mut impl Guide,
) -> Option<(LatticeCell, f64)> {
    descend_below(blocks, root.node, LatticeCell::whole(), target.whole(), target, guide)
}

/// [`descend`] from a cell and the node below it.
#[inline]
pub(crate) fn descend_below<T: CellTarget>(
    blocks: &[CellBlock],
    mut node: u32,
    mut at: LatticeCell,
    mut cell: T::Cell,
    target: &T,
    guide: &mut impl Guide,
) -> Option<(LatticeCell, f64)> {
    let mut is_final = false;
    if node == LEAF {
        let found = target.weigh(at, &mut cell);
        if found.weight == 0.0 {
            return None;
        }
        is_final = found.is_final;
    }
    let mut pmf = 1.0;
    while at.size >= SMALLEST_DIVISIBLE && (node != LEAF || !is_final) {
        let texture = TextureChildren::new(blocks, node);
        let averages = &texture.averages;
        let found = target.weigh_children(at, &mut cell, &texture);
        let mut weights = core::array::from_fn(|i| averages[i] * found.weights[i]);
        keep_possible(&mut weights, |i| averages[i] > 0.0 && found.weights[i] > 0.0);
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
        (at, cell) = (at.child(index), target.child(&cell, index));
        is_final = found.is_final[index];
    }
    Some((at, pmf))
}

#[cfg(test)]
mod tests;
