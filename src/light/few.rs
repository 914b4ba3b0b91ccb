//! A few triangles without textures, seen from a surface: the choice of a light and the density of its points from one
//! pass over all vertices, without a tree.
//!
//! Where triangles are small for their distance, what their points send to the receiver is almost a linear function of
//! their barycentrics, given by the three corners: `w = cos θs / d³` up to what all points of a triangle share
//! ([`linear_density`](super::linear_density) has the same for one triangle). So with radiance `L`, corners `w_k`,
//! double area `2A` and height `h` over the plane,
//!
//! ```text
//! weight of a triangle = L · 2A h · (w_0 + w_1 + w_2)
//! density of a point   = 6 L · (b_0 w_0 + b_1 w_1 + b_2 w_2) · d³ / sum of all weights
//! ```
//!
//! per solid angle: area and height cancel. A point is drawn uniformly, and its barycentrics are turned in a circle by
//! one of three turns, each as likely as what it makes of the weight of the point. The three chances of a point add up
//! to the weights of all corners, so that turned points have exactly the linear density, and no root is taken.
//!
//! The pass decides by the shading point alone whether this is good enough, so that samples and densities agree. Where
//! it is not, the tree is asked.

use glam::DVec3;

use super::triangle_view::FARTHEST_POINT;
use super::{Illumination, LightTriangle, LightsView};
use crate::blas::Lattice;
use crate::math::{at_least, at_most, limit, sqrt64};
use crate::receiver::{Receiver, ReceiverKind, ShadingPoint};
use crate::record::{Hit, LightSample, SampledLight};
use crate::simd::{InstructionSet, Kernel};
use crate::warp::seed;
use crate::warp::triangle::square_to_triangle;
use crate::warp::variate::ALMOST_ONE_F32;

/// Most triangles that are sampled without a tree: lanes of the larger pass. *Chosen*: four lamps of two triangles.
///
/// Larger: passes that take as long as a walk through the tree. Smaller: scenes of few lamps go through the tree.
pub(crate) const MOST_FEW: usize = 8;

/// Lanes of the pass where they suffice. *Chosen*: a lamp of two triangles.
const LEAST_LANES: usize = 2;

/// Ratio of the mean squared distance of the corners from the centroid to the squared distance of the centroid, up to
/// which the density is linear. *Chosen* so that the Cornell box is below it, where its noise was measured
/// (docs/ACCURACY.md, "A few triangles"); no other value was tried.
///
/// Larger: more noise next to lights. Smaller: more points at which the tree is asked as well.
const LINEAR_SPREAD: f64 = 0.3;

/// Least ratio of the weights of two corners of a triangle. *Chosen* with [`LINEAR_SPREAD`].
///
/// Larger: the tree is asked about more triangles at the horizon. Smaller: points far from linear.
const LEAST_FEW_CORNER_RATIO: f64 = 1.0 / 16.0;

/// A few triangles with the surface that they shine on.
#[derive(Clone, Copy)]
pub(crate) struct FewTriangles<'a> {
    lights: &'a LightsView<'a>,
    x: &'a ShadingPoint,
}

/// What the pass finds out, by lanes: one for each triangle.
struct Faces<const LANES: usize> {
    /// Weights of the corners, relative to each other.
    corners: [[f64; LANES]; 3],
    /// Normals of the front times twice the area, by coordinate.
    normals: [[f64; LANES]; 3],
    radiances: [f64; LANES],
    /// Radiance times twice the area times the distance from the plane.
    strengths: [f64; LANES],
    /// Sum of the weights of all points. Zero where nothing arrives.
    weights: [f64; LANES],
}

impl<'a> FewTriangles<'a> {
    /// Returns the triangles of a scene with a surface; `None` where the scene has other lights, or too many, or the
    /// point is no surface without a lobe.
    #[inline(always)]
    pub(crate) fn new(lights: &'a LightsView<'a>, x: &'a ShadingPoint) -> Option<Self> {
        let is_surface = matches!(x.receiver, Receiver::Surface(_));
        let [px, py, pz] = x.position.to_array().map(f32::abs);
        let is_other = !is_surface
            | (lights.len() > MOST_FEW)
            | lights.has_portals
            | lights.has_lamps
            | !lights.cells.is_empty()
            | lights.is_edited
            | !(lights.extras.is_empty() & lights.instances.is_empty())
            | (x.groups == 0)
            | !((px <= FARTHEST_POINT) & (py <= FARTHEST_POINT) & (pz <= FARTHEST_POINT))
            | (lights.illumination != Illumination::ClampedVertices);
        if is_other { None } else { Some(Self { lights, x }) }
    }

    /// Draws a point; `Some(None)` where nothing arrives. `None` where the tree has to be asked.
    #[inline]
    pub(crate) fn sample(&self, u: [f32; 3]) -> Option<Option<LightSample>> {
        if self.lights.len() <= LEAST_LANES {
            InstructionSet::best().run(SampleFew::<LEAST_LANES> { few: self, u })
        } else {
            InstructionSet::best().run(SampleFew::<MOST_FEW> { few: self, u })
        }
    }

    /// Returns the probability of a leaf, and the density per solid angle of a point of it. `None` where the tree has
    /// to be asked.
    #[inline]
    pub(crate) fn density(&self, leaf: u32, point: Lattice) -> Option<[f64; 2]> {
        if self.lights.len() <= LEAST_LANES {
            InstructionSet::best().run(DensityOfFew::<LEAST_LANES> { few: self, leaf, point })
        } else {
            InstructionSet::best().run(DensityOfFew::<MOST_FEW> { few: self, leaf, point })
        }
    }

    /// Weighs all triangles; `None` where the tree has to be asked.
    #[inline(always)]
    fn weigh<const LANES: usize>(&self) -> Option<Faces<LANES>> {
        let records = self.lights.records;
        let first = records.first()?;
        let [mut ax, mut ay, mut az] = [[0.0_f32; LANES]; 3];
        let [mut bx, mut by, mut bz] = [[0.0_f32; LANES]; 3];
        let [mut cx, mut cy, mut cz] = [[0.0_f32; LANES]; 3];
        let (mut weights_of_records, mut flags) = ([0.0_f32; LANES], [0_u32; LANES]);
        for i in 0..LANES {
            // Lanes beyond the last triangle repeat the first one, with no radiance.
            let (record, share) = records.get(i).map_or((first, 0.0), |record| (record, 1.0));
            let [a, b, c] = &record.vertices;
            ([ax[i], ay[i], az[i]], [bx[i], by[i], bz[i]], [cx[i], cy[i], cz[i]]) = (*a, *b, *c);
            (weights_of_records[i], flags[i]) = (share * record.root.average, record.index_and_flags);
        }
        if !self.lights.scales.is_empty() {
            self.scale(&mut weights_of_records);
        }
        let (origin, normal) = (self.x.position.as_dvec3(), self.x.receiver.normal().as_dvec3());
        let [mut w0, mut w1, mut w2] = [[0.0; LANES]; 3];
        let [mut nx, mut ny, mut nz] = [[0.0; LANES]; 3];
        let [mut radiances, mut strengths, mut weights] = [[0.0; LANES]; 3];
        let mut doubts = [0_u64; LANES];
        for i in 0..LANES {
            let a = DVec3::new(ax[i].into(), ay[i].into(), az[i].into());
            let b = DVec3::new(bx[i].into(), by[i].into(), bz[i].into());
            let c = DVec3::new(cx[i].into(), cy[i].into(), cz[i].into());
            let front = (b - a).cross(c - a);
            let (a, b, c) = (a - origin, b - origin, c - origin);
            let (a2, b2, c2) = (a.length_squared(), b.length_squared(), c.length_squared());
            let side = front.dot(a);
            let (wa, wb, wc) = (normal.dot(a) / (a2 * a2), normal.dot(b) / (b2 * b2), normal.dot(c) / (c2 * c2));
            // Three times the centroid. Corners have its mean square and that of the spread around it.
            let center2 = (a + b + c).length_squared();
            let is_small = a2 + b2 + c2 <= (1.0 + LINEAR_SPREAD) * (1.0 / 3.0) * center2;
            let (least, largest) = (smaller(smaller(wa, wb), wc), larger(larger(wa, wb), wc));
            let is_even = is_small & (least > LEAST_FEW_CORNER_RATIO * largest);
            // Positive where the point is on a side that emits.
            let two_sided = u64::from(flags[i] & LightTriangle::TWO_SIDED) << 32;
            let height = f64::from_bits((side.to_bits() ^ 1 << 63) & !two_sided);
            let radiance = f64::from(weights_of_records[i]);
            let emits = (height > 0.0) & (radiance > 0.0);
            let strength = radiance * height;
            weights[i] = if emits & is_even { strength * (wa + wb + wc) } else { 0.0 };
            doubts[i] = u64::from(emits & !is_even);
            (w0[i], w1[i], w2[i]) = (wa, wb, wc);
            (nx[i], ny[i], nz[i]) = (front.x, front.y, front.z);
            (radiances[i], strengths[i]) = (radiance, strength);
        }
        if doubts != [0; LANES] && !self.are_dark(&doubts) {
            return None;
        }
        Some(Faces { corners: [w0, w1, w2], normals: [nx, ny, nz], radiances, strengths, weights })
    }

    /// Multiplies the weights by what those of the meshes have been multiplied by since the build.
    #[cold]
    fn scale(&self, weights: &mut [f32]) {
        for (leaf, weight) in weights.iter_mut().enumerate().take(self.lights.len()) {
            *weight *= self.lights.light(leaf as u32).scale(self.lights.scales, self.lights.meshes);
        }
    }

    /// Whether all triangles that are in doubt are below the horizon for certain.
    #[cold]
    fn are_dark(&self, doubts: &[u64]) -> bool {
        let mut doubtful = self.lights.records.iter().zip(doubts).filter(|(_, doubt)| **doubt != 0);
        doubtful.all(|(record, _)| self.x.receiver.is_dark(&record.triangle().relative_to(self.x.position)))
    }
}

/// Draws a point.
struct SampleFew<'f, const LANES: usize> {
    few: &'f FewTriangles<'f>,
    u: [f32; 3],
}

impl<const LANES: usize> Kernel for SampleFew<'_, LANES> {
    type Output = Option<Option<LightSample>>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { few, u: [choice, u, v] } = self;
        let faces: Faces<LANES> = few.weigh()?;
        let mut ends = [0.0; LANES];
        let mut total = 0.0;
        for (end, weight) in ends.iter_mut().zip(&faces.weights) {
            total += weight;
            *end = total;
        }
        // NaN fails.
        if !(total > 0.0 && total < f64::INFINITY) {
            return Some(None);
        }
        // What a choice needs below 2⁻²⁴ is a hash of the other numbers.
        let low = (seed(&[u, v]) >> 11) as f64;
        let target = (f64::from(limit(choice, ALMOST_ONE_F32)) + low * LOW_STEP) * total;
        let (mut lane, mut start) = (0, 0.0);
        for end in ends {
            // Never past the last positive weight.
            let is_past = (target >= end) & (end < total);
            lane += usize::from(is_past);
            start = if is_past { end } else { start };
        }
        let lane = lane % LANES;
        let (face, record) = (faces.face(lane), few.lights.records.get(lane)?);
        // Numbers outside of the unit interval, and NaN, end at the rim.
        let point = Lattice::inside(square_to_triangle([u.into(), v.into()]));
        let point = face.turned(point, target - start);
        let (triangle, origin) = (record.triangle(), few.x.position.as_dvec3());
        let [a, b, c] = triangle.0.map(|vertex| vertex.as_dvec3() - origin);
        let [b0, b1, b2] = shares(point);
        let relative = a * b0 + b * b1 + c * b2;
        let distance2 = relative.length_squared();
        let distance = sqrt64(distance2);
        let inverse_length = 1.0 / sqrt64(face.normal.length_squared());
        let inverse_total = 1.0 / total;
        let per_strength = 6.0 * face.mean([b0, b1, b2]) * inverse_total;
        let pdf = per_strength * face.radiance * (distance2 * distance);
        let is_positive = pdf > 0.0 && pdf < f64::INFINITY;
        if !is_positive {
            return Some(None);
        }
        Some(Some(LightSample {
            light: SampledLight::Triangle(Hit::new(few.lights.id(record), point.to_barycentrics())),
            position: (origin + relative).as_vec3(),
            normal: (face.normal * inverse_length).as_vec3(),
            direction: (relative * (1.0 / distance)).as_vec3(),
            distance: distance as f32,
            pdf: positive(pdf),
            pdf_area: positive(per_strength * face.strength * inverse_length),
            pmf: positive(faces.weights[lane] * inverse_total),
        }))
    }
}

/// Finds the density of a point.
struct DensityOfFew<'f, const LANES: usize> {
    few: &'f FewTriangles<'f>,
    leaf: u32,
    point: Lattice,
}

impl<const LANES: usize> Kernel for DensityOfFew<'_, LANES> {
    type Output = Option<[f64; 2]>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { few, leaf, point } = self;
        let faces: Faces<LANES> = few.weigh()?;
        let mut total = 0.0;
        for weight in faces.weights {
            total += weight;
        }
        let lane = leaf as usize % LANES;
        if !(faces.weights[lane] > 0.0 && total < f64::INFINITY) {
            return Some([0.0; 2]);
        }
        let (face, record) = (faces.face(lane), few.lights.records.get(lane)?);
        let [a, b, c] = record.triangle().exactly_relative_to(few.x.position);
        let [b0, b1, b2] = shares(point);
        let distance2 = (a * b0 + b * b1 + c * b2).length_squared();
        let inverse_total = 1.0 / total;
        let per_strength = 6.0 * face.mean([b0, b1, b2]) * inverse_total;
        let pdf = per_strength * face.radiance * (distance2 * sqrt64(distance2));
        Some([faces.weights[lane] * inverse_total, if pdf < f64::INFINITY { pdf } else { 0.0 }])
    }
}

/// One lane of the pass.
struct Face {
    corners: [f64; 3],
    /// Normal of the front times twice the area.
    normal: DVec3,
    radiance: f64,
    strength: f64,
}

impl<const LANES: usize> Faces<LANES> {
    #[inline(always)]
    fn face(&self, lane: usize) -> Face {
        let [x, y, z] = &self.normals;
        Face {
            corners: [self.corners[0][lane], self.corners[1][lane], self.corners[2][lane]],
            normal: DVec3::new(x[lane], y[lane], z[lane]),
            radiance: self.radiances[lane],
            strength: self.strengths[lane],
        }
    }
}

impl Face {
    /// Weight of a point.
    #[inline(always)]
    fn mean(&self, [b0, b1, b2]: [f64; 3]) -> f64 {
        let [w0, w1, w2] = self.corners;
        b0 * w0 + b1 * w1 + b2 * w2
    }

    /// Turns a uniform point. `offset` is uniform below the weight of the triangle.
    #[inline(always)]
    fn turned(&self, point: Lattice, offset: f64) -> Lattice {
        let Lattice([i0, i1, i2]) = point;
        let [b0, b1, b2] = shares(point);
        let first = self.strength * self.mean([b0, b1, b2]);
        let second = first + self.strength * self.mean([b1, b2, b0]);
        let pick = |first_choice: u32, second_choice: u32, third_choice: u32| {
            if offset < first {
                first_choice
            } else if offset < second {
                second_choice
            } else {
                third_choice
            }
        };
        Lattice([pick(i0, i1, i2), pick(i1, i2, i0), pick(i2, i0, i1)])
    }
}

/// Spacing of what is added to a number below 2⁻²⁴. *Format*: 53 bits.
const LOW_STEP: f64 = 1.0 / (16_777_216.0 * 9_007_199_254_740_992.0);

/// Returns the barycentrics of a point, which add up to 1.
#[inline(always)]
fn shares(point: Lattice) -> [f64; 3] {
    let [b1, b2] = point.to_barycentrics().map(f64::from);
    [1.0 - b1 - b2, b1, b2]
}

/// Returns a positive density in single precision.
#[inline(always)]
fn positive(pdf: f64) -> f32 {
    at_most(at_least(pdf as f32, f32::MIN_POSITIVE), f32::MAX)
}

/// The smaller of both: a single instruction, unlike `f64::min`.
#[inline(always)]
fn smaller(x: f64, y: f64) -> f64 {
    if x < y { x } else { y }
}

/// The larger of both.
#[inline(always)]
fn larger(x: f64, y: f64) -> f64 {
    if x > y { x } else { y }
}
