//! Leaves for light on its way out, with no receiver to weigh it for: by their energy alone, or by what they let
//! through of a parallel beam.

use glam::Vec3;

use super::importance::{NORMAL_VARIANCE_SHARE, clamped_mean};
use crate::receiver::LEAST_CLUSTER_COSINE;
use crate::tlas::node::{Child, Node};
use crate::tlas::tree::WideTree;
use crate::warp::{Variate, keep_possible, pick, pmf, sum};

/// Which light leaves.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Outgoing {
    /// All that does not depend on the direction it is seen from, in all directions.
    Diffuse,
    /// What comes through portals in a narrow cone of directions.
    Beam(Beam),
}

/// A narrow cone of directions in which light travels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beam {
    /// Unit vector along its axis.
    pub(crate) direction: Vec3,
    /// Sine and cosine of its half angle.
    pub(crate) spread: [f32; 2],
    /// Whether portals are distinguished from emitters: where the environment is an image.
    pub(crate) portals_apart: bool,
}

impl Beam {
    /// Returns the area of a cluster perpendicular to the beam, relative to its area: zero only if all of it is seen
    /// from behind.
    #[inline]
    pub(crate) fn projection(&self, axis: Vec3, [sin, cos]: [f32; 2], normal: Vec3, two_sided: bool) -> f32 {
        let [sin_r, cos_r] = self.spread;
        // Behind, if the angle to the axis is above 90° + θo + r.
        let (sin_reach, cos_reach) = (sin * cos_r + cos * sin_r, cos * cos_r - sin * sin_r);
        if !two_sided && cos_reach > 0.0 && axis.dot(self.direction) < -sin_reach {
            return 0.0;
        }
        let facing = normal.dot(self.direction);
        let variance = NORMAL_VARIANCE_SHARE * (1.0 - normal.length_squared()).max(0.0) + sin_r * sin_r * (1.0 / 3.0);
        clamped_mean(if two_sided { facing.abs() } else { facing }, variance).max(LEAST_CLUSTER_COSINE)
    }
}

impl<const N: usize> Node<N> {
    /// Returns what every child sends out. All zero where nothing does.
    fn outgoing(&self, outgoing: &Outgoing) -> [f32; N] {
        let [flux, portal] = self.energies();
        let mut weights = match outgoing {
            Outgoing::Diffuse => flux,
            Outgoing::Beam(beam) => {
                let energies = if beam.portals_apart { portal } else { flux };
                core::array::from_fn(|i| {
                    let (axis, cone, normal) = self.cone(i);
                    energies[i] * beam.projection(axis, cone, normal, self.is_two_sided(i))
                })
            }
        };
        let possible = weights.map(|weight| weight > 0.0);
        keep_possible(&mut weights, |lane| possible[lane]);
        weights
    }
}

impl<const N: usize> WideTree<'_, N> {
    /// Draws a leaf by what it sends out. Returns it with its probability. A tree of one leaf gives that leaf.
    pub(crate) fn sample_outgoing(&self, outgoing: &Outgoing, u: &mut Variate) -> Option<(u32, f64)> {
        if self.nodes.is_empty() {
            return (self.leaves.len() == 1).then_some((0, 1.0));
        }
        let (mut node, mut pmf) = (0, 1.0);
        loop {
            let weights = self.nodes[node].outgoing(outgoing);
            let total = sum(&weights);
            if total == 0.0 {
                return None;
            }
            let lane = pick(&weights, total, u);
            pmf *= f64::from(weights[lane]) / total;
            match self.nodes[node].child(lane) {
                Child::Node(index) => node = index as usize,
                Child::Leaf(leaf) => return Some((leaf, pmf)),
                Child::Empty => return None,
            }
        }
    }

    /// Returns the probability with which [`Self::sample_outgoing`] draws a leaf.
    pub(crate) fn pmf_outgoing(&self, leaf: u32, outgoing: &Outgoing) -> f64 {
        self.path(leaf).map(|(node, lane)| pmf(&self.nodes[node].outgoing(outgoing), lane)).product()
    }

    /// Returns what all leaves send out, in units of the sum of their energies; `None` for a tree without nodes.
    pub(crate) fn outgoing(&self, outgoing: &Outgoing) -> Option<f32> {
        self.nodes.first().map(|root| root.outgoing(outgoing).iter().sum())
    }
}
