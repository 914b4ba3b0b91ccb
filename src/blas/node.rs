//! What a BLAS is made of: plain data, in one pool for all triangles of a sampler.
//!
//! A node is [`ARITY`] cells in the order of [`barycentric::child`](crate::blas::barycentric::child); node `i` owns the
//! cells from `i ARITY` on. The nodes of a tree are numbered breadth first, so that the nodes below the cells of a
//! block have successive numbers, and a bit a cell tells them all (Jacobson 1989, level-order unary degree sequence).

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

/// Cells of a block. A tree starts at the first cell of one. *Format*: as many as a word has bits.
pub(crate) const BLOCK_CELLS: usize = 32;

/// Successive cells: eight nodes.
///
/// Word 0 has the bit of every cell that has a node below, word 1 the number of the first such node. The bytes of the
/// others are the [codes](crate::blas::code) of the average weights over the cells.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub(crate) struct CellBlock([u32; 2 + BLOCK_CELLS / 4]);

const _: () = assert!(size_of::<CellBlock>() == 40 && BLOCK_CELLS / ARITY * ARITY == BLOCK_CELLS);

impl CellBlock {
    #[inline(always)]
    fn codes(&self) -> &[u8; BLOCK_CELLS] {
        let bytes: &[u8; 8 + BLOCK_CELLS] = bytemuck::cast_ref(&self.0);
        bytes.last_chunk().expect("a block is longer than its codes")
    }

    /// Which cells have a node below.
    #[inline(always)]
    pub(crate) fn divided(&self) -> u32 {
        self.0[0]
    }
}

/// Relative average weights over the cells of a node. Positive wherever any lookup in the cell is.
#[inline(always)]
pub(crate) fn averages(blocks: &[CellBlock], node: u32) -> [f32; ARITY] {
    let first = node as usize * ARITY;
    let codes = &blocks[first / BLOCK_CELLS].codes()[first % BLOCK_CELLS..][..ARITY];
    core::array::from_fn(|i| decode(codes[i]))
}

/// The node below a cell of a node, or [`LEAF`].
#[inline(always)]
pub(crate) fn below(blocks: &[CellBlock], node: u32, cell: usize) -> u32 {
    let at = node as usize * ARITY + cell;
    let [divided, first, ..] = blocks[at / BLOCK_CELLS].0;
    let bit = 1 << (at % BLOCK_CELLS);
    if divided & bit == 0 { LEAF } else { first.wrapping_add((divided & (bit - 1)).count_ones()) }
}

/// Mean of a node's relative averages.
#[inline]
pub(crate) fn mean(blocks: &[CellBlock], node: u32) -> f32 {
    averages(blocks, node).iter().sum::<f32>() / ARITY as f32
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
pub(crate) fn append(blocks: &mut Vec<CellBlock>, averages: &[f32], divided: &[bool]) -> u32 {
    let root = first_free(blocks);
    let largest = averages.iter().fold(f32::MIN_POSITIVE, |largest, average| largest.max(*average));
    let mut next = root + 1;
    for (averages, divided) in averages.chunks(BLOCK_CELLS).zip(divided.chunks(BLOCK_CELLS)) {
        let mut block = CellBlock([0; 2 + BLOCK_CELLS / 4]);
        block.0[1] = next;
        for (cell, (average, divided)) in averages.iter().zip(divided).enumerate() {
            let code = encode(average / largest * LARGEST_VALUE);
            bytemuck::bytes_of_mut(&mut block.0)[8 + cell] = code;
            block.0[0] |= u32::from(*divided) << cell;
        }
        next += block.divided().count_ones();
        blocks.push(block);
    }
    root
}

/// The number that the next tree's first node gets.
fn first_free(blocks: &[CellBlock]) -> u32 {
    (blocks.len() * BLOCK_CELLS / ARITY) as u32
}

/// The number of nodes in the pool after a tree of `nodes` was appended.
pub(crate) fn end(blocks: &[CellBlock], nodes: usize) -> usize {
    blocks.len() * BLOCK_CELLS / ARITY + nodes
}

/// Whether the tree of a root, if there is one, starts in this part of a pool.
pub(crate) fn holds(blocks: &[CellBlock], root: Root) -> bool {
    root.node == LEAF || (root.node as usize) < end(blocks, 0)
}
