//! One light triangle, and the same as it is seen from a shading point.

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};

use super::illumination::{Illumination, Views, horizon, is_below};
use crate::blas::{self, Cell, Lattice, Parts, Root, Shape, Worth, Worths};
use crate::env::{EnvironmentView, Footprint};
use crate::geometry::{self, Triangle};
use crate::record::{Receiver, ShadingPoint};

/// Largest coordinate of a vertex: squares of squares of distances must not overflow where the tree is built.
pub(crate) const POSITION_LIMIT: f32 = 1e9;

/// Ratio of squared radius to squared distance up to which the geometry is taken for the same all over a cell.
const FAR: f32 = 1.0 / 16.0;

/// Ratio of the least to the largest cosine of the receiver in a cell from which it is taken for the same.
const EVEN_COSINE: f32 = 0.5;

/// Share of the largest height over the receiver's plane below which a cell is not divided for its cosine.
const LOW_COSINE: f32 = 1.0 / 16.0;

const NEAR: f32 = 1.0 / 256.0;
/// What is kept of every triangle that can send light.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct LightTriangle {
    /// Counter-clockwise around the front side.
    pub(crate) vertices: [[f32; 3]; 3],
    /// The tree over its texture.
    pub(crate) root: Root,
    /// Its number among all triangles that were added, and [`Self::TWO_SIDED`] and [`Self::PORTAL`].
    pub(crate) place_and_flags: u32,
}

const _: () = assert!(size_of::<LightTriangle>() == 48);

impl LightTriangle {
    /// Sends from its back as well.
    pub(crate) const TWO_SIDED: u32 = 1 << 31;
    /// Shows the environment behind it.
    pub(crate) const PORTAL: u32 = 1 << 30;

    pub(crate) fn triangle(&self) -> Triangle {
        Triangle(self.vertices.map(Vec3::from))
    }

    /// Its number among all triangles that were added.
    pub(crate) fn place(&self) -> u32 {
        self.place_and_flags & !(Self::TWO_SIDED | Self::PORTAL)
    }

    pub(crate) fn is_two_sided(&self) -> bool {
        self.place_and_flags & Self::TWO_SIDED != 0
    }

    pub(crate) fn is_portal(&self) -> bool {
        self.place_and_flags & Self::PORTAL != 0
    }

    /// Whether the numbers, which may come from outside, are those of a triangle.
    pub(crate) fn is_valid(&self) -> bool {
        let in_range = self.vertices.as_flattened().iter().all(|x| x.abs() <= POSITION_LIMIT);
        in_range && self.root.average > 0.0
    }

    /// Whether anything can travel from the triangle to the shading point: the point is on a side that sends, and
    /// some of the triangle is above its horizon.
    pub(crate) fn is_visible(&self, x: &ShadingPoint) -> bool {
        let triangle = self.triangle();
        let height = triangle.height(x.position);
        if !(height > 0.0 || (height < 0.0 && self.is_two_sided())) {
            return false;
        }
        match x.receiver {
            Receiver::Surface(normal) => !is_below(normal, &triangle.relative_to(x.position)),
            Receiver::Transmissive(_) | Receiver::Volume => true,
        }
    }
}

/// A light triangle seen from a shading point: the target that its cells are chosen by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lit<'a> {
    receiver: Receiver,
    /// Relative to the shading point.
    pub(crate) vertices: [Vec3; 3],
    /// The same in double precision.
    exact_vertices: [DVec3; 3],
    /// Unit normal of the front side.
    pub(crate) normal: Vec3,
    pub(crate) area: f32,
    /// Distance of the shading point from the triangle's plane.
    height: f32,
    /// The same in double precision.
    exact_height: f64,
    /// Squared distance of the farthest vertex from the centroid.
    radius2: f32,
    /// The receiver's, if it has one.
    normal_of_receiver: Vec3,
    /// See [`horizon`].
    horizon: f32,
    /// Of the vertices over the receiver's plane.
    highest: f32,
    illumination: Illumination,
    /// What the triangle is a portal to, if that depends on the direction.
    environment: Option<EnvironmentView<'a>>,
}

impl<'a> Lit<'a> {
    /// The view from a shading point, or `None` where nothing can arrive.
    pub(crate) fn new(
        light: &LightTriangle,
        x: &ShadingPoint,
        illumination: Illumination,
        environment: Option<EnvironmentView<'a>>,
    ) -> Option<Self> {
        if !light.is_visible(x) {
            return None;
        }
        let triangle = light.triangle();
        let (normal, area) = triangle.normal_and_area()?;
        let height = triangle.height(x.position).abs();
        let vertices = triangle.relative_to(x.position);
        let [a, b, c] = vertices;
        let center = (a + b + c) * (1.0 / 3.0);
        let normal_of_receiver = match x.receiver {
            Receiver::Surface(normal) | Receiver::Transmissive(normal) => normal,
            Receiver::Volume => Vec3::ZERO,
        };
        Some(Self {
            receiver: x.receiver,
            vertices,
            radius2: vertices.iter().fold(0.0, |r: f32, v| r.max((*v - center).length_squared())),
            normal_of_receiver,
            horizon: horizon(normal_of_receiver, &vertices),
            highest: vertices.iter().fold(0.0, |h: f32, v| h.max(normal_of_receiver.dot(*v).abs())),
            exact_vertices: triangle.exactly_relative_to(x.position),
            normal,
            area,
            height: height as f32,
            exact_height: height,
            illumination,
            environment: environment.filter(|_| light.is_portal()),
        })
    }

    /// A point of the triangle relative to the shading point. In double precision, as the point may be much nearer
    /// than the vertices.
    #[inline]
    pub(crate) fn point(&self, point: Lattice) -> DVec3 {
        let [b1, b2] = point.to_barycentrics().map(f64::from);
        let [v0, v1, v2] = self.exact_vertices;
        v0 * (1.0 - b1 - b2) + v1 * b1 + v2 * b2
    }

    /// Barycentrics of the point where a ray from the shading point crosses the triangle.
    pub(crate) fn intersect(&self, direction: Vec3) -> Option<[f32; 2]> {
        geometry::intersect(self.exact_vertices, direction)
    }

    /// Solid angle at the shading point per area of the light at this place: `cos θl / d²`.
    #[inline]
    pub(crate) fn solid_angle_per_area(&self, point: DVec3) -> f64 {
        let distance2 = point.length_squared();
        self.exact_height / (distance2 * crate::math::sqrt64(distance2))
    }

    /// Density per solid angle of a point with this density per area, at this place relative to the shading point:
    /// `p_A d² / cos θl`. `None` where it is not a positive number.
    #[inline]
    pub(crate) fn per_solid_angle(&self, pdf_area: f64, point: DVec3) -> Option<f64> {
        let pdf = pdf_area / self.solid_angle_per_area(point);
        (pdf > 0.0 && pdf.is_finite()).then_some(pdf)
    }
}

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
    fn judge<const M: usize>(
        &self,
        parts: &Places<M>,
        averages: &[f32; M],
        even: bool,
        vertices: impl Fn(usize) -> [Vec3; 3],
    ) -> Worths<M> {
        let [x, y, z] = &parts.centers;
        let least = (self.height * self.height).max(f32::MIN_POSITIVE);
        let distance2: [f32; M] = core::array::from_fn(|i| (x[i] * x[i] + y[i] * y[i] + z[i] * z[i]).max(least));
        let area = self.area * parts.share;
        let shifted2: [f32; M] = match &parts.weighted {
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
        let far: [bool; M] = core::array::from_fn(|i| {
            radius2 <= FAR * distance2[i] && self.is_evenly_lifted(parts.heights.map(|height| height[i]))
        });
        let Some(environment) = self.environment.filter(|_| !even) else {
            return Worths { weights, uniform: far, even: [true; M] };
        };
        let (mut uniform, mut is_even) = (far, [false; M]);
        for i in 0..M {
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
        Worths { weights, uniform, even: is_even }
    }
}

/// Where the parts of a cell lie.
struct Places<const M: usize> {
    /// Of their corners over the receiver's plane.
    heights: [[f32; M]; 3],
    /// Of the corners in the centre of the texture's weight.
    weights: [[f32; M]; 3],
    /// By coordinate.
    centers: [[f32; M]; 3],
    /// The centre of the texture's weight.
    weighted: Option<[[f32; M]; 3]>,
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
        let Worths { weights: [weight], uniform: [uniform], even: [even] } =
            self.judge(&parts, &[1.0], false, |_| cell.vertices);
        Worth { weight, uniform, even }
    }

    #[inline]
    fn worths<const M: usize>(&self, cell: &Cell, texture: &Parts<'_, M>, even: bool) -> Worths<M> {
        let [a, b, c] = cell.vertices;
        let center = (a + b + c) * (1.0 / 3.0);
        let is_near = self.radius2 * cell.share() > NEAR * center.length_squared();
        let weights = if is_near { texture.centers() } else { [[1.0 / 3.0; M]; 3] };
        let weighted = is_near.then(|| {
            [[a.x, b.x, c.x], [a.y, b.y, c.y], [a.z, b.z, c.z]].map(|values| {
                let corners = blas::at_corners::<M>(values);
                core::array::from_fn(|i| (0..3).map(|k| corners[k][i] * weights[k][i]).sum::<f32>())
            })
        });
        let parts = Places {
            heights: blas::at_corners(cell.vertices.map(|v| self.normal_of_receiver.dot(v))),
            weights,
            weighted,
            centers: blas::centers(&cell.vertices),
            share: cell.share() * (1.0 / M as f32),
        };
        self.judge(&parts, &texture.averages, even, |i| cell.child::<M>(i).vertices)
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
