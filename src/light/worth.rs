//! What the cells of a light triangle are worth to a shading point.

use glam::Vec3;

use super::illumination::Views;
use super::triangle::Lit;
use crate::blas::{self, ARITY, Cell, Parts, Shape, Worth, Worths};
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
    /// Whether the receiver's cosine is about the same all over a cell, given the heights of its corners over the
    /// receiver's plane, or too small to matter.
    #[inline(always)]
    fn is_evenly_lifted(&self, [a, b, c]: [f32; 3]) -> bool {
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let top = high.max(-low);
        low.abs().min(high.abs()) >= EVEN_COSINE * top && low * high >= 0.0 || top <= LOW_COSINE * self.highest
    }

    /// Parts of one cell. `corners` and `centers` are by coordinate; the share is that of one part.
    #[inline(always)]
    fn judge<const COUNT: usize>(
        &self,
        parts: &Places<COUNT>,
        averages: &[f32; COUNT],
        even: bool,
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
            radius2 <= FAR * distance2[i] && self.is_evenly_lifted(parts.heights.map(|height| height[i]))
        });
        let Some(environment) = self.environment.filter(|_| !even) else {
            return Weighed { weights, uniform: far, even: [true; COUNT] };
        };
        let (mut uniform, mut is_even) = (far, [false; COUNT]);
        for i in 0..COUNT {
            if averages[i] == 0.0 || weights[i] == 0.0 {
                continue;
            }
            let footprint = footprint(Vec3::new(x[i], y[i], z[i]), distance2[i], radius2, area * self.height);
            let seen = environment.average(&footprint);
            let one_texel = footprint.sin_radius < 1.0 && footprint.solid_angle <= environment.texel_solid_angle();
            weights[i] *= seen.value;
            uniform[i] = one_texel || (seen.even && far[i]);
            is_even[i] = one_texel || seen.even;
        }
        Weighed { weights, uniform, even: is_even }
    }
}

/// What weighing finds out about cells of one size.
struct Weighed<const COUNT: usize> {
    /// See [`Worth::weight`].
    weights: [f32; COUNT],
    /// See [`Worth::uniform`].
    uniform: [bool; COUNT],
    /// See [`Worth::even`].
    even: [bool; COUNT],
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

impl Shape for Lit<'_> {
    #[inline]
    fn worth(&self, cell: &Cell) -> Worth {
        let [a, b, c] = cell.vertices;
        let parts = Places {
            heights: cell.vertices.map(|v| [self.normal_of_receiver.dot(v)]),
            weights: [[1.0 / 3.0]; 3],
            centers: ((a + b + c) * (1.0 / 3.0)).to_array().map(|x| [x]),
            weighted: None,
            share: cell.share(),
        };
        let Weighed { weights: [weight], uniform: [uniform], even: [even] } =
            self.judge(&parts, &[1.0], false, |_| cell.vertices);
        Worth { weight, uniform, even }
    }

    #[inline]
    fn worths(&self, cell: &Cell, texture: &Parts<'_>, even: bool) -> Worths {
        let [a, b, c] = cell.vertices;
        let center = (a + b + c) * (1.0 / 3.0);
        let is_near = self.radius2 * cell.share() > NEAR * center.length_squared();
        let weights = if is_near { texture.centers() } else { [[1.0 / 3.0; ARITY]; 3] };
        let weighted = is_near.then(|| {
            [[a.x, b.x, c.x], [a.y, b.y, c.y], [a.z, b.z, c.z]].map(|values| {
                let corners = blas::at_corners(values);
                core::array::from_fn(|i| (0..3).map(|k| corners[k][i] * weights[k][i]).sum::<f32>())
            })
        });
        let parts = Places {
            heights: blas::at_corners(cell.vertices.map(|v| self.normal_of_receiver.dot(v))),
            weights,
            weighted,
            centers: blas::centers(&cell.vertices),
            share: cell.share() * (1.0 / ARITY as f32),
        };
        let Weighed { weights, uniform, even } =
            self.judge(&parts, &texture.averages, even, |i| cell.child(i).vertices);
        Worths { weights, uniform, even }
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
