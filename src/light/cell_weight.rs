//! The weights of a triangle's cells for a shading point.

use glam::Vec3;

use super::illumination::CellViews;
use super::triangle_view::TriangleView;
use crate::blas::{self, ARITY, CellTarget, CellWeight, CellWeights, LatticeCell, TextureChildren};
use crate::env::DirectionCone;
use crate::math;

/// Ratio of squared radius to squared distance up to which the geometry is taken to be constant over a cell.
///
/// Measured (docs/ACCURACY.md, "Near cells"). A larger value ends descents earlier and leaves variance near a triangle, a
/// smaller one takes time.
const CONSTANT_GEOMETRY: f32 = 1.0 / 16.0;

/// Ratio of squared radius to squared distance from which it matters where on a cell its texture is bright.
///
/// Measured (docs/ACCURACY.md, "Where the texture is"). A larger value saves lookups, a smaller one gains nothing more.
const TEXTURE_CENTER: f32 = 1.0 / 256.0;

/// Ratio of the least to the largest cosine of the receiver in a cell from which the cosine is taken to be constant.
///
/// Measured (docs/ACCURACY.md, "Even cosine"). A larger value divides further for less variance.
const CONSTANT_COSINE: f32 = 0.5;

/// Share of the largest height over the receiver's plane below which a cell is not divided for its cosine.
///
/// Measured (docs/ACCURACY.md, "Even cosine"). A smaller value divides cells that hardly contribute.
const LOW_COSINE: f32 = 1.0 / 16.0;

/// A cell of a triangle as the descent keeps it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SpatialCell {
    /// Corners relative to the shading point.
    corners: [Vec3; 3],
    /// Whether what is seen behind the cell is known to be the same all over it.
    constant_radiance: bool,
    /// Whether that is known of each of its children.
    children_constant_radiance: [bool; ARITY],
}

/// Where cells of one size lie.
struct CellGeometry<const COUNT: usize> {
    /// Heights of their corners over the receiver's plane, by corner.
    heights: [[f32; COUNT]; 3],
    /// Weights of the corners in the center of the texture's weight, by corner.
    weights: [[f32; COUNT]; 3],
    /// Centroids, by coordinate.
    centers: [[f32; COUNT]; 3],
    /// Centers of the texture's weight by coordinate, where they matter.
    weighted_centers: Option<[[f32; COUNT]; 3]>,
    /// Area of each in the whole triangle's.
    share: f32,
}

/// What weighing finds out about cells of one size.
struct Weighed<const COUNT: usize> {
    /// See [`CellWeight::weight`].
    weights: [f32; COUNT],
    /// See [`CellWeight::is_final`].
    is_final: [bool; COUNT],
    /// Whether what is seen behind a cell is the same all over it.
    constant_radiance: [bool; COUNT],
}

impl TriangleView<'_> {
    /// Whether the receiver's cosine is nearly constant over a cell, or too small to matter. The heights are those of the
    /// cell's corners over the receiver's plane.
    #[inline(always)]
    fn has_constant_cosine(&self, [a, b, c]: [f32; 3]) -> bool {
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let top = high.max(-low);
        low.abs().min(high.abs()) >= CONSTANT_COSINE * top && low * high >= 0.0 || top <= LOW_COSINE * self.highest
    }

    /// Whether the geometry is nearly constant over the whole triangle.
    #[inline]
    pub(super) fn has_constant_geometry(&self) -> bool {
        let [a, b, c] = self.vertices;
        let distance2 = ((a + b + c) * (1.0 / 3.0)).length_squared();
        self.radius2 <= CONSTANT_GEOMETRY * distance2
            && self.has_constant_cosine(self.vertices.map(|v| self.receiver_normal.dot(v)))
    }

    /// Weighs cells of one size. With `constant_radiance` what is seen behind them is known to be the same everywhere.
    #[inline(always)]
    fn weigh_cells<const COUNT: usize>(
        &self,
        cells: &CellGeometry<COUNT>,
        averages: &[f32; COUNT],
        constant_radiance: bool,
        vertices: impl Fn(usize) -> [Vec3; 3],
    ) -> Weighed<COUNT> {
        let [x, y, z] = &cells.centers;
        let least = (self.height * self.height).max(f32::MIN_POSITIVE);
        let distance2: [f32; COUNT] = core::array::from_fn(|i| (x[i] * x[i] + y[i] * y[i] + z[i] * z[i]).max(least));
        let area = self.area * cells.share;
        let weighted_distance2: [f32; COUNT] = match &cells.weighted_centers {
            Some([x, y, z]) => core::array::from_fn(|i| (x[i] * x[i] + y[i] * y[i] + z[i] * z[i]).max(least)),
            None => distance2,
        };
        let views = CellViews {
            heights: cells.heights,
            weights: cells.weights,
            horizon: self.horizon,
            distance2: weighted_distance2,
            area,
            height: self.height,
        };
        let mut weights = self.illumination.estimate(self.receiver, &views, vertices);
        let radius2 = self.radius2 * cells.share;
        let constant_geometry: [bool; COUNT] = core::array::from_fn(|i| {
            radius2 <= CONSTANT_GEOMETRY * distance2[i]
                && self.has_constant_cosine(cells.heights.map(|height| height[i]))
        });
        let Some(environment) = self.environment.filter(|_| !constant_radiance) else {
            return Weighed { weights, is_final: constant_geometry, constant_radiance: [true; COUNT] };
        };
        let (mut is_final, mut constant_radiance) = (constant_geometry, [false; COUNT]);
        for i in 0..COUNT {
            if averages[i] == 0.0 || weights[i] == 0.0 {
                continue;
            }
            let cone = cone_of_cell(Vec3::new(x[i], y[i], z[i]), distance2[i], radius2, area * self.height);
            let seen = environment.estimate_radiance(&cone);
            let one_texel = cone.sin_radius < 1.0 && cone.solid_angle <= environment.texel_solid_angle();
            weights[i] *= seen.value;
            is_final[i] = one_texel || (seen.is_constant && constant_geometry[i]);
            constant_radiance[i] = one_texel || seen.is_constant;
        }
        Weighed { weights, is_final, constant_radiance }
    }
}

impl CellTarget for TriangleView<'_> {
    type Cell = SpatialCell;

    #[inline]
    fn whole(&self) -> SpatialCell {
        SpatialCell { corners: self.vertices, constant_radiance: false, children_constant_radiance: [false; ARITY] }
    }

    #[inline]
    fn child(&self, cell: &SpatialCell, index: usize) -> SpatialCell {
        SpatialCell {
            corners: blas::child_corners(&cell.corners, index),
            constant_radiance: cell.children_constant_radiance[index],
            children_constant_radiance: [false; ARITY],
        }
    }

    #[inline]
    fn weigh(&self, at: LatticeCell, cell: &mut SpatialCell) -> CellWeight {
        let [a, b, c] = cell.corners;
        let geometry = CellGeometry {
            heights: cell.corners.map(|v| [self.receiver_normal.dot(v)]),
            weights: [[1.0 / 3.0]; 3],
            centers: ((a + b + c) * (1.0 / 3.0)).to_array().map(|x| [x]),
            weighted_centers: None,
            share: at.area(),
        };
        let Weighed { weights: [weight], is_final: [is_final], constant_radiance: [constant_radiance] } =
            self.weigh_cells(&geometry, &[1.0], false, |_| cell.corners);
        cell.constant_radiance = constant_radiance;
        CellWeight { weight, is_final }
    }

    #[inline]
    fn weigh_children(&self, at: LatticeCell, cell: &mut SpatialCell, texture: &TextureChildren<'_>) -> CellWeights {
        let [a, b, c] = cell.corners;
        let center = (a + b + c) * (1.0 / 3.0);
        let is_near = self.radius2 * at.area() > TEXTURE_CENTER * center.length_squared();
        let weights = if is_near { texture.centers() } else { [[1.0 / 3.0; ARITY]; 3] };
        let weighted_centers = is_near.then(|| {
            [[a.x, b.x, c.x], [a.y, b.y, c.y], [a.z, b.z, c.z]].map(|values| {
                let corners = blas::at_corners(values);
                core::array::from_fn(|i| (0..3).map(|k| corners[k][i] * weights[k][i]).sum::<f32>())
            })
        });
        let geometry = CellGeometry {
            heights: blas::at_corners(cell.corners.map(|v| self.receiver_normal.dot(v))),
            weights,
            weighted_centers,
            centers: blas::centers(&cell.corners),
            share: at.area() * (1.0 / ARITY as f32),
        };
        let corners = cell.corners;
        let vertices = |i| blas::child_corners(&corners, i);
        let Weighed { weights, is_final, constant_radiance } =
            self.weigh_cells(&geometry, &texture.averages, cell.constant_radiance, vertices);
        cell.children_constant_radiance = constant_radiance;
        CellWeights { weights, is_final }
    }
}

/// The cone of directions in which a cell is seen.
#[inline]
fn cone_of_cell(center: Vec3, distance2: f32, radius2: f32, area_by_height: f32) -> DirectionCone {
    let inverse = 1.0 / math::sqrt(distance2);
    DirectionCone {
        direction: center * inverse,
        sin_radius: math::sqrt(radius2) * inverse,
        solid_angle: area_by_height * inverse * inverse * inverse,
    }
}
