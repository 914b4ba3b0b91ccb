//! The loop of a descent. It serves sampling and density alike: a [`Guide`] either draws the way or follows a given
//! point, and everything that decides on probabilities is shared.
//!
//! All of it is inlined, so that a caller can have a whole descent compiled for wider vectors.

use super::guide::{GroupSums, Guide};
use super::target::CellTarget;
use crate::blas::barycentric::{ARITY, EDGE_CELLS, LATTICE, LEVEL_HALVINGS, LatticeCell, MAX_HALVINGS};
use crate::blas::node::{self, CellNode, LEAF, Root};
use crate::math::only_if;
use crate::warp::{keep_positive, sum_wide, within_range};

/// The smallest cell that can be divided, in lattice units.
const SMALLEST_DIVISIBLE: u32 = LATTICE >> (MAX_HALVINGS - LEVEL_HALVINGS);

/// Descends from the whole triangle to a cell over which the density is constant. Returns it with its probability;
/// `None` where nothing can arrive from the cell that the guide leads to.
#[inline(always)]
pub(crate) fn descend(
    nodes: &[CellNode],
    root: Root,
    target: &impl CellTarget,
    guide: &mut impl Guide,
) -> Option<(LatticeCell, f64)> {
    descend_below(nodes, root.node, LatticeCell::whole(), target.whole(), target, guide)
}

/// [`descend`] from a cell and the node below it.
#[inline(always)]
pub(crate) fn descend_below<T: CellTarget>(
    nodes: &[CellNode],
    mut node: u32,
    mut at: LatticeCell,
    mut cell: T::Cell,
    target: &T,
    guide: &mut impl Guide,
) -> Option<(LatticeCell, f64)> {
    let (mut pmf, mut levels) = (1.0, 0);
    while at.size >= SMALLEST_DIVISIBLE {
        let is_constant = node == LEAF;
        if target.is_final(at, &mut cell, is_constant.then_some(levels)) && is_constant {
            break;
        }
        levels += u32::from(is_constant);
        let (mut averages, mut weights) = ([1.0; ARITY], [0.0; ARITY]);
        if !is_constant {
            node::read_averages(nodes, node, &mut averages);
        }
        target.weigh_children(at, &cell, &averages, &mut weights);
        multiply(&mut weights, &averages);
        let groups = group_sums(&weights);
        let total = sum_wide(&groups);
        if total == 0.0 {
            return None;
        }
        let index = guide.choose(&weights, &groups);
        if weights[index] == 0.0 {
            return None;
        }
        pmf *= f64::from(weights[index]) / total;
        if !is_constant {
            node = node::below(nodes, node, index);
        }
        (at, cell) = (at.child(index), target.child(&cell, index));
    }
    Some((at, pmf))
}

/// Multiplies weights by averages. What is possible by both stays so.
#[inline(always)]
fn multiply(weights: &mut [f32; ARITY], averages: &[f32; ARITY]) {
    for (weight, average) in weights.iter_mut().zip(averages) {
        // In range, a weight times the least average is not zero.
        let possible = *weight > 0.0 && *average > 0.0;
        *weight = only_if(possible, within_range(*weight) * average);
    }
    keep_positive(weights);
}

#[inline(always)]
fn group_sums(weights: &[f32; ARITY]) -> GroupSums {
    let mut groups = [0.0; EDGE_CELLS as usize];
    for members in weights.chunks_exact(EDGE_CELLS as usize) {
        for (group, weight) in groups.iter_mut().zip(members) {
            *group += weight;
        }
    }
    groups
}

#[cfg(test)]
mod tests;
