//! Builds the BLAS of one triangle, from the top, one level at a time.

use alloc::vec::Vec;

use glam::Vec2;

use crate::blas::barycentric::{Cell, LATTICE, MAX_DEPTH, level_halvings};
use crate::blas::coverage::{average, storable};
use crate::blas::footprint::{Chart, check_uv};
use crate::blas::node::{LEAF, Node, Root};
use crate::blas::pyramid::Prepared;
use crate::blas::texture::Texture;
use crate::blas::touched::{self, Range};
use crate::error::{Error, Kind};
use crate::record::Wrap;

/// A cell with no more area than this, in texels, is not divided if it is short, too.
const LEAF_AREA: f64 = 1.0;

/// A cell with an edge longer than this, in texels, is divided.
const LEAF_LENGTH: f64 = 1.5;

/// Leaves for each texel that a triangle can see, at most. Half a texel each is what a tree of arity 4 needs.
const LEAVES_PER_TEXEL: f64 = 4.0;

/// Copies of the same texels have leaves of their own up to here, 0.7 MB of nodes.
const MAX_LEAVES_OF_COPIES: f64 = (1 << 16) as f64;

/// Leaves for one triangle, at most: about 11 MB of nodes.
const MAX_LEAVES: f64 = (1 << 20) as f64;

/// With fewer leaves than this to a copy of the image, all averages would be much the same.
const LEAVES_PER_COPY: f64 = 4.0;

/// A cell that is still to be divided, and where its average and its node belong.
struct Open {
    cell: Cell,
    range: Range,
    /// The node that holds the cell, or [`LEAF`] for the whole triangle.
    node: u32,
    slot: usize,
}

/// Adds the BLAS of a triangle with these texture coordinates to the pool.
///
/// A cell is divided until look-ups in it are all the same, or until it has at most one texel's area and edges of at
/// most 1.5 texels. A triangle that spans so much of the plane that its budget of leaves runs out divides the cells
/// with the largest contrast first; the others keep their average. The budget is four leaves for each texel that it
/// can see, where copies of one texel count once beyond 2^16 leaves, and 2^20 in all. If that leaves fewer than four
/// for each copy of the image, the triangle is not divided.
///
/// # Errors
///
/// If a coordinate is not finite or beyond [`UV_LIMIT`](crate::blas::footprint::UV_LIMIT) (a caller that knows the
/// mesh checks first, with [`check_uv`]; here the error says mesh 0), or if the pool has no more indices. The pool
/// is then as it was.
pub(crate) fn build<const M: usize>(
    prepared: &Prepared<'_>,
    uv: [Vec2; 3],
    pool: &mut Vec<Node<M>>,
) -> Result<Root, Error> {
    for (vertex, uv) in uv.into_iter().enumerate() {
        check_uv(0, vertex, uv)?;
    }
    let whole = prepared.whole();
    if whole.min == whole.max {
        return Ok(Root::constant(storable(f64::from(whole.max))));
    }
    let chart = Chart::new(prepared.texture(), uv);
    let range = touched::range(prepared, &chart.footprint(Cell::root()), false);
    let levels = levels::<M>(&chart);
    let leaves = max_leaves(&chart, prepared.texture());
    if range.is_constant() || levels == 0 || leaves < M as f64 {
        let footprint = chart.footprint(Cell::root());
        let range = touched::range(prepared, &footprint, true);
        return Ok(Root::constant(average(prepared, &footprint, range)));
    }
    let start = pool.len();
    // Dividing a leaf adds M - 1 leaves.
    let max_nodes = (leaves / (M - 1) as f64) as usize;
    let mut open = alloc::vec![Open { cell: Cell::root(), range, node: LEAF, slot: 0 }];
    for level in 0..levels {
        let room = max_nodes - (pool.len() - start);
        if open.len() > room {
            leave(prepared, &chart, &mut open, room, pool);
        }
        if pool.len() + open.len() >= LEAF as usize {
            pool.truncate(start);
            return Err(Error(Kind::TooMany {
                what: "BLAS nodes",
                count: pool.len() + open.len(),
                limit: LEAF as usize,
            }));
        }
        let mut next = Vec::new();
        for parent in open {
            divide(prepared, &chart, parent, level + 1 == levels, pool, &mut next);
        }
        open = next;
    }
    Ok(Root { average: sum_up(pool, start), node: start as u32 })
}

/// How many levels it takes until cells are small enough.
fn levels<const M: usize>(chart: &Chart) -> u32 {
    let halvings = level_halvings::<M>();
    let (double_area, longest) = chart.extent();
    let mut levels = 0;
    let mut scale = 1.0;
    while (levels + 1) * halvings <= MAX_DEPTH
        && (0.5 * double_area * scale > LEAF_AREA || longest * scale > LEAF_LENGTH * LEAF_LENGTH)
    {
        levels += 1;
        scale /= M as f64;
    }
    debug_assert!(LATTICE >> (levels * halvings) >= 16);
    levels
}

/// The budget of leaves, 0 if dividing would not help.
fn max_leaves(chart: &Chart, texture: &Texture<'_>) -> f64 {
    let [w, h] = chart.box_size().map(|n| n + 2.0);
    let size = texture.size().map(f64::from);
    let seen = w.min(size[0]) * h.min(size[1]);
    let leaves = (LEAVES_PER_TEXEL * w * h).min(MAX_LEAVES_OF_COPIES.max(LEAVES_PER_TEXEL * seen)).min(MAX_LEAVES);
    let copies = 0.5 * chart.extent().0 / (size[0] * size[1]);
    let repeats = !texture.wrapping().contains(&Wrap::Clamp);
    if repeats && leaves < LEAVES_PER_COPY * copies { 0.0 } else { leaves }
}

/// Adds a node for a cell. Its own cells are set, or put off to the next level.
fn divide<const M: usize>(
    prepared: &Prepared<'_>,
    chart: &Chart,
    parent: Open,
    last: bool,
    pool: &mut Vec<Node<M>>,
    next: &mut Vec<Open>,
) {
    let index = pool.len() as u32;
    if parent.node != LEAF {
        pool[parent.node as usize].set_below(parent.slot, index);
    }
    let mut node = Node::black();
    for slot in 0..M {
        let cell = parent.cell.child::<M>(slot);
        let footprint = chart.footprint(cell);
        let range = touched::range(prepared, &footprint, last);
        if last || range.is_constant() {
            node.set_average(slot, average(prepared, &footprint, range));
        } else {
            next.push(Open { cell, range, node: index, slot });
        }
    }
    pool.push(node);
}

/// Keeps the `room` cells with the largest contrast, in their order; the others become leaves.
fn leave<const M: usize>(
    prepared: &Prepared<'_>,
    chart: &Chart,
    open: &mut Vec<Open>,
    room: usize,
    pool: &mut [Node<M>],
) {
    for cell in open.iter_mut() {
        cell.range = touched::range(prepared, &chart.footprint(cell.cell), true);
    }
    let mut ranks: Vec<(f32, usize)> = open.iter().map(|o| o.range.max - o.range.min).zip(0..).collect();
    ranks.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut keep = alloc::vec![false; open.len()];
    for &(_, i) in &ranks[..room] {
        keep[i] = true;
    }
    let mut i = 0;
    open.retain(|cell| {
        let kept = keep[i];
        i += 1;
        // The whole triangle is always kept: there is room for one node at least.
        if !kept {
            let value = average(prepared, &chart.footprint(cell.cell), cell.range);
            pool[cell.node as usize].set_average(cell.slot, value);
        }
        kept
    });
}

/// Sets the average of every divided cell to the mean of its node. Returns that of the whole triangle.
fn sum_up<const M: usize>(pool: &mut [Node<M>], start: usize) -> f32 {
    for i in (start..pool.len()).rev() {
        for cell in 0..M {
            let below = pool[i].below(cell);
            if below != LEAF {
                let mean = storable(pool[below as usize].mean());
                pool[i].set_average(cell, mean);
            }
        }
    }
    storable(pool[start].mean())
}

#[cfg(test)]
mod golden;
#[cfg(test)]
mod tests;
