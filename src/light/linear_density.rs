//! Points of a triangle without a texture by a density that is linear over its area.
//!
//! Where a triangle is small for its distance, what its points send to the receiver is almost a linear function of
//! their barycentrics, given by its three corners. (Hart et al. 2020, "Practical Product Sampling by Fitting and
//! Composing Warps", warp a square in this way.) No direction is computed, so that a sample costs next to nothing. With
//! the least effort the density is constant, which saves the search for a root.

use glam::Vec3;

use super::triangle_view::TriangleView;
use super::{DrawnPoint, LightViewKind, LocalPoint};
use crate::blas::Lattice;
use crate::math::{at_least, sqrt};
use crate::receiver::{Effort, Lobe, ReceiverKind, SPREAD_OF_RADIUS2, for_lobe};
use crate::warp::Variate;
use crate::warp::triangle::{linear_pdf, square_to_linear_triangle, square_to_triangle};

/// Ratio of squared radius to squared distance up to which the density is linear.
///
/// Measured (docs/ACCURACY.md, "A linear density"). Larger: more triangles are sampled at a low cost, with more
/// variance.
const LINEAR_GEOMETRY: f32 = 1.0 / 8.0;

/// Least ratio of the weights of two corners.
///
/// Chosen, not swept. Larger: more triangles at the horizon, where the cosine varies, are divided into cells. Smaller:
/// points far from linear, and more steps of the map from the square.
const LEAST_CORNER_RATIO: f32 = 1.0 / 8.0;

/// A density that is linear over the area of a triangle.
pub(super) struct LinearDensity {
    /// Weights of the three corners, positive. `None` for the same at all points: with the least effort.
    corners: Option<[f64; 3]>,
}

impl LinearDensity {
    /// Returns the density of a triangle as seen; `None` where what it sends is too far from linear.
    #[inline]
    pub(super) fn new(view: &TriangleView<'_>) -> Option<Self> {
        let [a, b, c] = view.vertices;
        let center = (a + b + c) * (1.0 / 3.0);
        let distance2 = at_least(center.length_squared(), view.height * view.height);
        // NaN fails.
        if !(view.radius2 <= LINEAR_GEOMETRY * distance2 && view.has_constant_radiance(center, distance2)) {
            return None;
        }
        if view.effort == Effort::Least && !view.receiver.has_lobe() {
            let height = |vertex| view.receiver.weight_at_height(view.receiver_normal.dot(vertex), 1.0);
            return is_even(view.vertices.map(height)).then_some(Self { corners: None });
        }
        let corners = for_lobe!(view.receiver, lobe => corners(view, lobe, center, distance2))?;
        is_even(corners).then(|| Self { corners: Some(corners.map(f64::from)) })
    }

    /// Draws a point.
    #[inline]
    pub(super) fn sample(&self, view: &TriangleView<'_>, u: [Variate; 2]) -> Option<DrawnPoint> {
        let u = u.map(|u| u.value());
        let point = Lattice::inside(match self.corners {
            Some(corners) => square_to_linear_triangle(u, corners),
            None => square_to_triangle(u),
        });
        let (pdf, relative) = (self.pdf(view, point)?, view.position(point));
        Some(DrawnPoint { point: LocalPoint::on_triangle(point), relative, pdf })
    }

    /// Returns the density per solid angle of a point. `None` where it is not a positive number.
    #[inline]
    pub(super) fn pdf(&self, view: &TriangleView<'_>, point: Lattice) -> Option<f64> {
        let relative = self.corners.map_or(1.0, |corners| linear_pdf(point.to_barycentrics().map(f64::from), corners));
        let pdf_area = relative / f64::from(view.area);
        let pdf = pdf_area / view.solid_angle_per_area(view.position(point));
        (pdf > 0.0 && pdf.is_finite()).then_some(pdf)
    }
}

/// Whether the weights of the corners are close enough to each other.
#[inline(always)]
fn is_even([a, b, c]: [f32; 3]) -> bool {
    let (least, largest) = (a.min(b).min(c), a.max(b).max(c));
    least > 0.0 && largest < f32::INFINITY && least >= LEAST_CORNER_RATIO * largest
}

/// Weights of the corners, relative to each other; `None` where the lobe varies too much in between.
#[inline(always)]
fn corners(view: &TriangleView<'_>, lobe: impl Lobe, center: Vec3, distance2: f32) -> Option<[f32; 3]> {
    let spread2 = SPREAD_OF_RADIUS2 * view.radius2 / distance2;
    let direction = center * (1.0 / sqrt(distance2));
    lobe.is_about_constant(direction.to_array(), spread2).then(|| {
        view.vertices.map(|vertex| {
            let vertex2 = vertex.length_squared();
            let (ratio, distance) = (distance2 / vertex2, sqrt(vertex2));
            let toward = view.receiver.height_weights().at(view.receiver_normal.dot(vertex), distance);
            lobe.weigh(toward, vertex.to_array(), distance, spread2) * (ratio * ratio)
        })
    })
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;
    use std::println;

    use glam::{DVec3, Vec3};

    use super::*;
    use crate::blas::{LEAF, Root};
    use crate::light::{Illumination, LightTriangle};
    use crate::receiver::ShadingPoint;
    use crate::testing::Pcg32;

    /// Relative variance of points uniform by area and of those of the linear density, by a sum over cells, in double
    /// precision. `None` where the density is not linear.
    fn relative_variances(vertices: [Vec3; 3], normal: Vec3) -> Option<[f64; 2]> {
        const SIDE: usize = 24;
        let light = LightTriangle {
            vertices: vertices.map(|v| v.to_array()),
            root: Root { average: 1.0, node: LEAF },
            index_and_flags: LightTriangle::TWO_SIDED,
        };
        let x = ShadingPoint::surface(Vec3::ZERO, normal);
        let view = TriangleView::wrapped(&light, &x, Illumination::default(), &[], None, |v| v)?;
        let density = LinearDensity::new(&view)?;
        let [v0, v1, v2] = vertices.map(Vec3::as_dvec3);
        let normal = normal.as_dvec3();
        // Up to a factor.
        let sent = |y: DVec3| normal.dot(y).max(0.0) / (y.length_squared() * y.length_squared());
        let (mut sum, mut uniform, mut linear) = (0.0, 0.0, 0.0);
        for i in 0..SIDE * SIDE {
            // The center of a cell of the square that two triangles make.
            let [b1, b2] = [i % SIDE, i / SIDE].map(|k| (k as f64 + 0.5) / SIDE as f64);
            let [b1, b2] = if b1 + b2 > 1.0 { [1.0 - b1, 1.0 - b2] } else { [b1, b2] };
            let value = sent(v0 * (1.0 - b1 - b2) + v1 * b1 + v2 * b2);
            sum += value;
            uniform += value * value;
            linear += value * value / linear_pdf([b1, b2], density.corners.expect("full effort"));
        }
        let count = (SIDE * SIDE) as f64;
        Some([uniform, linear].map(|squares| count * squares / (sum * sum) - 1.0))
    }

    /// `cargo test --release --lib linear -- --nocapture` prints the table of docs/ACCURACY.md.
    #[test]
    fn linear_points_are_close_to_the_product() {
        let mut pcg = Pcg32::new(1, 81);
        println!("| radius over distance | uniform, mean | linear, mean | linear, largest |");
        for ratio in [0.125, 0.25, 0.35] {
            let (mut means, mut largest, mut count) = ([0.0; 2], 0.0_f64, 0);
            while count < 400 {
                let (first, second) = (pcg.direction(), pcg.direction());
                let second = second.reject_from_normalized(first).normalize() * (0.3 + 0.7 * pcg.next_f32());
                let corners = [Vec3::ZERO, first, second];
                let center = (corners[0] + corners[1] + corners[2]) / 3.0;
                let radius = corners.iter().map(|corner| (*corner - center).length()).fold(0.0, f32::max);
                let to = pcg.direction() * (radius / ratio);
                let Some(found) = relative_variances(corners.map(|v| v - center + to), pcg.direction()) else {
                    continue;
                };
                means.iter_mut().zip(found).for_each(|(mean, found)| *mean += found / 400.0);
                (largest, count) = (largest.max(found[1]), count + 1);
            }
            println!("| {ratio} | {:.4} | {:.5} | {largest:.3} |", means[0], means[1]);
            assert!(means[1] < 0.01 && largest < 0.1, "{ratio}: {means:?}, {largest}");
            assert!(means[1] < 0.1 * means[0], "{ratio}: {means:?}");
        }
    }

    /// A point of a lattice that `sample` returns has the density that `pdf` returns.
    #[test]
    fn samples_have_their_density() {
        let mut pcg = Pcg32::new(2, 81);
        let corners = [Vec3::new(0.0, 0.0, 4.0), Vec3::new(1.0, 0.2, 4.0), Vec3::new(0.1, 1.0, 4.3)];
        let light = LightTriangle {
            vertices: corners.map(|v| v.to_array()),
            root: Root { average: 1.0, node: LEAF },
            index_and_flags: LightTriangle::TWO_SIDED,
        };
        let receivers = [ShadingPoint::surface(Vec3::ZERO, Vec3::new(0.6, 0.0, 0.8)), ShadingPoint::volume(Vec3::ZERO)];
        for x in receivers {
            let view =
                TriangleView::wrapped(&light, &x, Illumination::default(), &[], None, |v| v).expect("it is above");
            let density = LinearDensity::new(&view).expect("it is far away");
            let drawn: Vec<DrawnPoint> = (0..1000)
                .map(|i| [Variate::new(pcg.next_f32(), i), Variate::new(pcg.next_f32(), i + 1)])
                .map(|u| density.sample(&view, u).expect("all of it is above the horizon"))
                .collect();
            assert!(drawn.iter().all(|drawn| density.pdf(&view, drawn.point.lattice()) == Some(drawn.pdf)));
            // The mean of 1 / pdf is the solid angle, here by Van Oosterom and Strackee 1983.
            let [a, b, c] = corners.map(|v| v.as_dvec3().normalize());
            let solid_angle = 2.0 * (a.dot(b.cross(c)) / (1.0 + a.dot(b) + b.dot(c) + c.dot(a))).abs().atan();
            let mean = drawn.iter().map(|drawn| 1.0 / drawn.pdf).sum::<f64>() / drawn.len() as f64;
            assert!((mean / solid_angle - 1.0).abs() < 0.02, "{mean} instead of {solid_angle}");
        }
    }
}
