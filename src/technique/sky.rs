//! The environment as one more light: directions that no portal leads to.
//!
//! The sphere is divided into 64 regions ([`RegionMoments`]). The weight of a region is what it sends to the shading
//! point, as far as walls are left aside, and the sum of all weights is the estimate of the irradiance. A region is
//! chosen by its weight, and a direction in it by radiance alone. Only where the horizon of the receiver cuts a
//! region, or where the receiver has a lobe, are the next levels of the pyramid weighed by the receiver as well, so that
//! hardly a direction below the horizon is drawn.
//!
//! A direction is no point of a triangle. This technique therefore draws and weighs directions, and the mixture adds
//! its density where a ray leaves the scene.

use glam::Vec3;

use super::Viewpoint;
use crate::env::{
    EnvironmentView, REGION_DEPTH, REGIONS, RegionMoments, RegionSums, region_at, step, texel_cone, texel_solid_angle,
};
use crate::math::only_if;
use crate::receiver::{Receiver, ReceiverKind};
use crate::simd::{InstructionSet, Kernel};
use crate::warp::{Variate, keep_positive};

/// Levels of the pyramid below a region that are weighed by the receiver where the horizon cuts the region, and for a
/// lobe everywhere. *Measured* on the host bench's street (docs/CONSTANTS.md): 0 and 3 are as good there. Chosen for
/// suns at the horizon, which are in texels of six degrees then.
///
/// Larger: slower in these regions. Smaller: more samples below the horizon.
const CUT_LEVELS: u32 = 2;

/// The environment as seen from one shading point.
#[derive(Debug)]
pub(super) struct Sky {
    /// Weights of the regions.
    sums: RegionSums,
    /// The receiver in the environment's frame.
    receiver: Receiver,
}

/// A direction of the environment that was drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SkyDirection {
    /// Unit world direction.
    pub(crate) direction: Vec3,
    /// Density per solid angle.
    pub(crate) pdf: f64,
}

/// A texel that a walk down from the regions has ended at.
struct Place {
    depth: u32,
    texel: [u32; 2],
    /// Probability of the texel.
    probability: f64,
}

impl Sky {
    /// Returns the environment at a shading point, before it is weighed.
    #[inline(always)]
    pub(super) fn unweighed(at: &Viewpoint<'_>) -> Self {
        let local = |normal: Vec3| Vec3::from_array(at.scene.environment.local_vector(normal.to_array()));
        Self { sums: RegionSums::ZERO, receiver: at.x.receiver.map(local) }
    }

    /// Weighs all regions. Their sum, [`Self::irradiance`], is zero only if nothing can arrive.
    #[inline(always)]
    pub(super) fn weigh(&mut self, at: &Viewpoint<'_>, regions: &RegionMoments) {
        if !at.is_somewhere() {
            return;
        }
        let Self { sums, receiver } = self;
        InstructionSet::best().run(WeighRegions { regions, receiver: *receiver, sums });
        if at.visibility.is_some() {
            at.dim_sky(sums);
        }
    }

    /// Estimate of the irradiance.
    pub(super) fn irradiance(&self) -> f32 {
        self.sums.total()
    }

    /// Draws a direction. `None` where the part of the regions that the variates lead to is below the horizon.
    pub(super) fn sample(&self, at: &Viewpoint<'_>, mut u: [Variate; 2]) -> Option<SkyDirection> {
        let region = self.sums.pick(&mut u);
        let place = self.walk(at, region, |_, texel, weights| step(weights, texel, &mut u))?;
        let environment = &at.scene.environment;
        let sample = environment.sample_below(place.depth, place.texel, &mut u);
        let pdf = place.density(environment, sample.radiance);
        (pdf > 0.0).then_some(SkyDirection { direction: sample.direction, pdf })
    }

    /// Returns the density per solid angle with which [`Self::sample`] draws a unit world direction.
    pub(super) fn pdf(&self, at: &Viewpoint<'_>, direction: Vec3) -> f64 {
        let environment = &at.scene.environment;
        let depth = environment.header.depth.max(REGION_DEPTH + CUT_LEVELS);
        let texel = environment.texel_in(depth, direction);
        let below = depth - REGION_DEPTH;
        let region = texel.map(|i| i >> below);
        let place = self.walk(at, region, |depth, _, _| texel.map(|i| i >> (below + REGION_DEPTH - depth)));
        place.map_or(0.0, |place| place.density(environment, environment.mean_in(depth, texel)))
    }

    /// Goes down from a region to the last texel that is weighed by the receiver. `choose` gets a depth, the texel of
    /// the level above and the weights of the four texels below it, and returns one of these.
    #[inline(always)]
    fn walk(
        &self,
        at: &Viewpoint<'_>,
        region: [u32; 2],
        mut choose: impl FnMut(u32, [u32; 2], [f32; 4]) -> [u32; 2],
    ) -> Option<Place> {
        let number = region_at(region);
        let weight = self.sums.weight(number);
        if weight == 0.0 {
            return None;
        }
        let probability = f64::from(weight) / f64::from(self.sums.total());
        let mut place = Place { depth: REGION_DEPTH, texel: region, probability };
        if self.receiver.has_lobe() || self.is_cut(at.scene.sky?, number) {
            for depth in REGION_DEPTH + 1..=REGION_DEPTH + CUT_LEVELS {
                let weights = self.weights_below(&at.scene.environment, place.texel, depth);
                let total = weights.iter().sum::<f32>();
                if total == 0.0 {
                    return None;
                }
                let texel = choose(depth, place.texel, weights);
                let weight = weights[((texel[1] & 1) << 1 | (texel[0] & 1)) as usize];
                let probability = place.probability * (f64::from(weight) / f64::from(total));
                place = Place { depth, texel, probability };
            }
        }
        Some(place)
    }

    /// Whether the horizon cuts a region.
    #[inline]
    fn is_cut(&self, regions: &RegionMoments, region: usize) -> bool {
        self.receiver.has_horizon() && self.receiver.normal().dot(regions.axis(region)) < regions.reach[region]
    }

    /// Weights of the four texels of a level below one of the level above. Zero only if nothing can arrive.
    #[inline]
    fn weights_below(&self, environment: &EnvironmentView<'_>, [x, y]: [u32; 2], depth: u32) -> [f32; 4] {
        let texels = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[i, j]| [2 * x + i, 2 * y + j]);
        let (mut axes, mut sin_radii, mut weights) = ([[0.0; 4]; 3], [0.0; 4], [0.0; 4]);
        for (i, texel) in texels.into_iter().enumerate() {
            let (axis, sin_radius) = texel_cone(depth, texel);
            ([axes[0][i], axes[1][i], axes[2][i]], sin_radii[i]) = (axis.to_array(), sin_radius);
        }
        self.receiver.means_over_cones(&axes, &sin_radii, &mut weights);
        for (weight, texel) in weights.iter_mut().zip(texels) {
            let radiance = environment.mean_in(depth, texel);
            *weight = only_if(radiance > 0.0 && *weight > 0.0, (radiance * *weight).max(f32::MIN_POSITIVE));
        }
        weights
    }
}

impl Place {
    /// Density per solid angle of the directions of a texel of the image with this radiance.
    #[inline]
    fn density(&self, environment: &EnvironmentView<'_>, radiance: f32) -> f64 {
        let mean = environment.mean_in(self.depth, self.texel);
        if radiance > 0.0 && mean > 0.0 {
            let share = f64::from(radiance) / f64::from(mean);
            self.probability * share / texel_solid_angle(self.depth)
        } else {
            0.0
        }
    }
}

/// Weighs all regions in one loop over plain arrays.
struct WeighRegions<'m> {
    regions: &'m RegionMoments,
    receiver: Receiver,
    sums: &'m mut RegionSums,
}

impl Kernel for WeighRegions<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { regions, receiver, sums } = self;
        let weights = sums.weights_mut();
        receiver.means_over_cones(&regions.axes, &regions.spread, weights);
        // Without a horizon, nothing is below it.
        let normal = receiver.normal();
        let reach = if receiver.has_horizon() { 1.0 } else { f32::INFINITY };
        let [x, y, z] = &regions.axes;
        for i in 0..REGIONS {
            let height = normal.x * x[i] + normal.y * y[i] + normal.z * z[i];
            let weight = regions.flux[i] * weights[i] + regions.least[i];
            weights[i] = only_if(height > -(reach * regions.reach[i]), weight);
        }
        keep_positive(weights);
        sums.sum_up();
    }
}
