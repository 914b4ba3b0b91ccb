//! What leads a descent from a cell to one of its children: random numbers, or a point that is given.

use crate::blas::barycentric::{self, ARITY, EDGE_CELLS, LATTICE, LEVEL_HALVINGS, Lattice, LatticeCell};
use crate::warp::{Variate, pick, sum};

/// What leads a descent from a cell to one of its children.
pub(crate) trait Guide {
    /// Chooses one of the children, of which at least one has a positive weight.
    fn choose(&mut self, weights: &[f32; ARITY]) -> usize;
}

/// Draws the way in proportion to the weights.
///
/// One variate chooses a group of [`EDGE_CELLS`] successive children, the other a child of the group. Each cell stands
/// for an upright rectangle of the unit square; where all weights are equal, for a square of a binary grid, so that the
/// points of a net fall one to a cell.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Draw {
    u: [Variate; 2],
}

impl Draw {
    pub(crate) fn new(u: [Variate; 2]) -> Self {
        Self { u }
    }

    /// Returns what is left of the variates.
    pub(crate) fn rest(&self) -> [Variate; 2] {
        self.u
    }

    /// Draws a point strictly inside of the chosen cell with what is left of the variates.
    pub(crate) fn point(&self, cell: LatticeCell) -> Lattice {
        cell.global(barycentric::interior_point(cell.size, self.u.map(|u| u.value())))
    }
}

impl Guide for Draw {
    #[inline]
    fn choose(&mut self, weights: &[f32; ARITY]) -> usize {
        const GROUP: usize = EDGE_CELLS as usize;
        let mut groups = [0.0; GROUP];
        for (group, members) in groups.iter_mut().zip(weights.chunks_exact(GROUP)) {
            *group = members.iter().sum();
        }
        let group = pick(&groups, sum(&groups), &mut self.u[1]);
        let members = &weights[group * GROUP..][..GROUP];
        group * GROUP + pick(members, sum(members), &mut self.u[0])
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
        Self { local: point.0, size: LATTICE }
    }

    /// Starts at a cell that holds the point.
    pub(crate) fn below(cell: LatticeCell, point: Lattice) -> Self {
        Self { local: cell.local(point).map(|i| i as u32), size: cell.size }
    }
}

impl Guide for Follow {
    #[inline]
    fn choose(&mut self, _weights: &[f32; ARITY]) -> usize {
        let (index, local) = barycentric::child(self.local, self.size);
        self.local = local;
        self.size >>= LEVEL_HALVINGS;
        index
    }
}
