//! How likely each child of a node is to be chosen from a shading point: what it sends there by its first and second
//! moments, and exactly zero where its bounds prove that nothing can arrive.
//!
//! The moments replace the conservative geometric term of Conty Estevez and Kulla (2018), which is kept as the proof.
//! A cluster's position and normal are taken for normal variables with its mean and variance; cosines become the
//! expectation of a clamped normal variable.
//!
//! The lobe of a receiver is weighed in the direction to a cluster's mean, widened by the variance of the positions
//! ([`Lobe`]).
//!
//! Moments say little of what is near the shading point, and one direction says little of a cluster over which a lobe
//! varies. Such a cluster is opened, which means that the sum of its own children's weights is its weight. A light near
//! the point is weighed by its exact irradiance.

use glam::Vec3;

use super::factors::FactorBytes;
use crate::math::{self, at_least, at_most, only_if};
use crate::receiver::{LEAST_CLUSTER_COSINE, Lobe, ReceiverLanes, ShadingPoint};
use crate::tlas::node::{ALL, Child, LANE_TWO_SIDED, MEAN_STEPS, NORMAL_STEPS, Node, TANGENT_STEPS, WIDE, wide};
use crate::tlas::tree::WideTree;
use crate::warp::{keep_least, within_range};

/// What the tree asks of the level above about its leaves and about what they show.
pub(crate) trait LeafOracle {
    /// Returns the shading point that the tree is walked for.
    fn shading_point(&self) -> &ShadingPoint;

    /// Writes mean radiances, relative to the mean over all directions, of what portals show in the directions from the
    /// shading point to balls with these centers (by axis, relative to the shading point) and radii. A radiance is zero
    /// only where all of it is black. All slices are of one length. Only the elements in `set`, a set of bits, are
    /// needed; all are zero before.
    ///
    /// Must be `#[inline(always)]`: the length is then a constant, and loops over it become vectors.
    fn radiances(&self, centers: [&[f32]; 3], radii: &[f32], set: u32, radiances: &mut [f32]);

    /// Whether there are leaves that do not send over the hemisphere around their normal.
    fn has_shaped_leaves(&self) -> bool;

    /// Whether anything at all can travel from a leaf to the shading point. Asked only where the bounds of a leaf leave
    /// that open.
    fn is_visible(&self, leaf: u32) -> bool;

    /// Returns the irradiance from a leaf of unit radiance, per area of it. Rounding may make it zero. Asked only of
    /// leaves near the shading point.
    fn irradiance_per_area(&self, leaf: u32) -> f32;

    /// Whether anything is known of what walls hide from the shading point.
    fn has_factors(&self) -> bool;

    /// Returns what is known of the children of a node, as bytes that stand for factors
    /// ([`factor`](super::factors::factor)).
    fn factors(&self, node: u32) -> Option<&FactorBytes>;
}

impl<O: LeafOracle> LeafOracle for &O {
    #[inline(always)]
    fn shading_point(&self) -> &ShadingPoint {
        (**self).shading_point()
    }

    #[inline(always)]
    fn radiances(&self, centers: [&[f32]; 3], radii: &[f32], set: u32, radiances: &mut [f32]) {
        (**self).radiances(centers, radii, set, radiances);
    }

    #[inline(always)]
    fn has_shaped_leaves(&self) -> bool {
        (**self).has_shaped_leaves()
    }

    #[inline(always)]
    fn is_visible(&self, leaf: u32) -> bool {
        (**self).is_visible(leaf)
    }

    #[inline(always)]
    fn irradiance_per_area(&self, leaf: u32) -> f32 {
        (**self).irradiance_per_area(leaf)
    }

    #[inline(always)]
    fn has_factors(&self) -> bool {
        (**self).has_factors()
    }

    #[inline(always)]
    fn factors(&self, node: u32) -> Option<&FactorBytes> {
        (**self).factors(node)
    }
}

/// Cosine at the lights up to which a single triangle is asked whether it is visible. *Proved*: covers the rounding of
/// normals, at most √3 / 2 of 1 / 510. A larger one only asks more often.
const EDGE_COSINE: f32 = 3e-3;
/// Radius of a child's ball, relative to the distance of its center, from which on the child counts as near. *Measured*
/// on clouds, spheres, domes and windows (docs/ACCURACY.md, "Opening what is near").
///
/// Larger: the moments of clusters around the point are trusted. Smaller: more children are opened, which costs time.
const OPENING: f32 = 0.7;
/// Variation of a lobe over a cluster from which on the cluster is opened. *Measured* on clouds (docs/ACCURACY.md,
/// "Lobes").
///
/// Larger: lights off the peak are mistaken for those in it. Smaller: more clusters are opened, which costs time.
const MIXED_LOBE: f32 = 0.8;
/// Least weight of a leaf near the shading point, relative to that by its moments. It stands in for what rounding takes
/// from the exact irradiance. *Chosen*: below a thousandth of the largest weight, `f32` still has the irradiance to
/// 1e-3.
///
/// Larger: more samples of triangles that the point hardly sees. Smaller: what rounding takes away is not sampled.
const LEAST_NEAR_SHARE: f32 = 1e-3;
/// Least squared distance. *Proved*: its inverse is finite. A larger one would show in tiny scenes.
const LEAST_DISTANCE2: f32 = 1e-30;

// How much of each variance counts. Measured: docs/ACCURACY.md, "Moments", and, for the receiver, "Samples that
// choose nothing".

/// Share of the normals' variance, along the line of sight.
pub(super) const NORMAL_VARIANCE_SHARE: f32 = 0.4;
/// Share of the positions' variance, for the cosine at the lights.
const EMITTER_VARIANCE_SHARE: f32 = 1.0 / 3.0;
/// Share of the positions' variance, for the cosine at the receiver.
const RECEIVER_VARIANCE_SHARE: f32 = 1.0 / 3.0;
/// Share of the positions' variance, for the directions that a lobe is widened by. Measured: docs/ACCURACY.md, "Lobes".
///
/// Larger: the choice follows the lobe less. Smaller: clusters off the peak starve though some of their lights are in
/// it.
const DIRECTION_VARIANCE_SHARE: f32 = 0.5;
/// Share of the positions' variance, for the squared distance.
const DISTANCE_VARIANCE_SHARE: f32 = 0.3;

/// Weights of a node's children before the oracle was asked anything.
#[derive(Clone, Copy)]
pub(super) struct Estimates<const N: usize> {
    /// Zero where nothing can arrive.
    pub(super) weights: [f32; N],
    /// Bits of the largest weight.
    pub(super) largest: u32,
    /// Two sets of bits: leaves of which the bounds do not decide whether they are visible, and leaves near the shading
    /// point.
    pub(super) doubtful: [u32; 2],
    /// A set of bits: nodes near the shading point, or over which the lobe varies, that may send something.
    pub(super) opened: u32,
}

impl<const N: usize> WideTree<'_, N> {
    /// Returns the weight of every child of a node. All zero where nothing below the node can be visible.
    ///
    /// A child that is a node itself, and near the shading point or mixed for the lobe, is opened: the sum of its own
    /// children's weights is its weight. That is one level, and depends on the shading point alone.
    #[inline(always)]
    pub(super) fn weights(&self, index: usize, x: &ReceiverLanes<impl Lobe>, oracle: &impl LeafOracle) -> [f32; N] {
        self.weights_by(index, self.own_estimates(index, x, oracle), x, oracle, |_, _| ())
    }

    /// Returns the estimates of a node's children, of which none is opened yet.
    #[inline(always)]
    pub(super) fn own_estimates(
        &self,
        index: usize,
        x: &ReceiverLanes<impl Lobe>,
        oracle: &impl LeafOracle,
    ) -> Estimates<N> {
        let estimates = self.nodes[index].asked(index, x, oracle);
        if self.groups.is_empty() {
            estimates
        } else {
            self.within_groups(index, oracle.shading_point().groups, estimates)
        }
    }

    /// Returns [`weights`](Self::weights) by the estimates of a node's children. Each child that is opened is passed on
    /// with the estimates of its own children.
    #[inline(always)]
    pub(super) fn weights_by(
        &self,
        index: usize,
        estimates: Estimates<N>,
        x: &ReceiverLanes<impl Lobe>,
        oracle: &impl LeafOracle,
        mut pass_on: impl FnMut(u32, Estimates<N>),
    ) -> [f32; N] {
        let first_node = self.nodes[index].first_node;
        let Estimates { mut weights, mut largest, mut opened, .. } = estimates;
        if opened != 0 {
            while opened != 0 {
                let lane = opened.trailing_zeros();
                opened &= opened - 1;
                let child = first_node.wrapping_add(lane);
                let below = self.own_estimates(child as usize, x, oracle);
                pass_on(child, below);
                let sum: f32 = below.weights.iter().sum();
                let sum = only_if(sum > 0.0, within_range(sum));
                let is_known = oracle.has_factors();
                weights[lane as usize] =
                    if is_known { self.inherited(index, lane, child as usize, oracle, sum) } else { sum };
            }
            largest = weights.iter().fold(0, |largest, weight| largest.max(weight.to_bits()));
        }
        keep_least(&mut weights, largest);
        weights
    }
}

impl<const N: usize> Node<N> {
    /// Estimates all lanes, and asks the oracle about what is in doubt and what portals show.
    #[inline(always)]
    pub(super) fn asked(&self, index: usize, x: &ReceiverLanes<impl Lobe>, oracle: &impl LeafOracle) -> Estimates<N> {
        let mut estimates = self.estimates(x);
        if oracle.has_shaped_leaves() {
            // By value: what is referred to is kept in memory.
            estimates = self.shaped(x, estimates);
        }
        let [doubtful, near] = estimates.doubtful;
        if doubtful | near != 0 {
            estimates.largest = self.ask(oracle, &mut estimates.weights, doubtful, near);
        }
        if { self.portals } != [0; N] {
            estimates.largest = self.look_through(x, oracle, &mut estimates.weights);
        }
        if oracle.has_factors() {
            self.dim(index, oracle, &mut estimates);
        }
        estimates
    }

    /// Asks the oracle about leaves in doubt and leaves nearby, and returns the bits of the largest weight.
    #[inline(never)]
    fn ask(&self, oracle: &impl LeafOracle, weights: &mut [f32; N], doubtful: u32, near: u32) -> u32 {
        let mut waiting = doubtful | near;
        while waiting != 0 {
            let lane = waiting.trailing_zeros() as usize;
            waiting &= waiting - 1;
            let Child::Leaf(leaf) = self.child(lane) else { continue };
            if doubtful >> lane & 1 != 0 && !oracle.is_visible(leaf) {
                weights[lane] = 0.0;
            } else if near >> lane & 1 != 0 && weights[lane] > 0.0 {
                let exact = wide(self.energies[lane]) * oracle.irradiance_per_area(leaf);
                weights[lane] = within_range(at_least(exact, LEAST_NEAR_SHARE * weights[lane]));
            }
        }
        weights.iter().fold(0, |largest, weight| largest.max(weight.to_bits()))
    }

    /// Multiplies what comes through portals by what is seen there, and returns the bits of the largest weight.
    #[inline(always)]
    fn look_through(&self, x: &ReceiverLanes<impl Lobe>, oracle: &impl LeafOracle, weights: &mut [f32; N]) -> u32 {
        let (portals, centers, halves) = (self.portals, self.centers, self.halves);
        let origin = Vec3::from_array(self.origin) - x.position;
        let step = Vec3::from_array(self.steps.map(wide));
        let (mut balls, mut radii, mut set) = ([[0.0; N]; 3], [0.0; N], 0);
        for i in 0..N {
            let half = Vec3::new(f32::from(halves[0][i]), f32::from(halves[1][i]), f32::from(halves[2][i]));
            let center = Vec3::new(f32::from(centers[0][i]), f32::from(centers[1][i]), f32::from(centers[2][i]));
            let center = origin + center * step;
            (balls[0][i], balls[1][i], balls[2][i]) = (center.x, center.y, center.z);
            radii[i] = 0.5 * math::sqrt((half * step).length_squared());
            set |= u32::from((weights[i] > 0.0) & (portals[i] > 0)) << i;
        }
        let mut radiances = [0.0; N];
        oracle.radiances([&balls[0], &balls[1], &balls[2]], &radii, set, &mut radiances);
        let mut largest = 0;
        for i in 0..N {
            let share = f32::from(portals[i]) * (1.0 / f32::from(ALL));
            let factor = 1.0 - share + share * radiances[i];
            let is_lit = (weights[i] > 0.0) & (factor > 0.0);
            weights[i] = only_if(is_lit, within_range(weights[i] * factor));
            largest = largest.max(weights[i].to_bits());
        }
        largest
    }

    /// Estimates all lanes, in one plain loop over arrays that a compiler can turn into vectors.
    #[inline(always)]
    fn estimates(&self, x: &ReceiverLanes<impl Lobe>) -> Estimates<N> {
        let (normals, energies, centers, halves) = (self.normals, self.energies, self.centers, self.halves);
        let (means, deviations, lengths, tangents) = (self.means, self.deviations, self.lengths, self.tangents);
        // Relative to the shading point before anything else: far from the origin the difference is what is exact.
        let origin = Vec3::from_array(self.origin) - x.position;
        let step = Vec3::from_array(self.steps.map(wide));
        let half_step = 0.5 * step;
        let mean_step = half_step * (1.0 / MEAN_STEPS);
        let (horizon, absolute_horizon, normal) = (x.horizon, x.horizon.abs(), x.normal);
        let mut weights = [0.0; N];
        let (mut largest, mut doubtful, mut near, mut mixed) = (0, 0, 0, 0);
        for i in 0..N {
            let counts = Vec3::new(f32::from(halves[0][i]), f32::from(halves[1][i]), f32::from(halves[2][i]));
            // A difference, as that of zero is folded away.
            let half = counts * half_step - Vec3::splat(x.lobe.inset());
            let center = Vec3::new(f32::from(centers[0][i]), f32::from(centers[1][i]), f32::from(centers[2][i]));
            let center = origin + center * step;

            // The horizon, by the most and the least favorable corner of the box.
            let (height, reach) = (horizon.dot(center) + x.lift, absolute_horizon.dot(half));
            // The emitters' side: the angle between the axis and the direction to any point of the box, by the box's
            // nearest corner along the axis and the ball around it across.
            let bits = normals[i];
            let axis = Vec3::new(Self::steps(bits, 0), Self::steps(bits, 1), Self::steps(bits, 2));
            let (radius2, distance2) = (half.length_squared(), center.length_squared());
            let along = axis.dot(center);
            let radius = math::sqrt(radius2);
            let code = f32::from(tangents[i]);
            let tangent = code * code * (1.0 / (TANGENT_STEPS * TANGENT_STEPS));
            // In steps of the axis. Squared, to avoid a square root.
            let across2 = at_least(NORMAL_STEPS * NORMAL_STEPS * distance2 - along * along, 0.0);
            let beyond = along - axis.abs().dot(half) - tangent * NORMAL_STEPS * radius;
            let away = (beyond > 0.0) & (beyond * beyond > tangent * tangent * across2) & (code < f32::from(WIDE));

            // What arrives, by the moments.
            let mean = Vec3::new(f32::from(means[0][i]), f32::from(means[1][i]), f32::from(means[2][i]));
            let to_mean = center + mean * (counts * mean_step);
            let deviation = f32::from(deviations[i]);
            let length = f32::from(lengths[i]);
            let variance = deviation * deviation * (1.0 / (255.0 * 255.0)) * radius2;
            let squared = at_least(to_mean.length_squared() + DISTANCE_VARIANCE_SHARE * variance, LEAST_DISTANCE2);
            let (inverse2, distance) = (1.0 / squared, math::sqrt(squared));
            // No point of the box is farther than this.
            let slack = x.slack * (distance + 2.0 * radius);
            let (below, straddles) = (height + reach < -slack, !(height - reach > slack));
            let energy = wide(energies[i]);
            let culled = below | away | (energy == 0.0);
            let side = f32::from_bits(normal.dot(to_mean).to_bits() & x.cosine_bits);
            let receiver = clamped_mean(side, RECEIVER_VARIANCE_SHARE * variance);
            // Heights between the lowest and the highest corner with this mean have no larger clamped mean than the
            // chord of the clamped height between the two (Edmundson 1956). Not a number for a box of no height.
            let mean_height = horizon.dot(to_mean) + x.lift;
            let chord = (height + reach) * (mean_height + reach - height) / (2.0 * reach);
            let receiver = if straddles { at_most(chord, receiver) } else { receiver };
            let receiver = at_least(receiver, x.least_cosine * distance);
            let facing = length * (-1.0 / (255.0 * NORMAL_STEPS)) * axis.dot(to_mean);
            let facing = f32::from_bits(facing.to_bits() & !(bits & LANE_TWO_SIDED));
            let loss = NORMAL_VARIANCE_SHARE - length * length * (NORMAL_VARIANCE_SHARE / (255.0 * 255.0));
            let spread = loss * squared + EMITTER_VARIANCE_SHARE * variance;
            let emitter = at_least(clamped_mean(facing, spread), LEAST_CLUSTER_COSINE * distance);
            let spread2 = DIRECTION_VARIANCE_SHARE * variance * inverse2;
            let receiver = x.lobe.weigh(receiver, to_mean.to_array(), distance, spread2);
            let direction = (to_mean * (distance * inverse2)).to_array();
            let is_mixed = x.lobe.variation(direction, spread2) > MIXED_LOBE;
            let term = (receiver * inverse2) * emitter * inverse2;

            weights[i] = only_if(!culled, within_range(energy * term));
            largest = largest.max(weights[i].to_bits());
            // Many normals are left to what is below: an instance is as good as never averted.
            let averted = (facing < EDGE_COSINE * distance) & (length == f32::from(u8::MAX));
            doubtful |= u32::from((straddles | averted) & !culled) << i;
            near |= u32::from((radius2 > OPENING * OPENING * distance2) & !culled) << i;
            mixed |= u32::from(is_mixed & !culled) << i;
        }
        let leaves = self.children() & (u32::MAX << self.node_count);
        Estimates { weights, largest, doubtful: [doubtful & leaves, near & leaves], opened: (near | mixed) & !leaves }
    }
}

/// Returns the expectation of `max(0, X)` for a normal variable of this mean and variance, within 4 % of the standard
/// deviation: exact at a mean of zero and far from it.
#[inline(always)]
pub(super) fn clamped_mean(mean: f32, variance: f32) -> f32 {
    0.5 * (mean + math::sqrt(mean * mean + core::f32::consts::FRAC_2_PI * variance))
}
