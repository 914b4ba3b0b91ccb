//! The tree over an image on one triangle: how deep it goes and how much memory it may take.

use alloc::vec::Vec;
use core::convert::Infallible;

use glam::Vec2;

use crate::blas::barycentric::{ARITY, LATTICE, LEVEL_HALVINGS, LatticeCell, MAX_HALVINGS};
use crate::blas::build::coverage::average;
use crate::blas::build::footprint::{UvTriangle, check_uv};
use crate::blas::build::grow::{GrowthLimits, WeightSource, grow};
use crate::blas::build::pyramid::{BYTES_PER_IMAGE, TexturePyramid};
use crate::blas::build::texture::Texture;
use crate::blas::build::touched::{self, TexelRange};
use crate::blas::node::{CellNode, Root, storable};
use crate::error::Error;
use crate::record::{Filter, Wrap};

/// A cell with no more area than this, in texels, is fine if it is short, too.
///
/// *Measured* (ACCURACY.md, "Constants of the trees over textures"). Larger changes nothing as long as the length
/// limits; smaller divides blurred cells of one texel.
const FINE_AREA: f64 = 1.0;

/// A cell with an edge longer than this, in texels, is not fine.
///
/// *Measured* (the same table). Larger leaves edges between texels to [`EXTRA_HALVINGS`]; half of it takes up to three
/// times the memory.
const FINE_LENGTH: f64 = 1.5;

/// How often a fine cell may be halved where its contrast is worth it: along sharp edges between texels, and where
/// bilinear lookup blurs them.
///
/// *Measured* (the same table). More makes cells along edges smaller and takes memory: with half of each a clip map has
/// three times the variance, with twice the blurred one it takes seven times the memory.
const EXTRA_HALVINGS: [u32; 2] = [6, 2];

/// What the contrast of fine cells that are not divided may add to the relative variance.
///
/// *Measured* (the same table). Larger saves memory, and the variance along edges grows with it.
const IMAGE_VARIANCE: f64 = 0.003;

/// The variance of a ramp, as a share of what two values at its ends would have. Larger divides blurred edges more.
///
/// *Proved*: uniform values between 0 and 1 have the variance 1/12, and two values 1/4.
const RAMP: f64 = 1.0 / 3.0;

/// Bytes for each texel that a triangle covers. A budget: with half of it noise has 1.25 times the variance, with twice
/// 0.8 times (ACCURACY.md, "Constants of the trees over textures"). Where it covers copies of them, each texel counts
/// for a quarter.
const BYTES_PER_TEXEL: f64 = 2.0;

/// The number of texels that copies count as at least, however small the image.
///
/// A budget. Smaller images have [`BYTES_PER_IMAGE`], which is more.
const TEXELS_OF_COPIES: f64 = (1 << 15) as f64;

/// Bytes for one triangle, at most. A budget: it bounds what one large image can take.
const IMAGE_TREE_BYTES: f64 = (1 << 22) as f64;

/// How many shares of [`BYTES_PER_IMAGE`] a triangle may take at most, of what the triangles before have saved: where an
/// image is detailed in a few places, most take next to nothing of theirs.
///
/// A budget. *Measured* on sphere-9-spots: with one share the variance is 1.8 times as large.
const MOST_SHARES: f64 = 4.0;

/// A triangle that covers fewer texels has no tree. One that covers as many may have a block, whatever it takes.
///
/// *Measured* (ACCURACY.md, "Constants of the trees over textures"): with twice the value a triangle over five texels
/// of noise has nine times the variance; with less, fine meshes take a block of 40 bytes for every triangle.
const LEAST_TEXELS: f64 = 4.0;

/// With fewer leaves than this for each copy of the image, a triangle is not divided: all averages would be nearly
/// equal.
///
/// A budget: more saves memory where the image repeats thousands of times, less keeps what little a tree tells there.
const LEAVES_PER_COPY: f64 = 4.0;

/// Adds the BLAS of a triangle with these texture coordinates to the pool.
///
/// A cell is divided until lookups in it are all the same, or until it has at most one texel's area and edges of at
/// most 1.5 texels; beyond that, up to six times (twice with bilinear lookup), where an edge of the image runs through.
/// A triangle whose memory runs out divides the cells first that reduce the variance most; the others keep their
/// average. There are two bytes for each texel that it can see (four where most samples would go astray), half a byte (for 2^15 texels at least) where it sees
/// copies of them, more for images of fewer than 2^17 texels, and 4 MB in all. If that leaves fewer than four leaves
/// for each copy of the image, the triangle is not divided.
///
/// # Errors
///
/// If a coordinate is not finite or beyond [`UV_LIMIT`](crate::blas::build::footprint::UV_LIMIT) (a caller that knows
/// the mesh checks first, with [`check_uv`]; here the error says mesh 0), or if the pool has no more indices. The pool
/// is then as it was.
pub(crate) fn build(pyramid: &mut TexturePyramid<'_>, uv: [Vec2; 3], pool: &mut Vec<CellNode>) -> Result<Root, Error> {
    for (vertex, uv) in uv.into_iter().enumerate() {
        check_uv(0, vertex, uv)?;
    }
    let whole = pyramid.whole();
    if whole.min == whole.max {
        return Ok(Root::constant(storable(f64::from(whole.max))));
    }
    let uv_triangle = UvTriangle::new(pyramid.texture(), uv);
    let footprint = uv_triangle.footprint(LatticeCell::whole());
    let range = touched::range(pyramid, &footprint, true);
    let memory = TreeBudget::new(&uv_triangle, pyramid);
    let nodes = memory.nodes(&uv_triangle, pyramid.texture());
    if range.is_constant() {
        pyramid.saved += memory.usual;
    }
    if range.is_constant() || nodes == 0 {
        return Ok(Root::constant(average(pyramid, &footprint, range)));
    }
    let worthwhile = (memory.worthwhile / size_of::<CellNode>() as f64) as usize;
    let fine = levels(&uv_triangle);
    let [sharp, blurred] = EXTRA_HALVINGS;
    let extra = if pyramid.texture().filtering() == Filter::Nearest { sharp } else { blurred };
    let deepest = (fine + nearest_level(extra)).min(MAX_HALVINGS / LEVEL_HALVINGS);
    debug_assert!(LATTICE >> (deepest * LEVEL_HALVINGS) >= 16);
    let source = ImageOnTriangle { pyramid, uv_triangle: &uv_triangle };
    let Ok(tree) = grow(&source, range, &GrowthLimits { nodes, worthwhile, fine, deepest, variance: IMAGE_VARIANCE });
    let (root, bytes) = tree.store(pool)?;
    pyramid.extra -= (bytes - memory.own).max(0.0).min(pyramid.extra);
    pyramid.saved = (pyramid.saved + memory.usual - bytes).max(0.0);
    Ok(root)
}

/// An image on a triangle.
struct ImageOnTriangle<'a> {
    pyramid: &'a TexturePyramid<'a>,
    uv_triangle: &'a UvTriangle,
}

impl WeightSource for ImageOnTriangle<'_> {
    type Fault = Infallible;

    fn range(&self, cell: LatticeCell, exact: bool) -> Result<TexelRange, Infallible> {
        Ok(touched::range(self.pyramid, &self.uv_triangle.footprint(cell), exact))
    }

    fn average(&self, cell: LatticeCell, range: TexelRange) -> Result<f32, Infallible> {
        Ok(average(self.pyramid, &self.uv_triangle.footprint(cell), range))
    }

    fn spread(&self) -> f64 {
        match self.pyramid.texture().filtering() {
            Filter::Nearest => 1.0,
            Filter::Bilinear => RAMP,
        }
    }
}

/// How many levels it takes until cells are fine, to the nearest: what a level more would divide is left to the contrast.
fn levels(uv_triangle: &UvTriangle) -> u32 {
    let (double_area, longest) = uv_triangle.extent();
    let (mut halvings, mut scale) = (0, 1.0);
    while halvings < MAX_HALVINGS
        && (0.5 * double_area * scale > FINE_AREA || longest * scale > FINE_LENGTH * FINE_LENGTH)
    {
        halvings += 1;
        scale *= 0.25;
    }
    nearest_level(halvings)
}

/// The number of levels whose halvings are nearest to a number of them.
const fn nearest_level(halvings: u32) -> u32 {
    (halvings + LEVEL_HALVINGS / 2) / LEVEL_HALVINGS
}

/// How many bytes a triangle may take.
struct TreeBudget {
    /// Whatever other triangles take.
    own: f64,
    /// Its share of its image's, if that is more.
    usual: f64,
    /// How many more are worth it where sampling would be bad: as many again, if it sees no texel twice.
    worthwhile: f64,
    /// With what is left of its image's, and what other triangles have saved.
    most: f64,
}

impl TreeBudget {
    fn new(uv_triangle: &UvTriangle, pyramid: &TexturePyramid<'_>) -> Self {
        let [w, h] = uv_triangle.box_size().map(|n| n + 2.0);
        let size = pyramid.texture().size().map(f64::from);
        let covered = uv_triangle.covered();
        let seen = w.min(size[0]) * h.min(size[1]);
        let own = if covered <= seen { covered } else { covered.min((0.25 * seen).max(TEXELS_OF_COPIES)) };
        let own = (BYTES_PER_TEXEL * own).min(IMAGE_TREE_BYTES);
        let share = (covered / (size[0] * size[1])).min(1.0);
        let shared = BYTES_PER_IMAGE * share;
        let usual = own.max(shared);
        let most = own.max((usual + pyramid.saved).min(MOST_SHARES * shared).min(own + pyramid.extra));
        Self { own, usual, worthwhile: if covered <= seen { own } else { 0.0 }, most }
    }

    /// The number of nodes that there is memory for, 0 if dividing would not help.
    fn nodes(&self, uv_triangle: &UvTriangle, texture: &Texture<'_>) -> usize {
        if uv_triangle.covered() < LEAST_TEXELS {
            return 0;
        }
        let nodes = ((self.most / size_of::<CellNode>() as f64) as usize).max(1);
        let [w, h] = texture.size().map(f64::from);
        let copies = 0.5 * uv_triangle.extent().0 / (w * h);
        let leaves = ((ARITY - 1) * nodes) as f64;
        let repeats = !texture.wrapping().contains(&Wrap::Clamp);
        if repeats && leaves < LEAVES_PER_COPY * copies { 0 } else { nodes }
    }
}

#[cfg(test)]
mod golden;
#[cfg(test)]
mod tests;
