//! Builds the BLAS of one triangle: how deep it goes and how much memory it may take.

use alloc::vec::Vec;
use core::convert::Infallible;

use glam::Vec2;

use crate::blas::barycentric::{ARITY, Cell, LATTICE, LEVEL_HALVINGS, MAX_DEPTH};
use crate::blas::coverage::{average, storable};
use crate::blas::footprint::{Chart, check_uv};
use crate::blas::grow::{Limits, Source, Tree, grow};
use crate::blas::node::{Block, CELLS, LEAF, Root, append, end};
use crate::blas::pyramid::Prepared;
use crate::blas::texture::Texture;
use crate::blas::touched::{self, Range};
use crate::error::{Error, Kind};
use crate::record::{Filter, Wrap};

/// A cell with no more area than this, in texels, is fine if it is short, too.
const FINE_AREA: f64 = 1.0;

/// A cell with an edge longer than this, in texels, is not fine.
const FINE_LENGTH: f64 = 1.5;

/// A fine cell may still be halved so often where its contrast is worth it: along sharp edges between texels, and
/// where look-up blurs them.
const EXTRA_HALVINGS: [u32; 2] = [6, 2];

/// What the contrast of fine cells that are not divided may add to the relative variance.
const VARIANCE: f64 = 0.003;

/// The variance of a ramp, as a share of what two values at its ends would have.
const RAMP: f64 = 1.0 / 3.0;

/// Memory for each texel that a triangle covers. Where it covers copies of them, each texel counts for a quarter.
const BYTES_PER_TEXEL: f64 = 2.0;

/// Memory for edges between the few large texels of a small image. All its triangles share it: the first ones take what
/// they need.
pub(super) const BYTES_PER_IMAGE: f64 = (1 << 18) as f64;

/// So many copies of texels count as texels of their own.
const TEXELS_OF_COPIES: f64 = (1 << 15) as f64;

/// Memory for one triangle, at most.
const MAX_BYTES: f64 = (1 << 22) as f64;

/// A triangle that covers fewer texels has no tree. One that covers as many may have a block, whatever it takes.
const LEAST_TEXELS: f64 = 4.0;

/// With fewer leaves than this to a copy of the image, all averages would be much the same.
const LEAVES_PER_COPY: f64 = 4.0;

/// Adds the BLAS of a triangle with these texture coordinates to the pool.
///
/// A cell is divided until look-ups in it are all the same, or until it has at most one texel's area and edges of at
/// most 1.5 texels; beyond that, up to six times (twice with bilinear look-up), where an edge of the image runs through. A triangle whose memory
/// runs out divides the cells first that are worth most; the others keep their average. There are two bytes for each
/// texel that it can see, half a byte (for 2^15 texels at least) where it sees copies of them, more for images of less than 2^17 texels,
/// and 4 MB in all. If that leaves fewer than four leaves for each copy of the image, the triangle is not divided.
///
/// # Errors
///
/// If a coordinate is not finite or beyond [`UV_LIMIT`](crate::blas::footprint::UV_LIMIT) (a caller that knows the
/// mesh checks first, with [`check_uv`]; here the error says mesh 0), or if the pool has no more indices. The pool
/// is then as it was.
pub(crate) fn build(prepared: &mut Prepared<'_>, uv: [Vec2; 3], pool: &mut Vec<Block>) -> Result<Root, Error> {
    for (vertex, uv) in uv.into_iter().enumerate() {
        check_uv(0, vertex, uv)?;
    }
    let whole = prepared.whole();
    if whole.min == whole.max {
        return Ok(Root::constant(storable(f64::from(whole.max))));
    }
    let chart = Chart::new(prepared.texture(), uv);
    let footprint = chart.footprint(Cell::root());
    let range = touched::range(prepared, &footprint, true);
    let memory = Memory::new(&chart, prepared);
    let nodes = memory.nodes(&chart, prepared.texture());
    if range.is_constant() || nodes == 0 {
        return Ok(Root::constant(average(prepared, &footprint, range)));
    }
    let fine = levels(&chart);
    let [sharp, blurred] = EXTRA_HALVINGS;
    let extra = if prepared.texture().filtering() == Filter::Nearest { sharp } else { blurred };
    let deepest = (fine + extra / LEVEL_HALVINGS).min(MAX_DEPTH / LEVEL_HALVINGS);
    debug_assert!(LATTICE >> (deepest * LEVEL_HALVINGS) >= 16);
    let source = ImageOn { prepared, chart: &chart };
    let Ok(tree) = grow(&source, range, &Limits { nodes, fine, deepest, variance: VARIANCE });
    let (root, bytes) = store(&tree, pool)?;
    prepared.extra -= (bytes - memory.own).max(0.0).min(prepared.extra);
    Ok(root)
}

/// Adds a tree to the pool. Second, the bytes that it takes.
pub(super) fn store(tree: &Tree, pool: &mut Vec<Block>) -> Result<(Root, f64), Error> {
    if tree.divided.is_empty() || tree.average == 0.0 {
        return Ok((Root::constant(tree.average), 0.0));
    }
    let count = end(pool, tree.divided.len() / ARITY);
    if count >= LEAF as usize {
        return Err(Error(Kind::TooMany { what: "BLAS nodes", count, limit: LEAF as usize }));
    }
    let bytes = tree.averages.len().div_ceil(CELLS) * size_of::<Block>();
    Ok((Root { average: tree.average, node: append(pool, &tree.averages, &tree.divided) }, bytes as f64))
}

/// An image on a triangle.
struct ImageOn<'a> {
    prepared: &'a Prepared<'a>,
    chart: &'a Chart,
}

impl Source for ImageOn<'_> {
    type Fault = Infallible;

    fn range(&self, cell: Cell, exact: bool) -> Result<Range, Infallible> {
        Ok(touched::range(self.prepared, &self.chart.footprint(cell), exact))
    }

    fn average(&self, cell: Cell, range: Range) -> Result<f32, Infallible> {
        Ok(average(self.prepared, &self.chart.footprint(cell), range))
    }

    fn spread(&self) -> f64 {
        match self.prepared.texture().filtering() {
            Filter::Nearest => 1.0,
            Filter::Bilinear => RAMP,
        }
    }
}

/// How many levels it takes until cells are fine.
fn levels(chart: &Chart) -> u32 {
    let halvings = LEVEL_HALVINGS;
    let (double_area, longest) = chart.extent();
    let mut levels = 0;
    let mut scale = 1.0;
    while (levels + 1) * halvings <= MAX_DEPTH
        && (0.5 * double_area * scale > FINE_AREA || longest * scale > FINE_LENGTH * FINE_LENGTH)
    {
        levels += 1;
        scale /= ARITY as f64;
    }
    levels
}

/// How many bytes a triangle may take.
struct Memory {
    /// Whatever other triangles take.
    own: f64,
    /// With what is left of its image's.
    most: f64,
}

impl Memory {
    fn new(chart: &Chart, prepared: &Prepared<'_>) -> Self {
        let [w, h] = chart.box_size().map(|n| n + 2.0);
        let size = prepared.texture().size().map(f64::from);
        let covered = chart.covered();
        let seen = w.min(size[0]) * h.min(size[1]);
        let own = if covered <= seen { covered } else { covered.min((0.25 * seen).max(TEXELS_OF_COPIES)) };
        let own = (BYTES_PER_TEXEL * own).min(MAX_BYTES);
        let share = (covered / (size[0] * size[1])).min(1.0);
        Self { own, most: own.max((BYTES_PER_IMAGE * share).min(own + prepared.extra)) }
    }

    /// The number of nodes that there is memory for, 0 if dividing would not help.
    fn nodes(&self, chart: &Chart, texture: &Texture<'_>) -> usize {
        if chart.covered() < LEAST_TEXELS {
            return 0;
        }
        let blocks = ((self.most / size_of::<Block>() as f64) as usize).max(1);
        let nodes = blocks * CELLS / ARITY;
        let [w, h] = texture.size().map(f64::from);
        let copies = 0.5 * chart.extent().0 / (w * h);
        let leaves = ((ARITY - 1) * nodes) as f64;
        let repeats = !texture.wrapping().contains(&Wrap::Clamp);
        if repeats && leaves < LEAVES_PER_COPY * copies { 0 } else { nodes }
    }
}

#[cfg(test)]
mod golden;
#[cfg(test)]
mod tests;
