//! Bright features through an opening with three straight edges: how much of them is visible, and directions into the
//! visible part.

use glam::{DVec3, Vec3};

use super::texel_cut::TexelCut;
use crate::env::{EnvironmentView, FeatureNode, FeatureTexel};
use crate::warp::Variate;

/// The directions between three planes through the viewer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Opening {
    /// Unit normals that point inwards, in the environment's frame. Zero for an edge that passes through the viewer.
    pub(super) planes: [Vec3; 3],
}

/// How much of a region of directions is visible.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Coverage {
    /// Nothing of the region.
    Nothing,
    /// Perhaps a part of the region.
    Part,
    /// All of the region.
    All,
}

/// A piece of what is visible: all below a node, or a block of texels.
#[derive(Clone, Copy, Debug)]
enum Piece<'a> {
    Node(usize),
    Texel(&'a FeatureTexel, TexelCut),
}

impl Opening {
    /// The directions in which a triangle is visible whose vertices are given relative to the viewer.
    pub(super) fn new(environment: &EnvironmentView<'_>, [a, b, c]: [DVec3; 3]) -> Self {
        let planes = [b.cross(c), c.cross(a), a.cross(b)];
        let sign = 1f64.copysign(planes[0].dot(a));
        let inwards = |plane: DVec3| (sign * plane).normalize_or_zero().as_vec3();
        Self { planes: planes.map(|plane| environment.local_direction(inwards(plane))) }
    }

    /// Bounds how much of a node the opening shows, by the cone around the node.
    #[inline]
    pub(super) fn coverage(&self, node: &FeatureNode) -> Coverage {
        let (axis, reach) = (Vec3::from_array(node.axis), node.reach());
        let [a, b, c] = self.planes.map(|plane| plane.dot(axis));
        let least = a.min(b).min(c);
        if least < -reach && reach < 1.0 {
            Coverage::Nothing
        } else if least >= reach {
            Coverage::All
        } else {
            Coverage::Part
        }
    }

    /// Whether any of a block of texels may be visible.
    #[inline]
    pub(super) fn meets(&self, texel: &FeatureTexel) -> bool {
        self.planes.iter().all(|plane| plane.dot(Vec3::from_array(texel.center)) >= -texel.radius)
    }

    /// Visits what the opening shows below a node, each piece with the excess over the cap integrated over its visible
    /// directions, until `visit` returns true.
    #[inline]
    fn visit<'a>(&self, environment: &EnvironmentView<'a>, node: usize, mut visit: impl FnMut(Piece<'a>, f32) -> bool) {
        let nodes = environment.feature_nodes();
        let end = nodes[node].next as usize;
        let mut at = node;
        while at < end {
            let found = &nodes[at];
            match self.coverage(found) {
                Coverage::Nothing => at = found.next as usize,
                Coverage::All => {
                    if visit(Piece::Node(at), found.power) {
                        return;
                    }
                    at = found.next as usize;
                }
                Coverage::Part => {
                    if environment.is_feature_leaf(at) {
                        for texel in environment.feature_texels(at) {
                            let cut = TexelCut::new(texel, &self.planes);
                            if visit(Piece::Texel(texel, cut), texel.power() * cut.share()) {
                                return;
                            }
                        }
                    }
                    at += 1;
                }
            }
        }
    }

    /// Returns the excess over the cap below a node, integrated over the directions of the opening.
    pub(super) fn power(&self, environment: &EnvironmentView<'_>, node: usize) -> f32 {
        let mut sum = 0.0;
        self.visit(environment, node, |_, power| {
            sum += power;
            false
        });
        sum
    }

    /// Draws a world direction in the visible part of a node, with a density in proportion to the excess over the cap.
    /// `power` is [`Self::power`] of the same node, above zero.
    ///
    /// The direction may miss the opening by as much as a block's margin.
    pub(super) fn sample(
        &self,
        environment: &EnvironmentView<'_>,
        node: usize,
        power: f32,
        mut u: [Variate; 2],
    ) -> Vec3 {
        let target = u[1].value() * f64::from(power);
        let (mut chosen, mut low, mut width, mut below) = (None, 0.0, 1.0, 0.0);
        self.visit(environment, node, |piece, power| {
            if power > 0.0 {
                (chosen, low, width) = (Some(piece), below, f64::from(power));
                below += width;
            }
            target < below
        });
        u[1].stretch(target - low, width, f64::from(power));
        match chosen {
            Some(Piece::Node(node)) => environment.sample_feature(node, u),
            Some(Piece::Texel(texel, TexelCut::Part(polygon, _))) => {
                environment.direction_in_texel(texel, polygon.sample(u))
            }
            Some(Piece::Texel(texel, _)) => environment.direction_in_texel(texel, u.map(|u| u.value_f32() - 0.5)),
            None => environment.sample_feature(node, u),
        }
    }
}
