//! What the cells of a light triangle are worth to a shading point.

use glam::Vec3;

use super::illumination::Views;
use super::triangle::Lit;
use crate::blas::{self, ARITY, CellTarget, CellWeight, CellWeights, LatticeCell, TextureChildren};
use crate::env::Footprint;

/// Ratio of squared radius to squared distance up to which the geometry is taken for the same all over a cell.
const FAR: f32 = 1.0 / 16.0;

/// The same ratio from which it matters where on a cell its texture is bright.
const NEAR: f32 = 1.0 / 256.0;

/// Ratio of the least to the largest cosine of the receiver in a cell from which it is taken for the same.
const EVEN_COSINE: f32 = 0.5;

/// Share of the largest height over the receiver's plane below which a cell is not divided for its cosine.
const LOW_COSINE: f32 = 1.0 / 16.0;

impl Lit<'_> {
    /// Whether the receiver's cosine is nearly constant over a cell, given the heights of its corners over the
    /// receiver's plane, or too small to matter.
    #[inline(always)]
    fn has_constant_cosine(&self, [a, b, c]: [f32; 3]) -> bool {
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let top = high.max(-low);
        low.abs().min(high.abs()) >= EVEN_COSINE * top && low * high >= 0.0 || top <= LOW_COSINE * self.highest
    }

    /// Weighs cells of one size. With `constant_radiance` what is seen behind them is known to be the same everywhere.
    #[inline(always)]
    fn weigh_cells<const COUNT: usize>(
        &self,
        parts: &Places<COUNT>,
        averages: &[f32; COUNT],
        constant_radiance: bool,
        vertices: impl Fn(usize) -> [Vec3; 3],
    ) -> Weighed<COUNT> {
        let [x, y, z] = &parts.centers;
        let least = (self.height * self.height).max(f32::MIN_POSITIVE);
        let distance2: [f32; COUNT] = core::array::from_fn(|i| (x[i] * x[i] + y[i] * y[i] + z[i] * z[i]).max(least));
        let area = self.area * parts.share;
        let shifted2: [f32; COUNT] = match &parts.weighted {
            Some([x, y, z]) => core::array::from_fn(|i| (x[i] * x[i] + y[i] * y[i] + z[i] * z[i]).max(least)),
            None => distance2,
        };
        let views = Views {
            heights: parts.heights,
            weights: parts.weights,
            horizon: self.horizon,
            distance2: shifted2,
            area,
            height: self.height,
        };
        let mut weights = self.illumination.estimate(&self.receiver, &views, vertices);
        let radius2 = self.radius2 * parts.share;
        let far: [bool; COUNT] = core::array::from_fn(|i| {
            radius2 <= FAR * distance2[i] && self.has_constant_cosine(parts.heights.map(|height| height[i]))
        });
        let Some(environment) = self.environment.filter(|_| !constant_radiance) else {
            return Weighed { weights, is_final: far, constant_radiance: [true; COUNT] };
        };
        let (mut is_final, mut constant_radiance) = (far, [false; COUNT]);
        for i in 0..COUNT {
            if averages[i] == 0.0 || weights[i] == 0.0 {
                continue;
            }
            let footprint = footprint(Vec3::new(x[i], y[i], z[i]), distance2[i], radius2, area * self.height);
            let seen = environment.average(&footprint);
            let one_texel = footprint.sin_radius < 1.0 && footprint.solid_angle <= environment.texel_solid_angle();
            weights[i] *= seen.value;
            is_final[i] = one_texel || (seen.even && far[i]);
            constant_radiance[i] = one_texel || seen.even;
        }
        Weighed { weights, is_final, constant_radiance }
    }
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

/// Where the parts of a cell lie.
struct Places<const COUNT: usize> {
    /// Of their corners over the receiver's plane.
    heights: [[f32; COUNT]; 3],
    /// Of the corners in the centre of the texture's weight.
    weights: [[f32; COUNT]; 3],
    /// By coordinate.
    centers: [[f32; COUNT]; 3],
    /// The centre of the texture's weight.
    weighted: Option<[[f32; COUNT]; 3]>,
    /// Of each in the whole triangle's area.
    share: f32,
}

/// A cell of a triangle as the target keeps it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SpatialCell {
    /// The corners relative to the shading point.
    corners: [Vec3; 3],
    /// Whether what is seen behind the cell is known to be the same all over it.
    constant_radiance: bool,
    /// The same for each of its children.
    children_constant_radiance: [bool; ARITY],
}

impl CellTarget for Lit<'_> {
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
        let parts = Places {
            heights: cell.corners.map(|v| [self.normal_of_receiver.dot(v)]),
            weights: [[1.0 / 3.0]; 3],
            centers: ((a + b + c) * (1.0 / 3.0)).to_array().map(|x| [x]),
            weighted: None,
            share: at.area(),
        };
        let Weighed { weights: [weight], is_final: [is_final], constant_radiance: [constant_radiance] } =
            self.weigh_cells(&parts, &[1.0], false, |_| cell.corners);
        cell.constant_radiance = constant_radiance;
        CellWeight { weight, is_final }
    }

    #[inline]
    fn weigh_children(&self, at: LatticeCell, cell: &mut SpatialCell, texture: &TextureChildren<'_>) -> CellWeights {
        let [a, b, c] = cell.corners;
        let center = (a + b + c) * (1.0 / 3.0);
        let is_near = self.radius2 * at.area() > NEAR * center.length_squared();
        let weights = if is_near { texture.centers() } else { [[1.0 / 3.0; ARITY]; 3] };
        let weighted = is_near.then(|| {
            [[a.x, b.x, c.x], [a.y, b.y, c.y], [a.z, b.z, c.z]].map(|values| {
                let corners = blas::at_corners(values);
                core::array::from_fn(|i| (0..3).map(|k| corners[k][i] * weights[k][i]).sum::<f32>())
            })
        });
        let parts = Places {
            heights: blas::at_corners(cell.corners.map(|v| self.normal_of_receiver.dot(v))),
            weights,
            weighted,
            centers: blas::centers(&cell.corners),
            share: at.area() * (1.0 / ARITY as f32),
        };
        let Weighed { weights, is_final, constant_radiance } =
            self.weigh_cells(&parts, &texture.averages, cell.constant_radiance, |i| {
                blas::child_corners(&cell.corners, i)
            });
        cell.children_constant_radiance = constant_radiance;
        CellWeights { weights, is_final }
    }
}

/// The directions in which a cell is seen.
#[inline]
fn footprint(center: Vec3, distance2: f32, radius2: f32, area_by_height: f32) -> Footprint {
    let inverse = 1.0 / crate::math::sqrt(distance2);
    Footprint {
        direction: center * inverse,
        sin_radius: crate::math::sqrt(radius2) * inverse,
        solid_angle: area_by_height * inverse * inverse * inverse,
    }
}
