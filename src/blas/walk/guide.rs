//! What leads a descent from a cell to one of its children: random numbers, or a point that is given.

use crate::blas::barycentric::{self, ARITY, EDGE_CELLS, LATTICE, LEVEL_HALVINGS, Lattice, LatticeCell};
use crate::warp::{Variate, pick_wide};

/// Sum of the weights of each group, which is [`EDGE_CELLS`] cells of successive ranks.
pub(crate) type GroupSums = [f32; EDGE_CELLS as usize];

/// What leads a descent from a cell to one of its children.
pub(crate) trait Guide {
    /// Chooses one of the children, of which at least one has a positive weight. `groups` are the sums of their groups.
    fn choose(&mut self, weights: &[f32; ARITY], groups: &GroupSums) -> usize;
}

/// Draws the way in proportion to the weights.
///
/// One variate chooses a group of [`EDGE_CELLS`] children, the other a child of the group. Each cell stands
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
    #[inline(always)]
    fn choose(&mut self, weights: &[f32; ARITY], groups: &GroupSums) -> usize {
        const GROUPS: usize = EDGE_CELLS as usize;
        let [first, second] = &mut self.u;
        let group = pick_wide(groups, second).map_or(0, |(group, _)| group);
        let members: [f32; GROUPS] = core::array::from_fn(|member| weights[member * GROUPS + group]);
        let member = pick_wide(&members, first).map_or(0, |(member, _)| member);
        member * GROUPS + group
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
    #[inline(always)]
    fn choose(&mut self, _weights: &[f32; ARITY], _groups: &GroupSums) -> usize {
        let (index, local) = barycentric::child(self.local, self.size);
        self.local = local;
        self.size >>= LEVEL_HALVINGS;
        index
    }
}
