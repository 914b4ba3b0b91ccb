//! The weights of the cells of a triangle for a shading point: all children of a cell in one loop over plain arrays.
//!
//! The loop serves the default [`Illumination`]; the others replace its geometry cell by cell. What is seen behind a
//! portal is looked up for all cells at once. Whether a descent ends is asked of the chosen cell alone.

use core::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::illumination::{CellView, Illumination, SOFTENING};
use super::triangle_view::TriangleView;
use crate::blas::{self, ARITY, CHILD_CENTERS, CellTarget, Guide, LatticeCell};
use crate::env::EnvironmentView;
use crate::math::{at_least, sqrt};
use crate::receiver::{HeightWeights, Lobe, ReceiverKind, SPREAD_OF_RADIUS2};
use crate::simd::Kernel;
use crate::warp::equal_area::sphere_to_square_quickly;

/// Ratio of squared radius to squared distance up to which the geometry is taken to be constant over a cell.
///
/// Measured (docs/ACCURACY.md, "Near cells"). A larger value ends descents earlier and leaves variance near a triangle,
/// a smaller one takes time.
const CONSTANT_GEOMETRY: f32 = 1.0 / 16.0;

/// Ratio of the least to the largest cosine of the receiver in a cell from which the cosine is taken to be constant.
///
/// Measured (docs/ACCURACY.md, "Constant cosine"). A larger value divides further for less variance.
const CONSTANT_COSINE: f32 = 0.5;

/// Share of the largest height over the receiver's plane below which a cell is not divided for its cosine.
///
/// Measured (docs/ACCURACY.md, "Constant cosine"). A smaller value divides cells that hardly contribute.
const LOW_COSINE: f32 = 1.0 / 16.0;

/// Levels below the tree over the texture at which a descent ends whatever is left: without a tree, and with one, whose
/// last cells are smaller.
///
/// Chosen, not swept (docs/ACCURACY.md, "Wide steps"). Larger: each level is one more step next to the triangle and in
/// front of small bright parts of the environment; on the window, a fourth changed the variance by less than a
/// hundredth. Smaller: these are left to noise; with two, the window's energy-weighted variance under clouds doubled.
/// Both were seen before triangles without a texture had a grid of their own. Now these come here only with another
/// [`Illumination`], or with next to no solid angle.
const MOST_LEVELS: [u32; 2] = [3, 2];

/// Least weight of a cell that may send light. Proved: products with averages and radiances are made positive again,
/// and nothing that matters is as small. Larger: more samples where nothing is expected.
const LEAST_CELL_WEIGHT: f32 = 1e-37;

/// Rounding of a cell's center relative to the largest coordinate of a vertex, granted to the cone around the cell.
///
/// Proved: a center is a sum of three products, each off by less than 2e-7. Larger: coarser bounds of small cells.
const CENTER_ROUNDING: f32 = 1e-6;

/// A cell of a triangle as the descent keeps it.
#[derive(Clone, Copy, Debug)]
pub(super) struct SpatialCell {
    /// Corners relative to the shading point, in the environment's frame if there is an environment.
    corners: [Vec3; 3],
    /// Heights of the corners over the receiver's plane.
    heights: [f32; 3],
    /// Whether what is seen behind the cell has been found to be about constant.
    has_constant_radiance: bool,
}

/// The target that the cells of a triangle are chosen by.
pub(super) struct CellKernel<'a, L> {
    view: &'a TriangleView<'a>,
    weights: HeightWeights,
    /// Lobe of the receiver, in the frame of the corners of cells.
    lobe: L,
    horizon: f32,
    /// Least squared distance of any point.
    least_distance2: f32,
    /// What is seen behind a portal.
    environment: Option<&'a EnvironmentView<'a>>,
    /// Whether what is seen may be black or of great contrast.
    is_rough: bool,
}

/// A descent from a triangle to a cell.
pub(super) struct CellDescent<'a, G, L> {
    pub(super) view: &'a TriangleView<'a>,
    pub(super) guide: &'a mut G,
    /// Lobe of the view's receiver.
    pub(super) lobe: L,
}

impl<G: Guide, L: Lobe> Kernel for CellDescent<'_, G, L> {
    type Output = Option<(LatticeCell, f64)>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        blas::descend(self.view.cells, self.view.root, &CellKernel::new(self.view, self.lobe), self.guide)
    }
}

impl<'a, L: Lobe> CellKernel<'a, L> {
    #[inline(always)]
    fn new(view: &'a TriangleView<'a>, lobe: L) -> Self {
        let environment = view.followed_environment();
        Self {
            view,
            weights: view.receiver.height_weights(),
            lobe: match environment {
                Some(environment) => lobe.map(|vector| environment.local_vector(vector)),
                None => lobe,
            },
            horizon: view.cell_horizon(),
            least_distance2: at_least(view.height * view.height, f32::MIN_POSITIVE),
            environment,
            is_rough: environment.is_some_and(EnvironmentView::is_rough),
        }
    }

    /// Weights of the children of a cell.
    #[inline(always)]
    fn weigh<const LOOKUP: bool, const COVERING: bool>(
        &self,
        at: LatticeCell,
        cell: &SpatialCell,
        averages: &[f32; ARITY],
        weights: &mut [f32; ARITY],
    ) {
        let [v0, v1, v2] = cell.corners;
        let (e1, e2) = (v1 - v0, v2 - v0);
        let [h0, h1, h2] = cell.heights;
        let mean = (h0 + h1 + h2) * (1.0 / 3.0);
        let farther = [h0 - mean, h1 - mean, h2 - mean];
        let (h1, h2) = (h1 - h0, h2 - h0);
        let share = at.area() * (1.0 / ARITY as f32);
        let area = self.view.area * share;
        let area_by_height = area * self.view.height;
        let scale = area_by_height * FRAC_1_PI;
        let softening = SOFTENING * area;
        let texels = EnvironmentView::filter_texels(area_by_height);
        let finest = self.environment.map_or(1.0, |environment| environment.size() as f32);
        let radius = if COVERING { sqrt(self.view.radius2 * share) + CENTER_ROUNDING * self.extent() } else { 0.0 };
        // Everything that the loop needs is a local value: what is behind a reference might be what the loop writes.
        let (receiver, horizon, least_distance2) = (self.weights, self.horizon, self.least_distance2);
        let (lobe, variance) = (self.lobe, SPREAD_OF_RADIUS2 * self.view.radius2 * share);
        let (v0, e1, e2) = (v0.to_array(), e1.to_array(), e2.to_array());
        let (mut fine, mut cover) = ([0; ARITY], [0; ARITY]);
        for i in 0..ARITY {
            let (b1, b2, turn) = (CHILD_CENTERS.b1[i], CHILD_CENTERS.b2[i], CHILD_CENTERS.scale[i]);
            let [x, y, z] = [0, 1, 2].map(|k| v0[k] + (e1[k] * b1 + e2[k] * b2));
            let distance2 = at_least(x * x + y * y + z * z, least_distance2);
            let distance = sqrt(distance2);
            let height = h0 + (h1 * b1 + h2 * b2);
            let heights = [height + turn * farther[0], height + turn * farther[1], height + turn * farther[2]];
            let toward = lobe.weigh(receiver.mean(heights, distance), [x, y, z], distance, variance / distance2);
            let softened = distance2 + softening;
            let weight = at_least(scale * toward / (softened * softened), LEAST_CELL_WEIGHT);
            let highest = at_least(at_least(heights[0], heights[1]), heights[2]);
            weights[i] = if highest < horizon { 0.0 } else { weight };
            if LOOKUP {
                let inverse = 1.0 / distance;
                let point = sphere_to_square_quickly([x * inverse, y * inverse, z * inverse]);
                let size = EnvironmentView::filter_size_of_lane(texels * (distance2 * distance), finest);
                fine[i] = EnvironmentView::texel_in_level(point, size);
                if COVERING {
                    // asin(s) <= s + (π/2 - 1) s³ up to 1, as all terms of its series are positive. From 1 on the size
                    // is 1 anyway.
                    let sine = radius * inverse;
                    let angle = sine + 0.570_8 * (sine * sine * sine);
                    cover[i] = EnvironmentView::texel_in_level(point, EnvironmentView::cover_size(angle, finest));
                }
            }
        }
        if self.view.illumination != Illumination::ClampedVertices {
            self.estimate_one_by_one(at, averages, weights);
        }
        if let Some(environment) = self.environment.filter(|_| LOOKUP) {
            environment.weigh_lanes(&fine, COVERING.then_some(&cover), weights);
        }
    }

    /// Replaces the weights of the geometry by those of another strategy.
    #[cold]
    #[inline(never)]
    fn estimate_one_by_one(&self, at: LatticeCell, averages: &[f32; ARITY], weights: &mut [f32; ARITY]) {
        for i in (0..ARITY).filter(|&i| averages[i] > 0.0) {
            weights[i] = self.view.estimate(at.child(i));
        }
    }

    /// Largest coordinate of a vertex.
    #[inline(always)]
    fn extent(&self) -> f32 {
        self.view.vertices.iter().fold(0.0, |extent: f32, vertex| extent.max(vertex.abs().max_element()))
    }

    /// Whether distance and cosine are about constant over a cell with this squared distance.
    #[inline(always)]
    fn has_constant_geometry(&self, cell: &SpatialCell, share: f32, distance2: f32) -> bool {
        self.view.radius2 * share <= CONSTANT_GEOMETRY * distance2 && self.has_constant_cosine(cell.heights)
    }

    /// Whether the lobe is about constant over a cell with this center and squared distance.
    #[inline(always)]
    fn has_constant_lobe(&self, center: Vec3, share: f32, distance2: f32) -> bool {
        let direction = center * (1.0 / sqrt(distance2));
        self.lobe.is_about_constant(direction.to_array(), SPREAD_OF_RADIUS2 * self.view.radius2 * share / distance2)
    }

    /// Whether the receiver's cosine is nearly constant over a cell, or too small to matter. The heights are those of
    /// the cell's corners over the receiver's plane.
    #[inline(always)]
    fn has_constant_cosine(&self, [a, b, c]: [f32; 3]) -> bool {
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let top = high.max(-low);
        low.abs().min(high.abs()) >= CONSTANT_COSINE * top && low * high >= 0.0 || top <= LOW_COSINE * self.view.highest
    }
}

impl<L: Lobe> CellTarget for CellKernel<'_, L> {
    type Cell = SpatialCell;

    #[inline(always)]
    fn whole(&self) -> SpatialCell {
        let vertices = self.view.vertices;
        SpatialCell {
            corners: match self.environment {
                Some(environment) => vertices.map(|vertex| environment.local_direction(vertex)),
                None => vertices,
            },
            // Not in another frame: the horizon leaves no room for the rounding of a rotation.
            heights: vertices.map(|vertex| self.view.receiver_normal.dot(vertex)),
            has_constant_radiance: self.environment.is_none(),
        }
    }

    #[inline(always)]
    fn child(&self, cell: &SpatialCell, index: usize) -> SpatialCell {
        SpatialCell {
            corners: blas::child_corners(&cell.corners, index),
            heights: blas::child_values(&cell.heights, index),
            has_constant_radiance: cell.has_constant_radiance,
        }
    }

    #[inline(always)]
    fn weigh_children(&self, at: LatticeCell, cell: &SpatialCell, averages: &[f32; ARITY], weights: &mut [f32; ARITY]) {
        match (cell.has_constant_radiance, self.is_rough) {
            (true, _) => self.weigh::<false, false>(at, cell, averages, weights),
            (false, false) => self.weigh::<true, false>(at, cell, averages, weights),
            (false, true) => self.weigh::<true, true>(at, cell, averages, weights),
        }
    }

    #[inline(always)]
    fn is_final(&self, at: LatticeCell, cell: &mut SpatialCell, levels: Option<u32>) -> bool {
        if levels.is_none() && cell.has_constant_radiance {
            return false;
        }
        let is_textured = self.view.root.node != blas::LEAF;
        if levels == Some(MOST_LEVELS[usize::from(is_textured)]) {
            return true;
        }
        let [a, b, c] = cell.corners;
        let center = (a + b + c) * (1.0 / 3.0);
        let distance2 = at_least(center.length_squared(), self.least_distance2);
        let share = at.area();
        if let Some(environment) = self.environment.filter(|_| !cell.has_constant_radiance) {
            let inverse = 1.0 / sqrt(distance2);
            let solid_angle = self.view.area * share * self.view.height * (inverse * inverse * inverse);
            let point = sphere_to_square_quickly((center * inverse).to_array());
            cell.has_constant_radiance = environment.is_about_constant(point, solid_angle);
        }
        cell.has_constant_radiance
            && self.has_constant_geometry(cell, share, distance2)
            && self.has_constant_lobe(center, share, distance2)
    }
}

impl TriangleView<'_> {
    /// Height over the receiver's plane below which a cell's corner is below its horizon for certain.
    #[inline(always)]
    fn cell_horizon(&self) -> f32 {
        if self.receiver.has_horizon() { self.horizon } else { f32::NEG_INFINITY }
    }

    /// Estimates the irradiance over π from a cell, as if it had a radiance of one. Zero only below the horizon.
    pub(super) fn estimate(&self, at: LatticeCell) -> f32 {
        let vertices = at.corners().map(|corner| {
            let [b1, b2] = corner.to_barycentrics();
            let [v0, v1, v2] = self.vertices;
            v0 * (1.0 - b1 - b2) + v1 * b1 + v2 * b2
        });
        let [a, b, c] = vertices;
        let center = (a + b + c) * (1.0 / 3.0);
        let cell = CellView {
            vertices,
            heights: vertices.map(|vertex| self.receiver_normal.dot(vertex)),
            horizon: self.cell_horizon(),
            distance2: center.length_squared().max(self.height * self.height).max(f32::MIN_POSITIVE),
            area: self.area * at.area(),
            height: self.height,
            variance: SPREAD_OF_RADIUS2 * self.radius2 * at.area(),
        };
        self.illumination.estimate(self.receiver, &cell)
    }
}
