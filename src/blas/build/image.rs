//! Trees over images on triangles: how deep they go and how much memory they may take.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;
use core::convert::Infallible;

use glam::Vec2;

use crate::blas::barycentric::{ARITY, LATTICE, LEVEL_HALVINGS, LatticeCell, MAX_HALVINGS};
use crate::blas::build::coverage::average;
use crate::blas::build::footprint::UvTriangle;
use crate::blas::build::grow::{GrownTree, GrowthLimits, WeightSource, grow, nodes_in};
use crate::blas::build::pyramid::{BYTES_PER_IMAGE, ImageMemory, TexturePyramid, rescue_bytes};
use crate::blas::build::texture::Texture;
use crate::blas::build::touched::{self, TexelRange};
use crate::blas::node::{CellNode, Root, storable};
use crate::error::Error;
use crate::parallel;
use crate::progress::{Cancelled, Progress};
use crate::record::{Filter, Wrap};

/// A cell with no more area than this, in texels, is fine if it is short, too.
///
/// *Measured* (CONSTANTS.md, "Constants of the trees over textures"). Larger changes nothing as long as the length
/// limits; smaller divides blurred cells of one texel.
const FINE_AREA: f64 = 1.0;

/// A cell with an edge longer than this, in texels, is not fine.
///
/// *Measured* (the same table). Larger leaves edges between texels to [`EXTRA_HALVINGS`]; half of it takes up to three
/// times the memory.
const FINE_LENGTH: f64 = 1.5;

/// How often a fine cell may be halved where its contrast is worth it: along sharp edges between texels, and where
/// bilinear lookup blurs them. A level halves a cell three times, so that these are two levels and one.
///
/// *Measured* (the same table) with levels of one halving. More makes cells along edges smaller and takes memory: with
/// half of each a clip map had three times the variance, with twice the blurred one it took seven times the memory.
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
/// 0.8 times (CONSTANTS.md, "Constants of the trees over textures"). Where it covers copies of them, each texel counts
/// for a quarter.
const BYTES_PER_TEXEL: f64 = 2.0;

/// The number of texels that copies count as at least, however small the image.
///
/// A budget. Smaller images have [`BYTES_PER_IMAGE`], which is more.
const TEXELS_OF_COPIES: f64 = (1 << 15) as f64;

/// Bytes for one triangle, at most. A budget: it bounds what one large image can take.
const IMAGE_TREE_BYTES: f64 = (1 << 22) as f64;

/// How many shares of [`BYTES_PER_IMAGE`] a triangle may take at most, if triangles of earlier batches have saved
/// theirs: where an image is detailed in a few places, most triangles take next to nothing.
///
/// A budget, chosen and not swept: with one share the variance of sphere-9-spots was 1.8 times as large. Larger: the
/// first triangles with detail may take what later ones need. Smaller: detail is left inside of cells while memory is
/// unused.
const MOST_SHARES: f64 = 4.0;

/// A triangle that covers fewer texels has no tree. One that covers as many may have a node, whatever it takes.
///
/// *Measured* (CONSTANTS.md, "Constants of the trees over textures"): with twice the value a triangle over five texels
/// of noise has nine times the variance; with less, fine meshes take a node of 76 bytes for every triangle.
const LEAST_TEXELS: f64 = 4.0;

/// With fewer leaves than this for each copy of the image, a triangle is not divided: all averages would be nearly
/// equal.
///
/// A budget: more saves memory where the image repeats thousands of times, less keeps what little a tree tells there.
const LEAVES_PER_COPY: f64 = 4.0;

/// Trees are grown side by side, this many at a time.
///
/// A budget: more keep more threads busy to the end, and hold more trees that are not packed yet.
const BATCH_TREES: usize = 64;

/// Trees of a batch may take up to about this many bytes. Unpacked they take four times as much. A budget, as
/// [`BATCH_TREES`].
const BATCH_BYTES: f64 = (1 << 23) as f64;

/// The texels of images whose pyramids are held at the same time, unless one image alone has more. A budget: more keep
/// more threads busy where there are many small images, and take four bytes a texel.
const GROUP_TEXELS: u64 = 1 << 22;

/// Bytes of a tree that take about as long to grow as a light takes to find its place in the tree over all lights.
/// *Measured* on 880 triangles of glass and on 10^6 small ones. It only makes reports of progress even.
const BYTES_PER_UNIT: f64 = 8.0;

/// Texels of an image of which the pyramid takes as long. *Measured* as [`BYTES_PER_UNIT`].
const TEXELS_PER_UNIT: u64 = 64;

/// A triangle that is to have a tree over an image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ImageTree<'a> {
    /// The image.
    pub(crate) image: Texture<'a>,
    /// The image's number.
    pub(crate) texture: u32,
    /// Texture coordinates that [`check_uv`](crate::blas::check_uv) has accepted.
    pub(crate) uv: [Vec2; 3],
}

/// Returns the units of work of [`build_images`], for trees in any order.
pub(crate) fn image_work(trees: &[ImageTree<'_>]) -> f64 {
    let images: BTreeMap<u32, u64> = trees.iter().map(|tree| (tree.texture, tree.image.texels())).collect();
    let pyramids: u64 = images.values().map(|texels| texels / TEXELS_PER_UNIT).sum();
    pyramids as f64 + parallel::sum(trees.len(), |i| units(&trees[i].image, trees[i].uv) as f64)
}

/// Units of work of one tree.
fn units(texture: &Texture<'_>, uv: [Vec2; 3]) -> usize {
    1 + (TreeBudget::new(&UvTriangle::new(texture, uv), texture, ImageMemory::default()).most / BYTES_PER_UNIT) as usize
}

/// Adds the BLAS of many triangles to the pool. `trees` are sorted by their textures. Returns their roots in the same
/// order.
///
/// A cell is divided until lookups in it are all the same, or until, to the nearest level, it has at most one texel's
/// area and edges of at most 1.5 texels; beyond that, by up to two levels (one with bilinear lookup), where an edge of
/// the image runs through. A triangle whose memory runs out divides the cells first that reduce the variance most; the
/// others keep their average. There are two bytes for each texel that it can see (four where most samples would go
/// astray), half a byte (for 2^15 texels at least) where it sees copies of them, more for images of fewer than 2^17
/// texels, and 4 MB in all (8 MB). If that leaves fewer than four leaves for each copy of the image, the triangle is
/// not divided. Where most of what is left undivided is cells that are black in part, as behind a fine grid of openings, the
/// triangles of an image may take 64 bytes for each of its texels more, and 12 MB at most.
///
/// What the triangles of a small image share is given out in their order, so that the number of threads changes
/// nothing.
///
/// # Errors
///
/// If the pool has no more indices, or if the host has canceled the build.
pub(crate) fn build_images(
    trees: &[ImageTree<'_>],
    pool: &mut Vec<CellNode>,
    progress: &Progress<'_>,
) -> Result<Vec<Root>, Error> {
    let mut roots = Vec::with_capacity(trees.len());
    let mut rest = trees;
    while let Some(first) = rest.first() {
        // Images whose pyramids are held together, by their first trees.
        let (mut firsts, mut texels, mut count) = (alloc::vec![*first], first.image.texels(), 0);
        for tree in rest {
            if firsts.last().is_some_and(|last| last.texture != tree.texture) {
                texels += tree.image.texels();
                if texels > GROUP_TEXELS {
                    break;
                }
                firsts.push(*tree);
            }
            count += 1;
        }
        let (group, others) = rest.split_at(count);
        rest = others;
        let pyramids = parallel::map(&firsts, 2, |first| {
            progress.check()?;
            let pyramid = TexturePyramid::new(first.image);
            progress.add((pyramid.texture().texels() / TEXELS_PER_UNIT) as usize);
            Ok(pyramid)
        });
        let mut images = ImageGroup {
            numbers: firsts.iter().map(|first| first.texture).collect(),
            pyramids: pyramids.map_err(cancelled)?,
        };
        let mut rest = group;
        while !rest.is_empty() {
            let batch = images.batch(rest);
            images.build(&rest[..batch], pool, progress, &mut roots)?;
            images.end_batch();
            rest = &rest[batch..];
        }
    }
    Ok(roots)
}

fn cancelled(cancelled: Cancelled) -> Error {
    cancelled.into()
}

/// Images whose trees are built together.
struct ImageGroup<'a> {
    /// Their numbers, in ascending order.
    numbers: Vec<u32>,
    pyramids: Vec<TexturePyramid<'a>>,
}

impl<'a> ImageGroup<'a> {
    /// Leaves what the trees of a batch have saved to the next ones. Within a batch memory only shrinks, so that most
    /// trees need not be grown again.
    fn end_batch(&mut self) {
        for ImageMemory { saved, saved_now, .. } in self.pyramids.iter_mut().map(|pyramid| &mut pyramid.memory) {
            *saved += core::mem::take(saved_now);
        }
    }

    fn slot(&self, tree: &ImageTree<'_>) -> usize {
        // Every tree's texture is in its group.
        self.numbers.partition_point(|&number| number < tree.texture).min(self.pyramids.len() - 1)
    }

    fn pyramid(&self, tree: &ImageTree<'_>) -> &TexturePyramid<'a> {
        &self.pyramids[self.slot(tree)]
    }

    /// Returns how many of the next trees may be held unpacked.
    fn batch(&self, trees: &[ImageTree<'_>]) -> usize {
        let mut bytes = 0.0;
        let fits = |tree: &&ImageTree<'_>| {
            let texture = self.pyramid(tree).texture();
            bytes += TreeBudget::new(&UvTriangle::new(texture, tree.uv), texture, ImageMemory::default()).most;
            bytes <= BATCH_BYTES
        };
        trees.iter().take(BATCH_TREES).take_while(fits).count().max(1)
    }

    /// Grows the trees side by side, all with what is left of their images' memory, and packs them one after the other.
    /// A tree that fits into what the trees before it have left is the one that would have been grown with that; the
    /// others are grown again.
    fn build(
        &mut self,
        trees: &[ImageTree<'_>],
        pool: &mut Vec<CellNode>,
        progress: &Progress<'_>,
        roots: &mut Vec<Root>,
    ) -> Result<(), Error> {
        let mut grown = parallel::map(trees, 2, |tree| {
            progress.check()?;
            let pyramid = self.pyramid(tree);
            let grown = GrownImage::new(pyramid, tree.uv);
            progress.add(units(pyramid.texture(), tree.uv));
            Ok(grown)
        })
        .map_err(cancelled)?;
        for at in 0..trees.len() {
            let slot = self.slot(&trees[at]);
            if !grown[at].fits(&self.pyramids[slot]) {
                let again: Vec<usize> = (at..trees.len())
                    .filter(|&i| self.slot(&trees[i]) == slot && !grown[i].fits(&self.pyramids[slot]))
                    .collect();
                let Ok(regrown) = parallel::map(&again, 2, |&i| {
                    Ok::<_, Infallible>(GrownImage::new(&self.pyramids[slot], trees[i].uv))
                });
                again.into_iter().zip(regrown).for_each(|(i, tree)| grown[i] = tree);
            }
            let (root, bytes) = grown[at].tree.store(pool)?;
            let (left, grown_for) = (&mut self.pyramids[slot].memory, &grown[at].memory);
            let rescue = (grown[at].tree.rescued * size_of::<CellNode>()) as f64;
            left.rescue -= rescue.min(left.rescue);
            let bytes = bytes - rescue;
            left.extra -= (bytes - grown_for.own).max(0.0).min(left.extra);
            left.saved = (left.saved - (bytes - grown_for.usual).max(0.0)).max(0.0);
            left.saved_now += (grown_for.usual - bytes).max(0.0);
            roots.push(root);
            // It is packed now.
            grown[at].tree = GrownTree::constant(root.average);
        }
        Ok(())
    }
}

/// A tree over an image before it is packed.
struct GrownImage {
    tree: GrownTree,
    uv_triangle: UvTriangle,
    /// Bytes that it was allowed.
    memory: TreeBudget,
}

impl GrownImage {
    /// Grows a tree with what is left of the image's memory.
    fn new(pyramid: &TexturePyramid<'_>, uv: [Vec2; 3]) -> Self {
        let texture = pyramid.texture();
        let uv_triangle = UvTriangle::new(texture, uv);
        let memory = TreeBudget::new(&uv_triangle, texture, pyramid.memory);
        let grown = |tree| Self { tree, uv_triangle, memory };
        let whole = pyramid.whole();
        if whole.min == whole.max {
            return grown(GrownTree::constant(storable(f64::from(whole.max))));
        }
        let source = ImageOnTriangle { pyramid, uv_triangle: &uv_triangle };
        let nodes = memory.nodes(&uv_triangle, texture);
        let Ok((range, average)) = source.measure(LatticeCell::whole());
        if range.is_constant() || nodes == 0 {
            return grown(GrownTree::constant(average));
        }
        let fine = levels(&uv_triangle);
        let [sharp, blurred] = EXTRA_HALVINGS;
        let extra = if texture.filtering() == Filter::Nearest { sharp } else { blurred };
        let deepest = (fine + nearest_level(extra)).min(MAX_HALVINGS / LEVEL_HALVINGS);
        debug_assert!(LATTICE >> (deepest * LEVEL_HALVINGS) >= 16);
        let [worthwhile, rescue] = [memory.worthwhile, memory.rescue].map(nodes_in);
        let limits = GrowthLimits { nodes, worthwhile, rescue, fine, deepest, variance: IMAGE_VARIANCE };
        let Ok(tree) = grow(&source, &limits);
        grown(tree)
    }

    /// Whether it takes no more than what is left now.
    fn fits(&self, pyramid: &TexturePyramid<'_>) -> bool {
        let texture = pyramid.texture();
        let memory = TreeBudget::new(&self.uv_triangle, texture, pyramid.memory);
        let [before, now] = [&self.memory, &memory].map(|memory| memory.nodes(&self.uv_triangle, texture));
        now >= (self.tree.nodes() - self.tree.rescued).min(before) && nodes_in(memory.rescue) >= self.tree.rescued
    }
}

/// Adds the BLAS of one triangle with these texture coordinates to the pool.
#[cfg(test)]
pub(crate) fn build(pyramid: &mut TexturePyramid<'_>, uv: [Vec2; 3], pool: &mut Vec<CellNode>) -> Result<Root, Error> {
    for (vertex, uv) in uv.into_iter().enumerate() {
        crate::blas::check_uv(0, vertex, uv)?;
    }
    let mut images = ImageGroup { numbers: alloc::vec![0], pyramids: alloc::vec![pyramid.clone()] };
    let mut roots = Vec::new();
    let image = *pyramid.texture();
    images.build(&[ImageTree { image, texture: 0, uv }], pool, &Progress::new(None, 1.0), &mut roots)?;
    images.end_batch();
    pyramid.memory = images.pyramids[0].memory;
    Ok(roots[0])
}

/// An image on a triangle.
struct ImageOnTriangle<'a> {
    pyramid: &'a TexturePyramid<'a>,
    uv_triangle: &'a UvTriangle,
}

impl WeightSource for ImageOnTriangle<'_> {
    type Fault = Infallible;

    fn constant(&self, cell: LatticeCell) -> Result<Option<f32>, Infallible> {
        Ok(touched::constant(self.pyramid, &self.uv_triangle.footprint(cell)))
    }

    fn measure(&self, cell: LatticeCell) -> Result<(TexelRange, f32), Infallible> {
        let footprint = self.uv_triangle.footprint(cell);
        let window = touched::window(self.pyramid, &footprint);
        let range = touched::range(self.pyramid, &footprint, window.as_ref());
        Ok((range, average(self.pyramid, &footprint, range, window.as_ref())))
    }

    fn spread(&self) -> f64 {
        match self.pyramid.texture().filtering() {
            Filter::Nearest => 1.0,
            Filter::Bilinear => RAMP,
        }
    }
}

/// How many levels it takes until cells are fine, to the nearest: what a level more would divide is left to the
/// contrast.
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
#[derive(Clone, Copy)]
struct TreeBudget {
    /// Whatever other triangles take.
    own: f64,
    /// Its share of its image's, if that is more.
    usual: f64,
    /// How many more are worth it where sampling would be bad: as many again, if it sees no texel twice.
    worthwhile: f64,
    /// How many more it may take where samples would go astray: its share of its image's, or what is left of that.
    rescue: f64,
    /// With what is left of its image's, and what other triangles have saved.
    most: f64,
}

impl TreeBudget {
    fn new(uv_triangle: &UvTriangle, texture: &Texture<'_>, left: ImageMemory) -> Self {
        let [w, h] = uv_triangle.box_size().map(|n| n + 2.0);
        let size = texture.size().map(f64::from);
        let covered = uv_triangle.covered();
        let seen = w.min(size[0]) * h.min(size[1]);
        let own = if covered <= seen { covered } else { covered.min((0.25 * seen).max(TEXELS_OF_COPIES)) };
        let own = (BYTES_PER_TEXEL * own).min(IMAGE_TREE_BYTES);
        let share = (covered / (size[0] * size[1])).min(1.0);
        let shared = BYTES_PER_IMAGE * share;
        let usual = own.max(shared);
        let most = own.max((usual + left.saved).min(MOST_SHARES * shared).min(own + left.extra));
        let rescue = left.rescue.min(share * rescue_bytes(texture));
        let [worthwhile, rescue] = if covered <= seen { [own, rescue] } else { [0.0; 2] };
        Self { own, usual, worthwhile, rescue, most }
    }

    /// The number of nodes that there is memory for, 0 if dividing would not help.
    fn nodes(&self, uv_triangle: &UvTriangle, texture: &Texture<'_>) -> usize {
        if uv_triangle.covered() < LEAST_TEXELS {
            return 0;
        }
        let nodes = nodes_in(self.most).max(1);
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
