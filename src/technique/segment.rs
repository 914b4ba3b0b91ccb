//! Distances along a ray in a medium, by the light that is expected to arrive there.
//!
//! The density of a distance is a mixture of three, so that it is known for any distance, whichever of them has drawn
//! it:
//!
//! - *clusters*: of clusters of lights, by the angle that the stretch subtends at each over its distance from the ray,
//!   and equiangularly within (Kulla and Fajardo 2012, section 4.1);
//! - *beams*: what the environment sends through portals, in bins along the ray: bright features by the shadows of the
//!   portals, and the rest of an image by probes, the trees' own estimate at a few points;
//! - *even*: by the transmittance alone, for all that arrives everywhere, and for what the others miss.

use core::f64::consts::PI;

use glam::{DVec3, Vec3};

use super::{LightScene, Viewpoint, trees};
use crate::light::{LightKind, LightLeaf};
use crate::math;
use crate::receiver::ShadingPoint;
use crate::tlas::{ClusterAlong, ClusterMoments, Clusters, Stretch};
use crate::warp::{Variate, pick};

/// Number of bins. *Chosen*: a budget of memory; a beam is found to a bin at each end.
///
/// Larger: narrow beams are met more closely. Smaller: more samples beside them.
const BEAM_BINS: usize = 32;
/// Number of probes. *Swept* in the gallery's fog (docs/CONSTANTS.md): of 2, 3, 4, 6, 8 and 16, four and six have the
/// least variance for their time. Each weighs the root of the tree once.
///
/// Larger: more time for each segment. Smaller: hazy beams are met less closely.
const PROBES: usize = 6;
/// Most features whose beams are followed, the strongest. *Chosen*: others are left to the even share.
///
/// Larger: more walks for each segment under a sky of many lamps. Smaller: more beams are left to the even share.
const MOST_FEATURES: usize = 4;
/// Most portals that the beams of a feature are followed through. *Chosen*: a budget of time.
///
/// Larger: lattices of many triangles cost more. Smaller: beams through their last triangles are left to the even
/// share.
const MOST_PORTALS: u32 = 256;
/// Least optical depth of a segment along which the transmittance is taken to vary. *Proved*: below it the
/// transmittance is 1 but for 1e-9, and single precision rounds by 6e-8. No depth that is divided by is zero.
///
/// Larger: distances that do not follow the transmittance. Smaller: nothing but rounding.
const LEAST_DEPTH: f64 = 1e-9;

/// Least probability of the even share, and of each of the others where it finds anything. Estimates know of no walls.
/// *Chosen*, not swept; as for the environment next to the lights.
///
/// Larger: samples where little arrives. Smaller: fireflies where an estimate is too low.
const LEAST_DISTANCE_SHARE: f64 = 0.1;

/// A stretch of a ray in a medium.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MediumSegment {
    pub(crate) stretch: Stretch,
    /// Share of the light that is lost per length, for short lengths.
    pub(crate) extinction: f64,
}

/// Densities of distances along a segment.
#[derive(Clone)]
pub(crate) struct Distances {
    segment: MediumSegment,
    clusters: Clusters,
    /// Sum of the clusters' weights.
    sum: f64,
    /// What beams bring to each bin.
    bins: [f32; BEAM_BINS],
    /// Sum of the bins.
    beams: f64,
    /// Probabilities of the clusters, the beams and the even share.
    shares: [f32; 3],
}

crate::buffers::debug_counts!(Distances, distances => {
    segment: distances.segment,
    sum: distances.sum,
    beams: distances.beams,
    shares: distances.shares,
});

impl MediumSegment {
    fn length(&self) -> f64 {
        self.stretch.length.into()
    }

    fn transmittance(&self, distance: f64) -> f64 {
        math::exp64(-self.extinction * distance)
    }

    /// Integral of the transmittance.
    fn reach(&self) -> f64 {
        let depth = self.extinction * self.length();
        if depth < LEAST_DEPTH { self.length() } else { -math::exp_m1_64(-depth) / self.extinction }
    }

    /// Draws a distance by the transmittance.
    fn draw(&self, u: f64) -> f64 {
        let depth = self.extinction * self.length();
        if depth < LEAST_DEPTH {
            return u * self.length();
        }
        -math::ln_1p64(u * math::exp_m1_64(-depth)) / self.extinction
    }

    fn pdf(&self, distance: f64) -> f64 {
        self.transmittance(distance) / self.reach()
    }
}

impl Distances {
    /// Finds out what may arrive along a segment, for points that receive these light groups.
    pub(crate) fn new(scene: &LightScene<'_>, segment: MediumSegment, groups: u32) -> Self {
        let mut clusters = scene.tlas.clusters_along(&segment.stretch, groups);
        if clusters.is_empty() && scene.lights.len() == 1 && scene.lights.extras().groups_of(0) & groups != 0 {
            clusters.extend(only_light(scene, &segment.stretch));
        }
        // The unit of the weights, and what is left of the light on its way back to the start.
        for cluster in &mut clusters {
            let place = cluster.place.clamp(0.0, segment.stretch.length);
            let brought =
                f64::from(cluster.weight) * f64::from(scene.lights.energy) * segment.transmittance(place.into());
            cluster.weight = brought.clamp(f64::from(f32::MIN_POSITIVE), 1e35) as f32;
        }
        let sum = clusters.iter().map(|cluster| f64::from(cluster.weight)).sum();
        let mut distances =
            Self { segment, clusters, sum, bins: [0.0; BEAM_BINS], beams: 0.0, shares: [0.0, 0.0, 1.0] };
        distances.find_beams(scene, groups);
        distances.probe(scene, groups);
        distances.beams = distances.bins.iter().map(|bin| f64::from(*bin)).sum();
        distances.balance(scene, groups);
        distances
    }

    /// Probabilities of the three by what each brings.
    fn balance(&mut self, scene: &LightScene<'_>, groups: u32) {
        let middle = 0.5 * self.segment.stretch.length * self.segment.stretch.direction;
        let x = ShadingPoint::volume(self.segment.stretch.origin + middle).with_groups(groups);
        let even = Viewpoint { scene: *scene, x, visibility: None }.irradiance_everywhere() * self.segment.reach();
        let total = self.sum + self.beams + even;
        let share = |own: f64| {
            if own > 0.0 { LEAST_DISTANCE_SHARE + (1.0 - 3.0 * LEAST_DISTANCE_SHARE) * own / total } else { 0.0 }
        };
        if total > 0.0 && total.is_finite() {
            let [clusters, beams] = [share(self.sum), share(self.beams)].map(|share| share as f32);
            self.shares = [clusters, beams, 1.0 - clusters - beams];
        }
    }

    /// Sums up in bins what bright features send through portals.
    fn find_beams(&mut self, scene: &LightScene<'_>, groups: u32) {
        if !scene.has_features() {
            return;
        }
        let nodes = scene.environment.feature_nodes();
        let mut strongest = [(0.0, 0); MOST_FEATURES];
        let mut node = 0;
        while let Some(feature) = nodes.get(node) {
            // A part of a feature is below it.
            if feature.is_single == 0 {
                node += 1;
                continue;
            }
            if let Some(weakest) = strongest.iter_mut().min_by(|a, b| f32::total_cmp(&a.0, &b.0)) {
                if feature.power > weakest.0 {
                    *weakest = (feature.power, node);
                }
            }
            node = (feature.next as usize).max(node + 1);
        }
        for (power, node) in strongest.into_iter().filter(|(power, _)| *power > 0.0) {
            let toward = scene.environment.feature_axis(node);
            let mut followed = 0;
            let stretch = self.segment.stretch;
            scene.tlas.meet_strip(&stretch, toward, |leaf| {
                if followed == MOST_PORTALS || scene.lights.extras().groups_of(leaf) & groups == 0 {
                    return;
                }
                if let Some([start, end]) = shadow(scene, leaf, &stretch, toward) {
                    // Other lights along the way count for nothing, however many they are.
                    followed += 1;
                    let weight = scene.lights.light(leaf).weight() * scene.lights.scale(LightLeaf::alone(leaf));
                    self.fill(start, end, power * weight);
                }
            });
        }
    }

    /// Sums up in bins what the trees expect where portals show an image: at each bin's middle, between the probes next
    /// to it.
    fn probe(&mut self, scene: &LightScene<'_>, groups: u32) {
        if !scene.lights.has_portals || scene.directional_environment().is_none() {
            return;
        }
        let Stretch { origin, direction, length } = self.segment.stretch;
        let probes: [f32; PROBES] = core::array::from_fn(|i| {
            let distance = (i as f32 + 0.5) / PROBES as f32 * length;
            let x = ShadingPoint::volume(origin + distance * direction).with_groups(groups);
            let at = Viewpoint { scene: *scene, x, visibility: None };
            let first = scene.tlas.first_weights(&at);
            trees::irradiance(&at, first.as_ref())
        });
        let width = self.segment.length() / BEAM_BINS as f64;
        for bin in 0..BEAM_BINS {
            self.add(bin, width, between(&probes, (bin as f32 + 0.5) / BEAM_BINS as f32));
        }
    }

    /// Adds light that arrives over a range of distances.
    fn fill(&mut self, start: f64, end: f64, irradiance: f32) {
        let width = self.segment.length() / BEAM_BINS as f64;
        let first = (start / width) as usize;
        for bin in first..BEAM_BINS {
            let (low, high) = (bin as f64 * width, (bin + 1) as f64 * width);
            if low >= end {
                break;
            }
            self.add(bin, (high.min(end) - low.max(start)).max(0.0), irradiance);
        }
    }

    /// Adds light that arrives over a part of a bin, of that length.
    fn add(&mut self, bin: usize, length: f64, irradiance: f32) {
        let middle = (bin as f64 + 0.5) / BEAM_BINS as f64 * self.segment.length();
        let brought = length * f64::from(irradiance) * self.segment.transmittance(middle);
        self.bins[bin] = (f64::from(self.bins[bin]) + brought).min(1e30) as f32;
    }

    /// Draws a distance with its density.
    pub(crate) fn sample(&self, mut u: Variate) -> (f32, f64) {
        let total: f64 = self.shares.iter().map(|share| f64::from(*share)).sum();
        let distance = match pick(&self.shares, total, &mut u) {
            0 => self.draw_equiangular(u),
            1 => {
                let bin = pick(&self.bins, self.beams, &mut u);
                (bin as f64 + u.value()) * (self.segment.length() / BEAM_BINS as f64)
            }
            _ => self.segment.draw(u.value()),
        };
        let distance = (distance as f32).clamp(0.0, self.segment.stretch.length);
        (distance, self.pdf(distance))
    }

    fn draw_equiangular(&self, mut u: Variate) -> f64 {
        let target = u.value() * self.sum;
        let (mut chosen, mut low, mut below) = (None, 0.0, 0.0);
        for cluster in &self.clusters {
            (chosen, low) = (Some(cluster), below);
            below += f64::from(cluster.weight);
            if target < below {
                break;
            }
        }
        let Some(cluster) = chosen else { return self.segment.draw(u.value()) };
        u.stretch(target - low, cluster.weight.into(), self.sum);
        let ([start, end], place) = (self.angles(cluster), f64::from(cluster.place));
        let angle = start + u.value() * (end - start);
        let tangent = math::cos64(angle - 0.5 * PI) / math::cos64(angle).max(f64::MIN_POSITIVE);
        place + f64::from(cluster.distance) * tangent
    }

    /// Angles at a cluster from where it is nearest to both ends of the stretch.
    fn angles(&self, cluster: &ClusterAlong) -> [f64; 2] {
        let (place, distance) = (f64::from(cluster.place), f64::from(cluster.distance));
        [-place, self.segment.length() - place].map(|along| math::atan2_64(along, distance))
    }

    /// Returns the density per length of a distance.
    pub(crate) fn pdf(&self, distance: f32) -> f64 {
        if !(0.0..=self.segment.stretch.length).contains(&distance) {
            return 0.0;
        }
        let distance = f64::from(distance);
        let total: f64 = self.shares.iter().map(|share| f64::from(*share)).sum();
        let [clusters, beams, even] = self.shares.map(|share| f64::from(share) / total);
        let mut pdf = even * self.segment.pdf(distance);
        if beams > 0.0 {
            let width = self.segment.length() / BEAM_BINS as f64;
            let bin = ((distance / width) as usize).min(BEAM_BINS - 1);
            pdf += beams * f64::from(self.bins[bin]) / (self.beams * width);
        }
        if clusters > 0.0 {
            let of = |cluster: &ClusterAlong| {
                let [start, end] = self.angles(cluster);
                let (along, across) = (distance - f64::from(cluster.place), f64::from(cluster.distance));
                f64::from(cluster.weight) * across / ((end - start) * (along * along + across * across))
            };
            pdf += clusters * self.clusters.iter().map(of).sum::<f64>() / self.sum;
        }
        pdf
    }
}

/// The value at a share of a length, from the values in the middles of equal parts of it.
fn between<const N: usize>(values: &[f32; N], share: f32) -> f32 {
    let at = (share * N as f32 - 0.5).clamp(0.0, (N - 1) as f32);
    let below = (at as usize).min(N - 2);
    let above_share = at - below as f32;
    values[below] + (values[below + 1] - values[below]) * above_share
}

/// The only light of a tree without nodes, as a cluster.
fn only_light(scene: &LightScene<'_>, stretch: &Stretch) -> Option<ClusterAlong> {
    let (bounds, moments) = scene.lights.light(0).bounds(false, |_| 1.0);
    let moments = ClusterMoments {
        energy: moments.energy,
        mean: moments.mean - stretch.origin,
        variance: moments.variance,
        normal: moments.normal,
        two_sided: bounds.two_sided,
    };
    ClusterAlong::new(&moments, stretch)
}

/// Returns the distances between which a portal is in a direction, a unit vector, from the points of a stretch; `None`
/// if from no point, or for any other light.
fn shadow(scene: &LightScene<'_>, leaf: u32, stretch: &Stretch, toward: Vec3) -> Option<[f64; 2]> {
    let (vertices, two_sided) = scene.lights.portal(leaf)?;
    let origin = stretch.origin.as_dvec3();
    let (direction, toward) = (stretch.direction.as_dvec3(), toward.as_dvec3());
    let [a, b, c] = vertices.map(|vertex| vertex.as_dvec3() - origin);
    let normal = (b - a).cross(c - a);
    let facing = normal.dot(toward);
    if facing == 0.0 || (facing > 0.0 && !two_sided) {
        return None;
    }
    let (mut start, mut end) = (0.0_f64, f64::from(stretch.length));
    // What is not negative, as it changes with the distance.
    let mut clip = |at_start: f64, per_length: f64| {
        if per_length == 0.0 {
            if at_start < 0.0 {
                end = -1.0;
            }
        } else if per_length > 0.0 {
            start = start.max(-at_start / per_length);
        } else {
            end = end.min(-at_start / per_length);
        }
    };
    // Inside each edge, as seen along the direction; and in front.
    let sign = facing.signum();
    for (from, to) in [(a, b), (b, c), (c, a)] {
        let plane: DVec3 = (to - from).cross(toward) * -sign;
        clip(-plane.dot(from), plane.dot(direction));
    }
    clip(sign * normal.dot(a), -sign * normal.dot(direction));
    (start < end).then_some([start, end])
}
