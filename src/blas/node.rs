//! What a BLAS is made of: plain data, in one pool for all triangles of a sampler.

use bytemuck::{Pod, Zeroable};

use crate::blas::barycentric::{MAX_DEPTH, level_halvings};
use crate::blas::coverage::MAX_AVERAGE;
use crate::error::{Error, Kind};
use alloc::vec;

/// Stands for "no node below": the weight is taken for constant over the cell.
pub(crate) const LEAF: u32 = u32::MAX;

/// The `M` cells of a triangle or of a cell of it, in the order of
/// [`barycentric::child`](crate::blas::barycentric::child).
///
/// Row 0 holds the average weights as the bits of an `f32`; row 1 the pool index of the node below each cell, always
/// larger than this node's own, or [`LEAF`].
#[repr(transparent)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub(crate) struct Node<const M: usize>([[u32; M]; 2]);

const _: () = assert!(size_of::<Node<4>>() == 32 && size_of::<Node<16>>() == 128 && size_of::<Node<64>>() == 512);

impl<const M: usize> Node<M> {
    /// A black node without others below.
    pub(crate) const fn black() -> Self {
        Self([[0; M], [LEAF; M]])
    }

    /// Average weight over a cell: 0, or a normal number up to 1e30. Positive wherever any look-up in the cell is.
    #[inline(always)]
    pub(crate) fn average(&self, cell: usize) -> f32 {
        f32::from_bits(self.0[0][cell])
    }

    /// The averages of all cells.
    #[inline(always)]
    pub(crate) fn averages(&self) -> [f32; M] {
        self.0[0].map(f32::from_bits)
    }

    /// The node below a cell, or [`LEAF`].
    #[inline(always)]
    pub(crate) fn below(&self, cell: usize) -> u32 {
        self.0[1][cell]
    }

    /// Mean of the cells, which all cover the same area.
    pub(crate) fn mean(&self) -> f64 {
        self.0[0].iter().map(|&bits| f64::from(f32::from_bits(bits))).sum::<f64>() / M as f64
    }

    pub(crate) fn set_average(&mut self, cell: usize, average: f32) {
        self.0[0][cell] = average.to_bits();
    }

    pub(crate) fn set_below(&mut self, cell: usize, node: u32) {
        self.0[1][cell] = node;
    }
}

/// The BLAS of one triangle.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct Root {
    /// Average weight over the triangle.
    pub(crate) average: f32,
    /// The first node's index in the pool, or [`LEAF`] where one weight holds for the whole triangle.
    pub(crate) node: u32,
}

impl Root {
    /// One weight for the whole triangle.
    pub(crate) const fn constant(average: f32) -> Self {
        Self { average, node: LEAF }
    }
}

fn is_average(value: f32) -> bool {
    // NaN fails, and so does -0.0's neighbour below.
    (0.0..=MAX_AVERAGE).contains(&value)
}

fn broken(what: &'static str, at: usize, found: u64, expected: u64) -> Error {
    Error(Kind::Bytes { what, at, found, expected })
}

/// Checks a pool that came from outside: afterwards every descent from any node ends, stays in bounds, and finds a
/// positive cell below every positive cell.
pub(crate) fn validate<const M: usize>(nodes: &[Node<M>]) -> Result<(), Error> {
    let max_levels = MAX_DEPTH / level_halvings::<M>();
    // A node's level: how many nodes are above it on the longest way. Ways lead up in the pool only.
    let mut levels = vec![1u8; nodes.len()];
    for (i, node) in nodes.iter().enumerate() {
        let at = i * size_of::<Node<M>>();
        for cell in 0..M {
            let (average, below) = (node.average(cell), node.below(cell));
            let here = at + 4 * cell;
            if !is_average(average) {
                return Err(broken("weight of a cell", here, average.to_bits().into(), MAX_AVERAGE.to_bits().into()));
            }
            if below == LEAF {
                continue;
            }
            let there = here + 4 * M;
            let Some(child) = nodes.get(below as usize).filter(|_| below as usize > i) else {
                return Err(broken("index of a node", there, below.into(), nodes.len() as u64));
            };
            let level = levels[i] + 1;
            if u32::from(level) > max_levels {
                return Err(broken("depth of a node", there, level.into(), max_levels.into()));
            }
            if (child.mean() > 0.0) != (average > 0.0) {
                return Err(broken(
                    "weight of a cell",
                    here,
                    average.to_bits().into(),
                    child.average(0).to_bits().into(),
                ));
            }
            levels[below as usize] = levels[below as usize].max(level);
        }
    }
    Ok(())
}

/// Checks the roots into a pool that [`validate`] has passed.
pub(crate) fn validate_roots<const M: usize>(roots: &[Root], nodes: &[Node<M>]) -> Result<(), Error> {
    for (i, root) in roots.iter().enumerate() {
        let at = i * size_of::<Root>();
        if !is_average(root.average) {
            return Err(broken(
                "weight of a triangle",
                at,
                root.average.to_bits().into(),
                MAX_AVERAGE.to_bits().into(),
            ));
        }
        if root.node == LEAF {
            continue;
        }
        let Some(node) = nodes.get(root.node as usize) else {
            return Err(broken("index of a node", at + 4, root.node.into(), nodes.len() as u64));
        };
        if (node.mean() > 0.0) != (root.average > 0.0) {
            return Err(broken(
                "weight of a triangle",
                at,
                root.average.to_bits().into(),
                node.average(0).to_bits().into(),
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec::Vec;

    fn chain(n: usize) -> Vec<Node<4>> {
        (0..n)
            .map(|i| {
                let mut node = Node::black();
                node.set_average(2, 1.0);
                if i + 1 < n {
                    node.set_below(2, i as u32 + 1);
                }
                node
            })
            .collect()
    }

    #[test]
    fn bytes_from_outside() {
        assert!(validate::<4>(&[]).is_ok());
        assert!(validate(&chain(20)).is_ok());
        assert!(validate(&chain(21)).is_err());
        let broken = |change: fn(&mut Node<4>)| {
            let mut nodes = chain(3);
            change(&mut nodes[1]);
            validate(&nodes).is_err()
        };
        assert!(broken(|n| n.set_below(0, 3)));
        assert!(broken(|n| n.set_below(2, 1)));
        assert!(broken(|n| n.set_below(2, 0)));
        assert!(broken(|n| n.set_average(2, 0.0)));
        for bad in [f32::NAN, f32::INFINITY, -1.0, 1e31] {
            let mut nodes = chain(1);
            nodes[0].set_average(1, bad);
            assert!(validate(&nodes).is_err(), "{bad}");
            assert!(validate_roots::<4>(&[Root::constant(bad)], &nodes).is_err());
        }
        let nodes = chain(2);
        assert!(validate_roots(&[Root { average: 0.25, node: 1 }, Root::constant(0.0)], &nodes).is_ok());
        assert!(validate_roots(&[Root { average: 0.25, node: 2 }], &nodes).is_err());
        assert!(validate_roots(&[Root { average: 0.0, node: 0 }], &nodes).is_err());
    }
}
