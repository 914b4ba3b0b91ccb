//! Checks trees that came from outside.

use alloc::vec;

use crate::blas::barycentric::{LEVEL_HALVINGS, MAX_HALVINGS};
use crate::blas::node::{CellNode, LEAF, MAX_AVERAGE, Root, averages, below};
use crate::error::Error;

fn is_lit(nodes: &[CellNode], node: u32) -> bool {
    averages(nodes, node).iter().any(|average| *average > 0.0)
}

/// Checks a pool: afterwards every descent from any node ends, stays in bounds, and finds a positive cell below every
/// positive cell.
pub(crate) fn validate(nodes: &[CellNode]) -> Result<(), Error> {
    let count = nodes.len();
    if count >= LEAF as usize {
        return Err(Error::bytes("number of nodes", 0, count, LEAF - 1));
    }
    let max_levels = MAX_HALVINGS / LEVEL_HALVINGS;
    // A node's level: how many nodes are above it on the longest way. Ways lead up in the pool only.
    let mut levels = vec![1u8; count];
    for node in 0..count as u32 {
        let averages = averages(nodes, node);
        for (cell, average) in averages.into_iter().enumerate() {
            let child = below(nodes, node, cell);
            if child == LEAF {
                // The number is not in use, or its bit is not set; either way a descent ends.
                if is_divided(nodes, node, cell) {
                    return Err(Error::bytes("number of a node", node as usize, child, count));
                }
                continue;
            }
            if child <= node || child as usize >= count {
                return Err(Error::bytes("number of a node", node as usize, child, count));
            }
            let level = levels[node as usize] + 1;
            if u32::from(level) > max_levels {
                return Err(Error::bytes("depth of a node", node as usize, level, max_levels));
            }
            if is_lit(nodes, child) != (average > 0.0) {
                return Err(Error::bytes("weight of a cell", node as usize, average.to_bits(), child));
            }
            let deepest = &mut levels[child as usize];
            *deepest = level.max(*deepest);
        }
    }
    Ok(())
}

fn is_divided(nodes: &[CellNode], node: u32, cell: usize) -> bool {
    nodes[node as usize].divided() >> cell & 1 == 1
}

/// Checks the roots into a pool that [`validate`] has passed.
pub(crate) fn validate_roots(roots: &[Root], nodes: &[CellNode]) -> Result<(), Error> {
    let count = nodes.len();
    for (i, root) in roots.iter().enumerate() {
        // NaN fails.
        if !(0.0..=MAX_AVERAGE).contains(&root.average) {
            return Err(Error::bytes("weight of a triangle", i, root.average.to_bits(), MAX_AVERAGE.to_bits()));
        }
        if root.node == LEAF {
            continue;
        }
        if root.node as usize >= count {
            return Err(Error::bytes("number of a node", i, root.node, count));
        }
        if is_lit(nodes, root.node) != (root.average > 0.0) {
            return Err(Error::bytes("weight of a triangle", i, root.average.to_bits(), root.node));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blas::barycentric::ARITY;
    use crate::blas::node::append;
    use alloc::vec::Vec;

    /// Each node but the last has one below its cell 2.
    fn chain(n: usize) -> Vec<CellNode> {
        let averages: Vec<f32> = (0..ARITY * n).map(|i| if i % ARITY == 2 { 1.0 } else { 0.0 }).collect();
        let divided: Vec<bool> = (0..ARITY * n).map(|i| i % ARITY == 2 && i + ARITY < ARITY * n).collect();
        let mut nodes = Vec::new();
        append(&mut nodes, &averages, &divided);
        nodes
    }

    /// Returns a [`chain`] with one byte of the first node changed.
    fn changed(n: usize, at: usize, value: u8) -> Vec<CellNode> {
        let mut nodes = chain(n);
        bytemuck::cast_slice_mut(&mut nodes)[at] = value;
        nodes
    }

    #[test]
    fn bytes_from_outside() {
        assert!(validate(&[]).is_ok());
        assert!(validate(&chain(6)).is_ok());
        assert!(validate(&chain(7)).is_err());
        assert!(validate(&changed(3, 12 + 3, 9)).is_ok());
        // A node below a black cell, a black cell above a lit node, a node above itself, and one beyond the pool.
        assert!(validate(&changed(3, 0, 0b0000_0101)).is_err());
        assert!(validate(&changed(3, 4, 1)).is_err());
        assert!(validate(&changed(3, 12 + 2, 0)).is_err());
        assert!(validate(&changed(3, 8, 0)).is_err());
        assert!(validate(&changed(3, 8, 3)).is_err());
        assert!(validate(&changed(3, 11, 0xff)).is_err());
        for number in [[0xff; 4], [0xfe, 0xff, 0xff, 0xff]] {
            let mut nodes = chain(3);
            bytemuck::cast_slice_mut::<_, u8>(&mut nodes)[8..12].copy_from_slice(&number);
            assert!(validate(&nodes).is_err(), "{number:?}");
        }
    }

    #[test]
    fn roots_from_outside() {
        let nodes = chain(2);
        for bad in [f32::NAN, f32::INFINITY, -1.0, 1e31] {
            assert!(validate_roots(&[Root::constant(bad)], &nodes).is_err());
        }
        assert!(validate_roots(&[Root { average: 0.25, node: 1 }, Root::constant(0.0)], &nodes).is_ok());
        assert!(validate_roots(&[Root { average: 0.25, node: 2 }], &nodes).is_err());
        assert!(validate_roots(&[Root { average: 0.0, node: 0 }], &nodes).is_err());
    }
}
