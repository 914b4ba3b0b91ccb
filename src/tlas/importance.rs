//! How likely each child of a node is to be chosen from a shading point: its energy times a conservative geometric
//! term (Conty Estevez and Kulla 2018, section 5.1), and exactly zero where nothing can arrive from it.

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

    /// Whether anything at all can travel from a leaf to the shading point.
    fn is_visible(&self, leaf: u32) -> bool;
}

/// Least geometric term of a cluster that is not culled: it may be visible although its bounds, which are rounded,
/// say that it barely is not.
const LEAST_TERM: f32 = 1e-4;
/// Relative error granted to the dot products that decide on culling.
const ROUNDING: f32 = 1e-5;
impl<const N: usize> Node<N> {
    /// Weight of every child. All zero where nothing below the node can be visible.
    pub(super) fn weights(&self, x: &ShadingPoint, scene: &impl Scene) -> [f32; N] {
        let mut weights = core::array::from_fn(|lane| self.weight(lane, x, scene));
        let culled = weights.map(|weight| weight == 0.0);
        keep_possible(&mut weights, |lane| !culled[lane]);
        weights
    }

    #[inline(always)]
    pub(super) fn weight(&self, lane: usize, x: &ShadingPoint, scene: &impl Scene) -> f32 {
        let child = self.child(lane);
        if child == Child::Empty {
            return 0.0;
        }
        let cluster = Cluster::new(self, lane, x.position);
        let geometry = cluster.receiver_term(&x.receiver) * cluster.emitter_term(self, lane);
        if geometry <= 0.0 {
            return 0.0;
        }
        if let Child::Leaf(leaf) = child
            && !scene.is_visible(leaf)
        {
            return 0.0;
        }
        let portal = match self.portal(lane) {
            0.0 => 0.0,
            portal => portal * scene.radiance(cluster.center, math::sqrt(cluster.radius2)),
        };
        let energy = self.flux(lane) + portal;
        if energy <= 0.0 {
            return 0.0;
        }
        // Within half the radius the distance to the centre says nothing.
        let distance2 = cluster.distance2.max(0.25 * cluster.radius2).max(f32::MIN_POSITIVE);
        // Positive whatever underflows: only what is culled above is impossible.
        (energy * geometry / distance2).max(f32::MIN_POSITIVE)
    }
}

/// The box of one child as a ball, seen from the shading point.
struct Cluster {
    /// Centre relative to the shading point.
    center: Vec3,
    half_extent: Vec3,
    radius2: f32,
    distance2: f32,
    inverse_distance: f32,
    /// Angle that the ball fills.
    cos_u: f32,
    sin_u: f32,
}

impl Cluster {
    #[inline(always)]
    fn new<const N: usize>(node: &Node<N>, lane: usize, position: Vec3) -> Self {
        // Relative to the shading point before halving: far from the origin the difference is what is exact.
        let (min, max) = (node.min(lane) - position, node.max(lane) - position);
        let center = 0.5 * (min + max);
        let half_extent = 0.5 * (max - min);
        let (radius2, distance2) = (half_extent.length_squared(), center.length_squared());
        let sin2_u = if distance2 > radius2 { radius2 / distance2 } else { 1.0 };
        Self {
            center,
            half_extent,
            radius2,
            distance2,
            inverse_distance: 1.0 / math::sqrt(distance2.max(f32::MIN_POSITIVE)),
            cos_u: math::sqrt(1.0 - sin2_u),
            sin_u: math::sqrt(sin2_u),
        }
    }

    #[inline(always)]
    fn surrounds_point(&self) -> bool {
        self.distance2 <= self.radius2
    }

    /// Cosine at the receiver, in favour of the cluster: cos of max(0, θi - θu).
    #[inline(always)]
    fn receiver_term(&self, receiver: &Receiver) -> f32 {
        let (normal, cos_i) = match *receiver {
            Receiver::Volume => return 1.0,
            Receiver::Surface(normal) => (normal, normal.dot(self.center) * self.inverse_distance),
            Receiver::Transmissive(normal) => (normal, (normal.dot(self.center) * self.inverse_distance).abs()),
        };
        if matches!(receiver, Receiver::Surface(_)) && self.is_below(normal) {
            return 0.0;
        }
        if self.surrounds_point() {
            return 1.0;
        }
        self.less_ball(cos_i, math::sqrt((1.0 - cos_i * cos_i).max(0.0))).max(LEAST_TERM)
    }

    /// Whether the whole box lies below the horizon of a normal, by its most favourable corner.
    #[inline(always)]
    fn is_below(&self, normal: Vec3) -> bool {
        let reach = normal.abs().dot(self.half_extent);
        let scale = normal.abs().dot(self.center.abs()) + reach;
        normal.dot(self.center) + reach < -ROUNDING * scale
    }

    /// Cosine at the lights, in favour of the cluster: cos of θ' = max(0, θ - θo - θu), and zero for θ' ≥ θe = π/2.
    #[inline(always)]
    fn emitter_term<const N: usize>(&self, node: &Node<N>, lane: usize) -> f32 {
        if self.surrounds_point() {
            return 1.0;
        }
        let mut cos = -node.axis(lane).dot(self.center) * self.inverse_distance;
        if node.two_sided(lane) {
            cos = cos.abs();
        }
        let (cos_o, sin_o) = node.cone(lane);
        if cos >= cos_o {
            return 1.0;
        }
        let sin = math::sqrt((1.0 - cos * cos).max(0.0));
        let term = self.less_ball(cos * cos_o + sin * sin_o, sin * cos_o - cos * sin_o);
        if term <= -ROUNDING { 0.0 } else { term.max(LEAST_TERM) }
    }

    /// Cosine of an angle less the one that the ball fills, at most 1.
    #[inline(always)]
    fn less_ball(&self, cos: f32, sin: f32) -> f32 {
        if cos >= self.cos_u { 1.0 } else { cos * self.cos_u + sin * self.sin_u }
    }
}
