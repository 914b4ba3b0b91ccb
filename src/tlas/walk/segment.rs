//! Clusters of lights as seen from a stretch of a ray, for points that are to be chosen on it.
//!
//! What a light in a medium sends to the points of a ray, without anything in between, integrates to the angle that the
//! ray's ends subtend at the light over the light's distance from the ray (Kulla and Fajardo 2012, section 4.1). A
//! cluster counts as a light at its mean position, whose distance is widened by the variance of the positions. Clusters
//! that are large for their distance are opened, as far as there is room.

use glam::Vec3;
use smallvec::SmallVec;

use super::importance::{NORMAL_VARIANCE_SHARE, clamped_mean};
use crate::math;
use crate::receiver::LEAST_CLUSTER_COSINE;
use crate::tlas::node::{Child, MEAN_STEPS, Node, wide};
use crate::tlas::tree::WideTree;

/// Most clusters. *Chosen*: a budget of the time and memory of a segment; a root of 16 lanes and three more nodes.
///
/// Larger: more time for each segment. Smaller: lights near the ray share a cluster.
const MOST_CLUSTERS: usize = 64;
/// Share of the positions' variance that widens the distance of a cluster. *Proved* for positions spread evenly in all
/// directions: two of three directions are across the ray.
///
/// Larger: points are chosen more evenly. Smaller: lights of the cluster off its mean are missed.
const ACROSS_SHARE: f32 = 2.0 / 3.0;
/// Deviation of a cluster's positions over its distance from which on it is worth opening. *Chosen*, not swept.
///
/// Larger: fewer clusters, which mislead more. Smaller: more time for what is far away.
const OPENED_SPREAD: f32 = 0.2;
/// Least distance from the ray, relative to the length of the stretch. *Chosen*: below it the density is finite, and
/// the even share of the distances takes over.
///
/// Larger: less is gained next to a light. Smaller: nothing but rounding.
const LEAST_DISTANCE: f32 = 1e-4;
/// Rounding granted to the distance of a box from a strip, relative to that from its start. *Proved*: sums of a few
/// products, 1e-6. A larger one visits a few more leaves.
const STRIP_ROUNDING: f32 = 1e-5;

/// A stretch of a ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stretch {
    pub(crate) origin: Vec3,
    /// Unit vector.
    pub(crate) direction: Vec3,
    /// Finite and positive.
    pub(crate) length: f32,
}

/// A cluster of lights as seen from a stretch of a ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ClusterAlong {
    /// What the cluster sends to all points of the stretch together, by the tree's energies. Positive.
    pub(crate) weight: f32,
    /// Distance along the ray at which the cluster is nearest.
    pub(crate) place: f32,
    /// Distance from the ray there.
    pub(crate) distance: f32,
}

/// Clusters that hold all lights once.
pub(crate) type Clusters = SmallVec<[ClusterAlong; MOST_CLUSTERS]>;

/// What is known of the lights of a cluster.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ClusterMoments {
    pub(crate) energy: f32,
    /// Mean position relative to the start of the stretch, and variance.
    pub(crate) mean: Vec3,
    pub(crate) variance: f32,
    /// Mean normal.
    pub(crate) normal: Vec3,
    pub(crate) two_sided: bool,
}

/// A cluster that may be opened.
#[derive(Clone, Copy, Debug)]
struct OpenCluster {
    cluster: ClusterAlong,
    /// The node below, and how much there is to gain by opening it; nothing for a leaf.
    below: Option<(u32, f32)>,
}

impl ClusterAlong {
    /// Weighs a cluster; `None` if it sends nothing.
    pub(crate) fn new(moments: &ClusterMoments, stretch: &Stretch) -> Option<Self> {
        let ClusterMoments { energy, mean, variance, normal, two_sided } = *moments;
        let place = mean.dot(stretch.direction);
        let across2 = (mean - place * stretch.direction).length_squared();
        let least = LEAST_DISTANCE * stretch.length;
        let distance = math::sqrt(across2 + ACROSS_SHARE * variance + least * least);
        let [start, end] = [-place, stretch.length - place].map(|along| math::atan2(along, distance));
        // The cosine at the lights, from where they are nearest.
        let to_ray = place.clamp(0.0, stretch.length) * stretch.direction - mean;
        let squared = to_ray.length_squared() + variance + least * least;
        let facing = normal.dot(to_ray);
        let facing = if two_sided { facing.abs() } else { facing };
        let spread = NORMAL_VARIANCE_SHARE * (1.0 - normal.length_squared()).max(0.0) * squared + variance;
        let cosine = (clamped_mean(facing, spread) / math::sqrt(squared)).clamp(LEAST_CLUSTER_COSINE, 1.0);
        let weight = energy * cosine * ((end - start) / distance);
        (weight > 0.0 && weight.is_finite()).then_some(Self { weight, place, distance })
    }
}

impl<const N: usize> WideTree<'_, N> {
    /// Finds clusters of lights in any of these light groups.
    pub(super) fn clusters_along(&self, stretch: &Stretch, groups: u32) -> Clusters {
        let mut entries = SmallVec::<[OpenCluster; MOST_CLUSTERS]>::new();
        if !self.nodes.is_empty() {
            self.add_lanes(0, stretch, groups, &mut entries);
        }
        while entries.len() + N <= MOST_CLUSTERS + 1 {
            let gain = |entry: &OpenCluster| entry.below.map_or(0.0, |(_, gain)| gain);
            let best = (0..entries.len()).max_by(|&a, &b| gain(&entries[a]).total_cmp(&gain(&entries[b])));
            let Some((at, (node, gain))) = best.and_then(|at| Some((at, entries[at].below?))) else { break };
            if gain == 0.0 {
                break;
            }
            entries.swap_remove(at);
            self.add_lanes(node as usize, stretch, groups, &mut entries);
        }
        entries.iter().map(|entry| entry.cluster).collect()
    }

    fn add_lanes(
        &self,
        index: usize,
        stretch: &Stretch,
        groups: u32,
        entries: &mut SmallVec<[OpenCluster; MOST_CLUSTERS]>,
    ) {
        let node = &self.nodes[index];
        for lane in 0..usize::from(node.width).min(N) {
            if !self.groups.is_empty() && self.groups[index * N + lane] & groups == 0 {
                continue;
            }
            let moments = node.moments(lane, stretch.origin);
            let Some(cluster) = ClusterAlong::new(&moments, stretch) else { continue };
            let spread = math::sqrt(moments.variance) / cluster.distance;
            let gain = if spread > OPENED_SPREAD { cluster.weight * spread } else { 0.0 };
            let below = match node.child(lane) {
                Child::Node(below) => Some((below, gain)),
                Child::Leaf(_) | Child::Empty => None,
            };
            if entries.len() < MOST_CLUSTERS {
                entries.push(OpenCluster { cluster, below });
            }
        }
    }

    /// Visits leaves that parallel rays may meet which start on a stretch.
    pub(super) fn meet_strip(&self, stretch: &Stretch, direction: Vec3, visit: impl FnMut(u32)) {
        let across = stretch.direction - stretch.direction.dot(direction) * direction;
        let end = across * stretch.length;
        let rise = stretch.direction.dot(direction) * stretch.length;
        let entered = |node: &Node<N>| {
            let (low, high) = node.corners();
            let mut met = 0;
            for i in 0..N {
                let from = Vec3::new(low[0][i], low[1][i], low[2][i]) - stretch.origin;
                let to = Vec3::new(high[0][i], high[1][i], high[2][i]) - stretch.origin;
                let center = 0.5 * (from + to);
                let slack = 0.5 * (to - from).length() + STRIP_ROUNDING * (center.length() + stretch.length);
                let along = center.dot(direction);
                let flat = center - along * direction;
                let share = (flat.dot(end) / end.length_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
                let is_near = (flat - share * end).length_squared() <= slack * slack;
                met |= u32::from(is_near & (along >= rise.min(0.0) - slack)) << i;
            }
            met & node.children()
        };
        self.walk(entered, visit);
    }
}

impl<const N: usize> Node<N> {
    /// Returns what is known of the lights below a lane. Positions are relative to a point.
    fn moments(&self, lane: usize, origin: Vec3) -> ClusterMoments {
        let step = Vec3::from_array(self.steps.map(wide));
        let (centers, halves, means) = (self.centers, self.halves, self.means);
        let byte = |codes: &[[u8; N]; 3]| Vec3::from_array([0, 1, 2].map(|axis| f32::from(codes[axis][lane])));
        let half = 0.5 * byte(&halves) * step;
        let center = Vec3::from_array(self.origin) - origin + byte(&centers) * step;
        let mean = Vec3::from_array([0, 1, 2].map(|axis| f32::from(means[axis][lane]))) * (1.0 / MEAN_STEPS);
        let deviation = f32::from(self.deviations[lane]) * (1.0 / 255.0);
        let (_, _, normal) = self.cone(lane);
        ClusterMoments {
            energy: wide(self.energies[lane]),
            mean: center + mean * half,
            variance: deviation * deviation * half.length_squared(),
            normal,
            two_sided: self.is_two_sided(lane),
        }
    }
}
