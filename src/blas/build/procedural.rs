//! Weights that a function gives instead of an image, and the tree over one on a triangle.

use alloc::vec::Vec;
use core::fmt;

use glam::{DVec2, Vec2};

use crate::blas::barycentric::{LATTICE, LEVEL_HALVINGS, LatticeCell, MAX_HALVINGS};
use crate::blas::build::grow::{GrowthLimits, WeightSource, grow, nodes_in};
use crate::blas::build::touched::TexelRange;
use crate::blas::node::{CellNode, Root, storable};
use crate::error::{Error, ErrorKind};
use crate::geometry::subdivision_centers;

/// Bytes for all triangles with the same function together; the first ones take what they need. A budget.
const BYTES_PER_FUNCTION: f64 = (1 << 20) as f64;

/// Bytes for one triangle, at most. A budget: discs have a relative variance of 0.033 with half of it, 0.027 with all,
/// and 0.027 with twice as much (CONSTANTS.md, "Constants of the trees over textures").
const FUNCTION_TREE_BYTES: f64 = (1 << 18) as f64;

/// Bytes that every triangle may have, whatever others take. A budget.
const FUNCTION_OWN_BYTES: f64 = (1 << 12) as f64;

/// What the contrast of cells that are not divided may add to the relative variance, on each level.
///
/// *Measured* (the same table): half of it takes twice the memory, twice of it saves half.
const FUNCTION_VARIANCE: f64 = 0.001;

/// Parts along an edge of a cell at whose centers the function is evaluated.
///
/// *Measured* (the same table): half as many double the variance of discs; twice as many take four times the calls and
/// save 2 %.
const FUNCTION_SUBDIVISION: u32 = 4;

/// An average is at least this share of the upper bound: this much may be bright between the places that are evaluated.
///
/// *Measured* (the same table): half or twice the value changes the variance by less than 2 %. Larger spends samples on
/// black cells, smaller risks fireflies where a feature is missed by all 16 places.
const FUNCTION_FLOOR: f64 = 1.0 / 64.0;

/// How far a weight may be outside of its bound, relative to the upper end: a bound that is computed in `f32` rounds,
/// too.
///
/// A limit: larger hides wrong bounds, smaller refuses right ones. It is more than a thousand roundings.
const BOUND_TOLERANCE: f32 = 1e-4;

/// A weight that is a function of texture coordinates, with a bound over regions of them.
///
/// The tree over it is as fine as the function needs, and no finer than its memory allows: 256 kB a triangle, and
/// 1 MB for all triangles of one function, with 4 kB more for each. No image of it is ever made. The function is asked
/// while meshes are added, and never afterwards; the host evaluates it itself when it shades.
///
/// The weight at any place of a region must lie within the region's bound. The density is above zero wherever the bound
/// says that the weight may be. A loose bound costs memory and some noise, and no more; where it is the same at both
/// ends the function is taken to be constant.
///
/// Two closures, in the order of the two functions, are one:
///
/// ```
/// use fanlight::glam::{Vec2, Vec3};
/// use fanlight::{LightSampler, Mesh, Procedural, Weight};
///
/// // A disc of light.
/// let weight = |uv: Vec2| if uv.length() < 0.5 { 3.0 } else { 0.0 };
/// let bounds = |low: Vec2, high: Vec2| {
///     let nearest = Vec2::ZERO.clamp(low, high).length();
///     let farthest = low.abs().max(high.abs()).length();
///     [if farthest < 0.5 { 3.0 } else { 0.0 }, if nearest < 0.5 { 3.0 } else { 0.0 }]
/// };
/// let disc: &dyn Procedural = &(weight, bounds);
///
/// let uvs = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(Vec2::from);
/// let positions = uvs.map(|uv| uv.extend(0.0));
/// let mut builder = LightSampler::builder();
/// let weight = Weight::Texture(builder.add_procedural(disc));
/// builder.add_mesh(&Mesh::emitter(&positions, &[[0, 1, 2], [0, 2, 3]]).uvs(&uvs).weight(weight))?;
/// # Ok::<(), fanlight::Error>(())
/// ```
pub trait Procedural: Sync {
    /// The weight at a place: finite and not negative.
    fn weight(&self, uv: Vec2) -> f32;

    /// The least and the largest weight over the closed box from `low` to `high`, both of which may be the same point;
    /// or any smaller and any larger finite number that is not negative.
    fn bounds(&self, low: Vec2, high: Vec2) -> [f32; 2];
}

impl<W, B> Procedural for (W, B)
where
    W: Fn(Vec2) -> f32 + Sync,
    B: Fn(Vec2, Vec2) -> [f32; 2] + Sync,
{
    fn weight(&self, uv: Vec2) -> f32 {
        self.0(uv)
    }

    fn bounds(&self, low: Vec2, high: Vec2) -> [f32; 2] {
        self.1(low, high)
    }
}

/// A function that was added to a builder.
#[derive(Clone, Copy)]
pub(crate) struct RegisteredFunction<'a> {
    function: &'a dyn Procedural,
    /// Bytes that trees over it may still take beyond those of each triangle.
    extra: f64,
}

impl fmt::Debug for RegisteredFunction<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("RegisteredFunction").field("extra", &self.extra).finish_non_exhaustive()
    }
}

impl<'a> RegisteredFunction<'a> {
    pub(crate) fn new(function: &'a dyn Procedural) -> Self {
        Self { function, extra: BYTES_PER_FUNCTION }
    }
}

/// Adds the BLAS of a triangle of a mesh with these texture coordinates, which have been checked, to the pool.
///
/// The cells whose bounds are farthest apart, for their average, are divided until what the rest adds to the variance
/// is little, or memory runs out.
///
/// # Errors
///
/// If a bound is not one, a weight is outside of its bound, or the pool has no more indices. The pool is then as it
/// was.
pub(crate) fn build_procedural(
    function: &mut RegisteredFunction<'_>,
    mesh: usize,
    uv: [Vec2; 3],
    pool: &mut Vec<CellNode>,
) -> Result<Root, Error> {
    let source = FunctionOnTriangle::new(function.function, uv);
    let fail = |fault: FunctionFault| Error(fault.kind(mesh));
    let range = source.range(LatticeCell::whole()).map_err(fail)?;
    if range.is_constant() {
        return Ok(Root::constant(storable(f64::from(range.max))));
    }
    let most = (FUNCTION_OWN_BYTES + function.extra).min(FUNCTION_TREE_BYTES);
    let nodes = nodes_in(most).max(1);
    let deepest = MAX_HALVINGS / LEVEL_HALVINGS;
    let limits = GrowthLimits { nodes, worthwhile: 0, rescue: 0, fine: 0, deepest, variance: FUNCTION_VARIANCE };
    let tree = grow(&source, &limits).map_err(fail)?;
    let (root, bytes) = tree.store(pool)?;
    function.extra -= (bytes - FUNCTION_OWN_BYTES).max(0.0).min(function.extra);
    Ok(root)
}

/// A function on a triangle.
struct FunctionOnTriangle<'a> {
    function: &'a dyn Procedural,
    corners: [DVec2; 3],
    /// How far off a host may look because it interpolates in `f32`.
    slack: DVec2,
}

impl<'a> FunctionOnTriangle<'a> {
    fn new(function: &'a dyn Procedural, uv: [Vec2; 3]) -> Self {
        let largest = uv.map(Vec2::abs).into_iter().fold(Vec2::ZERO, Vec2::max);
        Self { function, corners: uv.map(Vec2::as_dvec2), slack: largest.as_dvec2() / f64::from(1 << 20) }
    }

    /// Place of a lattice point's barycentrics.
    fn at(&self, b1: f64, b2: f64) -> DVec2 {
        let [a, b, c] = self.corners;
        a + b1 * (b - a) + b2 * (c - a)
    }

    fn cell_corners(&self, cell: LatticeCell) -> [DVec2; 3] {
        let scale = 1.0 / f64::from(LATTICE);
        cell.corners().map(|p| self.at(f64::from(p.0[1]) * scale, f64::from(p.0[2]) * scale))
    }

    /// The box around a cell.
    fn region(&self, cell: LatticeCell) -> [Vec2; 2] {
        let [a, b, c] = self.cell_corners(cell);
        let (low, high) = (a.min(b).min(c) - self.slack, a.max(b).max(c) + self.slack);
        [low.as_vec2(), high.as_vec2()]
    }

    /// The weight at a place of a cell, if it lies within the cell's range.
    fn weight(&self, uv: Vec2, cell: LatticeCell, TexelRange { min, max }: TexelRange) -> Result<f32, FunctionFault> {
        let weight = self.function.weight(uv);
        if weight >= min - BOUND_TOLERANCE * max && weight <= max + BOUND_TOLERANCE * max {
            Ok(weight)
        } else {
            Err(FunctionFault { region: self.region(cell), bounds: [min, max], weight: Some((uv, weight)) })
        }
    }
}

impl FunctionOnTriangle<'_> {
    /// What the function says that it lies between over a cell.
    fn range(&self, cell: LatticeCell) -> Result<TexelRange, FunctionFault> {
        let region = self.region(cell);
        let [min, max] = self.function.bounds(region[0], region[1]);
        // NaN fails every comparison.
        if !(min >= 0.0 && min <= max && max < f32::INFINITY) {
            return Err(FunctionFault { region, bounds: [min, max], weight: None });
        }
        let range = TexelRange { min, max };
        if range.is_constant() {
            // It is never asked again for: one look whether that is true.
            let [a, b, c] = self.cell_corners(cell);
            self.weight(((a + b + c) / 3.0).as_vec2(), cell, range)?;
        }
        Ok(range)
    }

    /// The mean of the weights at the middles of the cell's parts.
    fn average(&self, cell: LatticeCell, range: TexelRange) -> Result<f32, FunctionFault> {
        if range.is_constant() {
            return Ok(storable(f64::from(range.max)));
        }
        let [a, b, c] = self.cell_corners(cell);
        let mut sum = 0.0;
        for [b1, b2] in subdivision_centers(FUNCTION_SUBDIVISION) {
            sum += f64::from(self.weight((a + b1 * (b - a) + b2 * (c - a)).as_vec2(), cell, range)?);
        }
        let mean = sum / f64::from(FUNCTION_SUBDIVISION * FUNCTION_SUBDIVISION);
        let [min, max] = [range.min, range.max].map(f64::from);
        Ok(storable(mean.max(FUNCTION_FLOOR * max).clamp(min, max)))
    }
}

impl WeightSource for FunctionOnTriangle<'_> {
    type Fault = FunctionFault;

    fn constant(&self, cell: LatticeCell) -> Result<Option<f32>, FunctionFault> {
        let range = self.range(cell)?;
        Ok(range.is_constant().then_some(range.max))
    }

    fn measure(&self, cell: LatticeCell) -> Result<(TexelRange, f32), FunctionFault> {
        let range = self.range(cell)?;
        Ok((range, self.average(cell, range)?))
    }

    /// Nothing is known of what lies between the ends.
    fn spread(&self) -> f64 {
        1.0
    }
}

/// A bound that is not one, or a weight outside of its bound.
struct FunctionFault {
    region: [Vec2; 2],
    bounds: [f32; 2],
    weight: Option<(Vec2, f32)>,
}

impl FunctionFault {
    fn kind(self, mesh: usize) -> ErrorKind {
        let Self { region, bounds, weight } = self;
        let region = region.map(|corner| corner.to_array());
        match weight {
            None => ErrorKind::ProceduralBounds { mesh, region, bounds },
            Some((uv, value)) => ErrorKind::ProceduralWeight { mesh, uv: uv.to_array(), value, region, bounds },
        }
    }
}
