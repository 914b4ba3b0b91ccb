//! What a BLAS is made of: plain data, in one pool for all triangles of a sampler.
//!
//! A node is [`ARITY`] cells, by the numbers that [`barycentric::child`](crate::blas::barycentric::child) gives them.
//! The nodes of a tree are numbered breadth first, so that the nodes below the cells of a node have successive numbers.
//! One bit for each cell and the first of these numbers are enough to find them (Jacobson 1989, level-order unary
//! degree sequence).

use alloc::vec::Vec;

use bytemuck::{Pod, Zeroable};

use crate::blas::barycentric::ARITY;
use crate::blas::code::{LARGEST_VALUE, decode, encode};

/// *Format*: stands for "no node below": the weight is taken for constant over the cell.
pub(crate) const LEAF: u32 = u32::MAX;

/// The largest average that is stored. *Proved*: larger ones only steer sampling, and a sum of 2^26 of them stays below
/// the largest `f32`.
pub(crate) const MAX_AVERAGE: f32 = 1e30;

/// Narrows to what nodes hold: zero, or a normal `f32` up to [`MAX_AVERAGE`].
pub(crate) fn storable(value: f64) -> f32 {
    if value > 0.0 { (value as f32).clamp(f32::MIN_POSITIVE, MAX_AVERAGE) } else { 0.0 }
}

/// Words of a node before its codes. *Format*.
const NODE_HEADER_WORDS: usize = 3;

/// Words of a node.
const NODE_WORDS: usize = NODE_HEADER_WORDS + ARITY / 4;

/// A node.
///
/// Words 0 and 1 hold a bit for every cell, set if there is a node below the cell, and word 2 holds the number of the
/// first such node. The bytes of the other words are the [codes](crate::blas::code) of the average weights over the
/// cells.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub(crate) struct CellNode([u32; NODE_WORDS]);

const _: () = assert!(size_of::<CellNode>() == 76 && ARITY == u64::BITS as usize);

impl CellNode {
    #[inline(always)]
    fn codes(&self) -> &[u8; ARITY] {
        let bytes: &[u8; 4 * NODE_WORDS] = bytemuck::cast_ref(&self.0);
        bytes.last_chunk().expect("a node is longer than its codes")
    }

    /// Returns the node of a tree that is moved by `places` in the pool.
    pub(crate) fn moved_by(mut self, places: u32) -> Self {
        self.0[2] = self.0[2].wrapping_add(places);
        self
    }

    /// Returns the number after that of the last node below the cells, or zero.
    fn end_below(&self) -> u32 {
        match self.divided().count_ones() {
            0 => 0,
            count => self.0[2].wrapping_add(count),
        }
    }

    /// Which cells have a node below.
    #[inline(always)]
    pub(crate) fn divided(&self) -> u64 {
        u64::from(self.0[1]) << 32 | u64::from(self.0[0])
    }
}

/// Reads the relative average weights over the cells of a node. Positive wherever any lookup in the cell is.
#[inline(always)]
pub(crate) fn read_averages(nodes: &[CellNode], node: u32, averages: &mut [f32; ARITY]) {
    for (average, code) in averages.iter_mut().zip(nodes[node as usize].codes()) {
        *average = decode(*code);
    }
}

/// [`read_averages`] into an array of their own.
pub(crate) fn averages(nodes: &[CellNode], node: u32) -> [f32; ARITY] {
    let mut averages = [0.0; ARITY];
    read_averages(nodes, node, &mut averages);
    averages
}

/// The node below a cell of a node, or [`LEAF`].
#[inline(always)]
pub(crate) fn below(nodes: &[CellNode], node: u32, cell: usize) -> u32 {
    let node = &nodes[node as usize];
    let (divided, bit) = (node.divided(), 1 << cell);
    if divided & bit == 0 { LEAF } else { node.0[2].wrapping_add((divided & (bit - 1)).count_ones()) }
}

/// Mean of a node's relative averages.
#[inline]
pub(crate) fn mean(nodes: &[CellNode], node: u32) -> f32 {
    averages(nodes, node).iter().sum::<f32>() / ARITY as f32
}

/// The BLAS of one triangle.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct Root {
    /// Average weight over the triangle.
    pub(crate) average: f32,
    /// The first node's number in the pool, or [`LEAF`] where one weight holds for the whole triangle.
    pub(crate) node: u32,
}

const _: () = assert!(size_of::<Root>() == 8);

impl Root {
    /// One weight for the whole triangle.
    pub(crate) const fn constant(average: f32) -> Self {
        Self { average, node: LEAF }
    }
}

/// Appends a tree. `averages` are those of all cells, breadth first; `divided` says which have a node below, in the
/// order of the nodes. Returns the number of its first node.
///
/// The caller has made sure with [`end`] that numbers suffice.
pub(crate) fn append(nodes: &mut Vec<CellNode>, averages: &[f32], divided: &[bool]) -> u32 {
    let root = nodes.len() as u32;
    let largest = averages.iter().fold(f32::MIN_POSITIVE, |largest, average| largest.max(*average));
    let mut next = root + 1;
    for (averages, divided) in averages.chunks_exact(ARITY).zip(divided.chunks_exact(ARITY)) {
        let mut node = CellNode([0; NODE_WORDS]);
        node.0[2] = next;
        for (cell, (average, divided)) in averages.iter().zip(divided).enumerate() {
            let code = encode(average / largest * LARGEST_VALUE);
            bytemuck::bytes_of_mut(&mut node.0)[4 * NODE_HEADER_WORDS + cell] = code;
            node.0[cell / 32] |= u32::from(*divided) << (cell % 32);
        }
        next += node.divided().count_ones();
        nodes.push(node);
    }
    root
}

/// The number of nodes in the pool after a tree of `count` was appended.
pub(crate) fn end(nodes: &[CellNode], count: usize) -> usize {
    nodes.len() + count
}

/// Whether the tree of a root, if there is one, starts in this part of a pool.
pub(crate) fn holds(nodes: &[CellNode], root: Root) -> bool {
    root.node == LEAF || (root.node as usize) < nodes.len()
}

/// Returns the places in the pool of the nodes of the tree with this first node. They are neighbors.
pub(crate) fn places(nodes: &[CellNode], first: u32) -> core::ops::Range<usize> {
    let (mut node, mut end) = (first, first + 1);
    while node < end {
        end = end.max(nodes[node as usize].end_below());
        node += 1;
    }
    first as usize..end as usize
}
