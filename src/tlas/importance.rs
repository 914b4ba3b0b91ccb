//! How likely each child of a node is to be chosen from a shading point: what it sends there by its first and second
//! moments, and exactly zero where its bounds prove that nothing can arrive.
//!
//! The moments replace the conservative geometric term of Conty Estevez and Kulla (2018), which is kept as the proof.
//! A cluster's position and normal are taken for normal variables with its mean and variance; cosines become the
//! expectation of a clamped normal variable.

use glam::Vec3;

use super::node::{Child, Node};
use crate::math;
use crate::record::{Receiver, ShadingPoint};
use crate::warp::keep_possible;

/// What the tree asks of the level above.
pub(crate) trait Scene {
    /// Mean radiance, relative to the mean over all directions, of what a portal shows in the directions from the
    /// shading point to a ball with this centre (relative to the shading point) and radius. Zero only if all of
    /// it is black.
    fn radiance(&self, center: Vec3, radius: f32) -> f32;

    /// Whether anything at all can travel from a leaf to the shading point. Asked only where the bounds of a leaf leave
    /// that open.
    fn is_visible(&self, leaf: u32) -> bool;
}

/// Least expected cosine of a cluster that is not culled.
const LEAST_COSINE: f32 = 1e-3;
/// Relative error granted to the dot products that decide on culling.
const ROUNDING: f32 = 1e-5;

// How much of a variance counts, found by experiment: docs/ACCURACY.md.

/// Of the normals' variance, along the line of sight.
const NORMAL_SHARE: f32 = 0.4;
/// Of the positions' variance, for the cosine at the lights.
const EMITTER_SHARE: f32 = 1.0 / 3.0;
/// Of the positions' variance, for the cosine at the receiver.
const RECEIVER_SHARE: f32 = 0.8;
/// Of the positions' variance, for the squared distance.
const DISTANCE_SHARE: f32 = 0.3;

/// Weights of a node's children before the level above was asked anything.
struct Terms<const N: usize> {
    /// Zero where nothing can arrive.
    geometry: [f32; N],
    /// Where the bounds do not decide whether a single triangle is visible.
    doubtful: [bool; N],
}

impl<const N: usize> Node<N> {
    /// Weight of every child. All zero where nothing below the node can be visible.
    #[inline]
    pub(super) fn weights(&self, x: &ShadingPoint, scene: &impl Scene) -> [f32; N] {
        let terms = self.terms(x);
        let [flux, portal] = self.energies();
        let mut weights = [0.0; N];
        for lane in 0..N {
            weights[lane] = flux[lane] * terms.geometry[lane];
        }
        let mut possible = [false; N];
        for lane in 0..N {
            possible[lane] = terms.geometry[lane] > 0.0 && flux[lane] + portal[lane] > 0.0;
        }
        for lane in 0..N {
            if terms.doubtful[lane]
                && possible[lane]
                && let Child::Leaf(leaf) = self.child(lane)
            {
                possible[lane] = scene.is_visible(leaf);
            }
            if portal[lane] > 0.0 && possible[lane] {
                let aabb = self.aabb(lane);
                let radiance = scene.radiance(aabb.center() - x.position, 0.5 * aabb.extent().length());
                weights[lane] += portal[lane] * radiance * terms.geometry[lane];
                possible[lane] = radiance > 0.0 || flux[lane] > 0.0;
            }
        }
        keep_possible(&mut weights, |lane| possible[lane]);
        weights
    }

    /// The geometric terms of all lanes, in plain loops over arrays that a compiler can turn into vectors.
    #[inline(always)]
    fn terms(&self, x: &ShadingPoint) -> Terms<N> {
        let (normal, folded, ignored) = match x.receiver {
            Receiver::Surface(normal) => (normal, false, false),
            Receiver::Transmissive(normal) => (normal, true, false),
            Receiver::Volume => (Vec3::ZERO, false, true),
        };
        let (occupied, two_sided) = (self.occupied(), self.two_sided());
        let ([low, high], (axis, cos_o, sin_o), (mean, variance, mean_normal)) =
            (self.boxes(), self.cones(), self.moments());
        let mut geometry = [0.0; N];
        let mut doubtful = [false; N];
        for i in 0..N {
            // Relative to the shading point before halving: far from the origin the difference is what is exact.
            let from = Vec3::new(low[0][i], low[1][i], low[2][i]) - x.position;
            let to = Vec3::new(high[0][i], high[1][i], high[2][i]) - x.position;
            let (center, half) = (0.5 * (from + to), 0.5 * (to - from));

            // The horizon, by the most and the least favourable corner of the box.
            let (height, reach) = (normal.dot(center), normal.abs().dot(half));
            let slack = ROUNDING * (normal.abs().dot(center.abs()) + reach);
            let below = height + reach < -slack;
            let above = height - reach > slack;

            // The emitters' side: cos θ' of θ' = max(0, θ - θo - θu), with the ball around the box for θu.
            let (radius2, distance2) = (half.length_squared(), center.length_squared().max(f32::MIN_POSITIVE));
            let inside = !(distance2 > radius2);
            let sin2_u = (radius2 / distance2).min(1.0);
            let (cos_u, sin_u) = (math::sqrt(1.0 - sin2_u), math::sqrt(sin2_u));
            let signed =
                -(axis[0][i] * center.x + axis[1][i] * center.y + axis[2][i] * center.z) / math::sqrt(distance2);
            let cos = if two_sided[i] { signed.abs() } else { signed };
            let sin = math::sqrt((1.0 - cos * cos).max(0.0));
            let (cos_less, sin_less) = (cos * cos_o[i] + sin * sin_o[i], sin * cos_o[i] - cos * sin_o[i]);
            let away = cos < cos_o[i] && cos_less < cos_u && cos_less * cos_u + sin_less * sin_u < -ROUNDING && !inside;

            // What arrives, by the moments.
            let to_mean = Vec3::new(mean[0][i], mean[1][i], mean[2][i]) - x.position;
            let squared = (to_mean.length_squared() + DISTANCE_SHARE * variance[i]).max(f32::MIN_POSITIVE);
            let inverse = 1.0 / math::sqrt(squared);
            let relative = variance[i] * inverse * inverse;
            let cos_s = normal.dot(to_mean) * inverse;
            let receiver = clamped_mean(if folded { cos_s.abs() } else { cos_s }, RECEIVER_SHARE * relative);
            let n = Vec3::new(mean_normal[0][i], mean_normal[1][i], mean_normal[2][i]);
            let facing = -n.dot(to_mean) * inverse;
            let spread = NORMAL_SHARE * (1.0 - n.length_squared()).max(0.0) + EMITTER_SHARE * relative;
            let emitter = clamped_mean(if two_sided[i] { facing.abs() } else { facing }, spread);
            let term = (if ignored { 1.0 } else { receiver.max(LEAST_COSINE) })
                * emitter.max(LEAST_COSINE)
                * inverse
                * inverse;

            let culled = !occupied[i] || away || (below && !folded && !ignored);
            // Positive whatever underflows: only what is culled is impossible.
            geometry[i] = if culled { 0.0 } else { term.max(f32::MIN_POSITIVE) };
            doubtful[i] = facing.abs() < ROUNDING * 10.0 || facing < 0.0 || !(above || folded || ignored);
        }
        Terms { geometry, doubtful }
    }
}

/// Expectation of `max(0, X)` for a normal variable of this mean and variance, within 4 % of the standard deviation:
/// exact at a mean of zero and far from it.
#[inline(always)]
fn clamped_mean(mean: f32, variance: f32) -> f32 {
    0.5 * (mean + math::sqrt(mean * mean + core::f32::consts::FRAC_2_PI * variance))
}
