//! How much a small triangle of unit radiance sends to a shading point: the three terms of the talk, and a fourth
//! that is both faster and closer, as interchangeable strategies.

use core::f32::consts::FRAC_1_PI;

use glam::Vec3;

use crate::math;
use crate::record::Receiver;

/// Which estimate of the irradiance from a cell guides the descent inside a triangle.
///
/// Each is zero only where the whole cell lies below the horizon, so that all give unbiased sampling; they differ
/// in noise and speed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum Illumination {
    /// The mean of the receiver's clamped cosine at the vertices, over the squared distance of the centre made larger
    /// by a part of the cell's area: an upper bound of the cosine that is exact where the cell is above the horizon.
    #[default]
    ClampedVertices,
    /// The talk's extremely conservative term, `(1 + cos θs) (1 + cos θl) / 4 π d²` at the centre.
    Conservative,
    /// The form factor from point to point, `cos θs cos θl / π d²` at the centre, where both cosines are clamped to
    /// at least 0.01.
    PointToPoint,
    /// Lambert's boundary integral over the part above the horizon (for volumes: the solid angle).
    Boundary,
}

/// Least cosine of the point-to-point term in a cell that is not below the horizon as a whole.
const LEAST_COSINE: f32 = 0.01;
/// Share of the conservative term that the boundary integral keeps where rounding makes it vanish.
const LEAST_BOUNDARY: f32 = 1e-4;
/// Share of a cell's area that is added to the squared distance of its centre.
const SOFTENING: f32 = 0.25;
/// Relative error granted to the dot products that decide on the horizon.
const ROUNDING: f32 = 1e-5;

impl Illumination {
    /// The inverse of the cast to an integer.
    pub(crate) fn from_u32(value: u32) -> Option<Self> {
        [Self::ClampedVertices, Self::Conservative, Self::PointToPoint, Self::Boundary]
            .into_iter()
            .find(|kind| *kind as u32 == value)
    }

    /// The estimates for cells of one size in a plane. Zero only below the horizon; never NaN, possibly infinite.
    #[inline(always)]
    pub(crate) fn estimate<const COUNT: usize>(
        self,
        receiver: &Receiver,
        cells: &Views<COUNT>,
        vertices: impl Fn(usize) -> [Vec3; 3],
    ) -> [f32; COUNT] {
        let mut estimates = match self {
            Self::ClampedVertices => clamped_vertices(receiver, cells),
            _ => core::array::from_fn(|i| self.at_center(receiver, cells, i, &vertices)),
        };
        if let Receiver::Surface(_) = receiver {
            let [a, b, c] = &cells.heights;
            for (i, estimate) in estimates.iter_mut().enumerate() {
                let highest = a[i].max(b[i]).max(c[i]);
                *estimate = if highest < cells.horizon { 0.0 } else { *estimate };
            }
        }
        estimates
    }

    /// The terms that look at the centre of a cell.
    fn at_center<const COUNT: usize>(
        self,
        receiver: &Receiver,
        cells: &Views<COUNT>,
        i: usize,
        vertices: &impl Fn(usize) -> [Vec3; 3],
    ) -> f32 {
        let (area, distance2) = (cells.area, cells.distance2[i]);
        let inverse = 1.0 / math::sqrt(distance2);
        let cos_l = (cells.height * inverse).min(1.0);
        let mean = cells.heights.iter().map(|height| height[i]).sum::<f32>() * (1.0 / 3.0);
        let cos_s = match receiver {
            Receiver::Surface(_) => mean * inverse,
            Receiver::Transmissive(_) => mean.abs() * inverse,
            Receiver::Volume => 1.0,
        };
        let conservative = area * (1.0 + cos_s).max(LEAST_COSINE) * (1.0 + cos_l) * (0.25 * FRAC_1_PI) / distance2;
        match self {
            Self::ClampedVertices | Self::Conservative => conservative,
            Self::PointToPoint => area * cos_s.max(LEAST_COSINE) * cos_l.max(LEAST_COSINE) * FRAC_1_PI / distance2,
            Self::Boundary => boundary(receiver, &vertices(i)).max(LEAST_BOUNDARY * conservative),
        }
    }
}

/// Cells of one size in a plane as a shading point sees them.
pub(crate) struct Views<const COUNT: usize> {
    /// Heights of the corners over the receiver's plane, if it has a normal.
    pub(crate) heights: [[f32; COUNT]; 3],
    /// Weights of the corners.
    pub(crate) weights: [[f32; COUNT]; 3],
    /// Below the horizon for certain is what is lower than this.
    pub(crate) horizon: f32,
    /// Squared distances of the centres; positive.
    pub(crate) distance2: [f32; COUNT],
    /// Area of each.
    pub(crate) area: f32,
    /// Distance of the shading point from their plane.
    pub(crate) height: f32,
}

/// The default. Neither square roots nor branches on a surface, so that cells share vector registers.
#[inline(always)]
fn clamped_vertices<const COUNT: usize>(receiver: &Receiver, cells: &Views<COUNT>) -> [f32; COUNT] {
    let [[a, b, c], [p, q, r]] = [&cells.heights, &cells.weights];
    let softened: [f32; COUNT] = core::array::from_fn(|i| cells.distance2[i] + SOFTENING * cells.area);
    let toward: [f32; COUNT] = match receiver {
        Receiver::Surface(_) => {
            core::array::from_fn(|i| p[i] * a[i].max(0.0) + q[i] * b[i].max(0.0) + r[i] * c[i].max(0.0))
        }
        Receiver::Transmissive(_) => {
            core::array::from_fn(|i| p[i] * a[i].abs() + q[i] * b[i].abs() + r[i] * c[i].abs())
        }
        Receiver::Volume => core::array::from_fn(|i| math::sqrt(softened[i])),
    };
    let scale = cells.area * cells.height * FRAC_1_PI;
    core::array::from_fn(|i| (scale * toward[i] / (softened[i] * softened[i])).max(f32::MIN_POSITIVE))
}

/// Height over the receiver's plane below which a vertex is so for certain, whatever rounding has done to those of
/// cells of the triangle with these vertices.
#[inline]
pub(crate) fn horizon(normal: Vec3, vertices: &[Vec3; 3]) -> f32 {
    let largest = vertices.iter().fold(0.0, |largest: f32, v| largest.max(normal.abs().dot(v.abs())));
    -ROUNDING * largest
}

/// Whether all vertices lie below the horizon of a normal, and not just by rounding.
#[inline]
pub(crate) fn is_below(normal: Vec3, vertices: &[Vec3; 3]) -> bool {
    vertices.iter().all(|v| normal.dot(*v) < -ROUNDING * normal.abs().dot(v.abs()))
}

/// Exact irradiance over π from a triangle (or its solid angle over π), as far as `f32` goes.
fn boundary(receiver: &Receiver, vertices: &[Vec3; 3]) -> f32 {
    match *receiver {
        Receiver::Surface(normal) => lambert(normal, vertices),
        Receiver::Transmissive(normal) => lambert(normal, vertices) + lambert(-normal, vertices),
        Receiver::Volume => solid_angle(vertices) * FRAC_1_PI,
    }
}

/// Lambert's formula for the polygon that is left of a triangle above the horizon:
/// `1 / 2π Σ γ_i cos δ_i`, with γ the angle of an edge and δ the one between its plane's normal and the receiver's.
fn lambert(normal: Vec3, vertices: &[Vec3; 3]) -> f32 {
    let mut polygon = [Vec3::ZERO; 4];
    let mut count = 0;
    let mut push = |v: Vec3| {
        polygon[count] = v.normalize_or_zero();
        count += 1;
    };
    for i in 0..3 {
        let (v, next) = (vertices[i], vertices[(i + 1) % 3]);
        let (height, next_height) = (normal.dot(v), normal.dot(next));
        if height >= 0.0 {
            push(v);
        }
        if (height >= 0.0) != (next_height >= 0.0) {
            push(v + (next - v) * (height / (height - next_height)));
        }
    }
    let edges = (0..count).map(|i| {
        let (v, next) = (polygon[i], polygon[(i + 1) % count]);
        math::acos(v.dot(next)) * normal.dot(v.cross(next).normalize_or_zero())
    });
    0.5 * FRAC_1_PI * edges.sum::<f32>().abs()
}

/// Solid angle of a triangle (Van Oosterom and Strackee 1983).
fn solid_angle(vertices: &[Vec3; 3]) -> f32 {
    let [a, b, c] = vertices.map(|v| v.normalize_or_zero());
    let numerator = a.dot(b.cross(c)).abs();
    let denominator = 1.0 + a.dot(b) + b.dot(c) + c.dot(a);
    2.0 * math::atan2(numerator, denominator)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Irradiance over π of a triangle by brute force in double precision.
    fn reference(receiver: &Receiver, vertices: [Vec3; 3]) -> f64 {
        let [a, b, c] = vertices.map(Vec3::as_dvec3);
        let cross = (b - a).cross(c - a);
        let n = 400;
        let mut sum = 0.0;
        for i in 0..n {
            for j in 0..n - i {
                for inverted in [0.0, 1.0] {
                    if inverted > 0.0 && i + j == n - 1 {
                        continue;
                    }
                    let step = 1.0 / f64::from(n);
                    let (b1, b2) = (
                        (f64::from(i) + (1.0 + inverted) / 3.0) * step,
                        (f64::from(j) + (1.0 + inverted) / 3.0) * step,
                    );
                    let p = a + (b - a) * b1 + (c - a) * b2;
                    let d2 = p.length_squared();
                    let direction = p / d2.sqrt();
                    let weight = match *receiver {
                        Receiver::Surface(n) => n.as_dvec3().dot(direction).max(0.0),
                        Receiver::Transmissive(n) => n.as_dvec3().dot(direction).abs(),
                        Receiver::Volume => 1.0,
                    };
                    sum += weight * direction.dot(cross).abs() * 0.5 / d2 * step * step;
                }
            }
        }
        sum * core::f64::consts::FRAC_1_PI
    }

    #[test]
    fn the_boundary_integral_is_the_irradiance() {
        let normal = Vec3::new(0.1, 0.2, 0.9).normalize();
        for receiver in [Receiver::Surface(normal), Receiver::Transmissive(normal), Receiver::Volume] {
            for vertices in [
                [Vec3::new(-1.0, -0.5, 1.0), Vec3::new(1.0, -0.5, 1.5), Vec3::new(0.0, 1.0, 2.0)],
                [Vec3::new(1.0, -0.5, -1.0), Vec3::new(1.0, 0.5, 1.5), Vec3::new(1.5, 1.0, -0.5)],
                [Vec3::new(0.5, 0.0, 0.8), Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.5, 0.1, 0.8)],
            ] {
                let exact = reference(&receiver, vertices);
                let found = f64::from(boundary(&receiver, &vertices));
                assert!((found - exact).abs() < 2e-3 * exact, "{receiver:?} {vertices:?}: {found} {exact}");
            }
        }
    }

    /// The estimate for one cell.
    fn estimate(strategy: Illumination, receiver: &Receiver, vertices: [Vec3; 3]) -> f32 {
        let normal = if let Receiver::Surface(normal) = *receiver { normal } else { Vec3::Z };
        let [a, b, c] = vertices;
        let cells = Views {
            heights: vertices.map(|v| [normal.dot(v)]),
            weights: [[1.0 / 3.0]; 3],
            horizon: horizon(normal, &vertices),
            distance2: [((a + b + c) / 3.0).length_squared()],
            area: 0.5,
            height: 0.3,
        };
        strategy.estimate(receiver, &cells, |_| vertices)[0]
    }

    #[test]
    fn only_cells_below_the_horizon_are_worth_nothing() {
        let strategies = [
            Illumination::ClampedVertices,
            Illumination::Conservative,
            Illumination::PointToPoint,
            Illumination::Boundary,
        ];
        let up = Receiver::Surface(Vec3::Z);
        let below = [Vec3::new(0.0, 0.0, -1.0), Vec3::new(1.0, 0.0, -0.1), Vec3::new(0.0, 1.0, -0.5)];
        let crossing = [below[0], below[1], Vec3::new(0.0, 1.0, 1e-3)];
        for strategy in strategies {
            assert_eq!(estimate(strategy, &up, below), 0.0);
            assert!(estimate(strategy, &up, crossing) > 0.0);
            assert!(estimate(strategy, &Receiver::Volume, below) > 0.0);
            assert!(estimate(strategy, &Receiver::Transmissive(Vec3::Z), below) > 0.0);
        }
    }
}
