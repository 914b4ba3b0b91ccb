//! The techniques at one shading point: how often each is used, and the density of all together.

use super::distant::{Distant, DistantDirection};
use super::features::VisibleFeatures;
use super::sky::{Sky, SkyDirection};
use super::trees::{self, Trees};
use super::{Density, PlacedPoint, Technique, Variates, Viewpoint};
use glam::{DVec3, Vec3};

use crate::env::RegionMoments;
use crate::light::{LightLeaf, LightPoint, LightView};
use crate::tlas::{FirstWeights, Splitting};
use crate::warp::{Variate, pick_pair};

/// Least probability of the trees next to the features, where the trees may find anything.
///
/// Measured on window and star (docs/ACCURACY.md, "Tuned constants"). A larger value wastes samples where a feature
/// outshines the rest; a smaller one makes fireflies where the estimate of the rest is too low.
const LEAST_TREES: f32 = 0.02;

/// Least probability of the trees next to the features, where the shading point is close to a portal: what is seen
/// through it differs from place to place, so that the estimate of the trees and their choices are worse there.
///
/// Measured on star (docs/ACCURACY.md, "Where it is still weak"): without it one point 6 mm from the card has 21 times
/// the variance; everywhere, a tenth costs the window with sun 20 times its variance.
const LEAST_TREES_CLOSE: f32 = 0.2;

/// Largest estimate of an irradiance, so that sums of two stay finite. Proved: twice this is below `f32::MAX`.
const MAX_IRRADIANCE: f32 = 1e35;

/// Least probability of the environment next to the lights, and of the lights next to the environment; and of distant
/// lights next to both. Estimates know of no walls: the environment may be all but hidden where a lamp is not, and a
/// lamp where the environment is not.
///
/// Measured on the host bench's street and with hidden lamps (docs/CONSTANTS.md). A larger value wastes samples where
/// one of both outshines the other: the second moment there grows by at most 1 / (1 - p). With a smaller one, what is
/// dark by the estimates alone is noisier: its second moment is at most 1 / p of what its own samples have.
const LEAST_BESIDE: f64 = 0.1;

/// Probability of one of two techniques that do not know each other's walls, by estimates of the irradiance from both.
fn share_beside(own: f64, others: f64) -> f64 {
    if others > 0.0 { LEAST_BESIDE + (1.0 - 2.0 * LEAST_BESIDE) * (own / (own + others)) } else { 1.0 }
}

/// The techniques at one shading point, as far as they have been found out once for all questions.
pub(crate) struct Mixture {
    /// Weights of the tree's first choice, where balancing the techniques has taken them.
    first: Option<FirstWeights>,
    /// The features that are visible. `None` where there is none: moving a list takes longer than many a sample.
    features: Option<VisibleFeatures>,
    /// Estimate of the irradiance that the trees account for.
    rest: f32,
    /// The environment, if it is a light and anything can arrive from it.
    sky: Option<Sky>,
    /// The distant lights, if anything can arrive from them.
    distant: Option<Distant>,
    shares: Shares,
    /// Whether all of this is known, and not only that there are trees.
    is_complete: bool,
}

crate::buffers::debug_counts!(Mixture, mixture => {
    first: mixture.first.is_some(),
    features: mixture.features,
    rest: mixture.rest,
    sky: mixture.sky.is_some(),
    distant: mixture.distant,
    shares: mixture.shares,
    is_complete: mixture.is_complete,
});

/// What each unit of a technique's [`total`](Technique::total) counts.
#[derive(Clone, Copy, Debug)]
struct Shares {
    /// Probability of the trees.
    trees: f64,
    /// Probability of the features over the irradiance from them; 0 if none is visible.
    features: f64,
    /// Probability of the environment as a light.
    sky: f64,
    /// Probability of the distant lights.
    distant: f64,
}

/// A point on a light with its density by all techniques together.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drawn {
    pub(crate) point: LightPoint,
    /// Position of the point relative to the shading point.
    pub(crate) relative: DVec3,
    /// Probability of the light by the trees, or the expected number of visits where the tree is split.
    pub(crate) pmf: f64,
    /// Per solid angle.
    pub(crate) pdf: f64,
}

impl Drawn {
    #[inline(always)]
    fn new(PlacedPoint { point, relative }: PlacedPoint, Density { pmf, pdf }: Density) -> Self {
        Self { point, relative, pmf, pdf }
    }
}

impl Mixture {
    /// Finds out what there is besides the trees, the first time it is called.
    pub(crate) fn look_beside(&mut self, at: &Viewpoint<'_>) {
        if core::mem::replace(&mut self.is_complete, true) {
            return;
        }
        if at.scene.has_features() {
            self.add_features(at);
        }
        let extras = at.scene.lights.extras();
        let receives_sky = extras.is_empty() || extras.groups_of_environment() & at.x.groups != 0;
        if let Some(regions) = at.scene.sky.filter(|_| receives_sky) {
            self.add_sky(at, regions);
        }
        if !extras.is_empty() && !extras.distants().is_empty() {
            self.add_distant(at);
        }
    }

    /// The trees alone.
    #[inline(always)]
    pub(crate) fn of_trees() -> Self {
        let shares = Shares { trees: 1.0, features: 0.0, sky: 0.0, distant: 0.0 };
        Self { first: None, features: None, rest: 1.0, sky: None, distant: None, shares, is_complete: false }
    }

    /// Looks for features, and balances them with the trees. In place: the list of features is large, and most of it is
    /// seldom written.
    #[inline(never)]
    fn add_features(&mut self, at: &Viewpoint<'_>) {
        let features = self.features.insert(VisibleFeatures::default());
        features.find(at);
        let seen = features.irradiance();
        if !(seen > 0.0 && seen < MAX_IRRADIANCE) {
            self.features = None;
            return;
        }
        let least = if features.is_close() { LEAST_TREES_CLOSE } else { LEAST_TREES };
        self.first = at.scene.tlas.first_weights(at);
        let rest = trees::irradiance(at, self.first.as_ref());
        self.rest = if rest > 0.0 { rest.max(least * seen).min(MAX_IRRADIANCE) } else { 0.0 };
        let total = f64::from(seen) + f64::from(self.rest);
        self.shares = Shares { trees: f64::from(self.rest) / total, features: 1.0 / total, sky: 0.0, distant: 0.0 };
    }

    /// Balances all that lights send with what the environment sends as a light.
    #[inline(never)]
    fn add_sky(&mut self, at: &Viewpoint<'_>, regions: &RegionMoments) {
        // In place: it is too large to be copied without need.
        let sky = self.sky.insert(Sky::unweighed(at));
        sky.weigh(at, regions);
        let irradiance = f64::from(sky.irradiance());
        if !(irradiance > 0.0) {
            self.sky = None;
            return;
        }
        let share = share_beside(irradiance, self.irradiance_of_lights(at));
        let Shares { trees, features, .. } = self.shares;
        let (trees, features) = ((1.0 - share) * trees, (1.0 - share) * features);
        self.shares = Shares { trees, features, sky: share, distant: 0.0 };
    }

    /// Estimates the irradiance from all lights that are somewhere.
    #[inline(always)]
    fn irradiance_of_lights(&mut self, at: &Viewpoint<'_>) -> f64 {
        match &self.features {
            Some(features) => features.total() + f64::from(self.rest),
            None => {
                if self.first.is_none() {
                    self.first = at.scene.tlas.first_weights(at);
                }
                f64::from(trees::irradiance(at, self.first.as_ref()).min(MAX_IRRADIANCE))
            }
        }
    }

    /// Balances all that lights and the environment send with what distant lights send.
    #[inline(never)]
    fn add_distant(&mut self, at: &Viewpoint<'_>) {
        self.distant = Distant::new(at);
        let Some(distant) = &self.distant else { return };
        let irradiance = f64::from(distant.irradiance().min(MAX_IRRADIANCE));
        let sky = self.sky.as_ref().map_or(0.0, |sky| f64::from(sky.irradiance()));
        let share = share_beside(irradiance, sky + self.irradiance_of_lights(at));
        let Shares { trees, features, sky, .. } = self.shares;
        let [trees, features, sky] = [trees, features, sky].map(|other| (1.0 - share) * other);
        self.shares = Shares { trees, features, sky, distant: share };
    }

    /// Returns the mixture for single samples: one technique is chosen.
    #[inline(always)]
    pub(crate) fn one(&self) -> Mixed<'_> {
        Mixed { trees: Trees { first: self.first.as_ref(), splitting: None }, mixture: self, shares: self.shares }
    }

    /// Returns the mixture for a split tree: the trees in any case, and next to them one feature and one direction of
    /// the environment, if that is a light.
    pub(crate) fn side_by_side<'m>(&'m self, splitting: &'m Splitting) -> Mixed<'m> {
        let features = self.features.as_ref().map_or(0.0, |features| 1.0 / features.total());
        let trees = Trees { first: self.first.as_ref(), splitting: Some(splitting) };
        Mixed { trees, mixture: self, shares: Shares { trees: 1.0, features, sky: 1.0, distant: 1.0 } }
    }

    /// Estimates the irradiance from everything, as if there were no walls. Zero only where nothing can arrive.
    pub(crate) fn irradiance(&self, at: &Viewpoint<'_>) -> f32 {
        let first = self.first.or_else(|| at.scene.tlas.first_weights(at));
        let features = self.features.as_ref().map_or(0.0, VisibleFeatures::irradiance);
        let sky = self.sky.as_ref().map_or(0.0, Sky::irradiance);
        let distant = self.distant.as_ref().map_or(0.0, Distant::irradiance);
        trees::irradiance(at, first.as_ref()) + features + sky + distant
    }
}

/// The techniques with the share of each.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mixed<'m> {
    trees: Trees<'m>,
    mixture: &'m Mixture,
    shares: Shares,
}

impl Mixed<'_> {
    /// Chooses between the environment as a light and the lights that are somewhere. Returns whether it is the
    /// environment.
    #[inline(always)]
    pub(crate) fn chooses_sky(&self, choice: &mut Variate) -> bool {
        if self.mixture.sky.is_none() {
            return false;
        }
        let Shares { sky, distant, .. } = self.shares;
        let share = if distant == 0.0 { sky } else { sky / (1.0 - distant) } as f32;
        pick_pair([share, 1.0 - share], choice) == 0
    }

    /// Chooses between distant lights and all else. Returns whether it is a distant light. Asked before all other
    /// choices.
    #[inline(always)]
    pub(crate) fn chooses_distant(&self, choice: &mut Variate) -> bool {
        if self.mixture.distant.is_none() {
            return false;
        }
        let share = self.shares.distant as f32;
        pick_pair([share, 1.0 - share], choice) == 0
    }

    /// Draws a direction of a distant light, if anything can arrive from any.
    #[inline(never)]
    pub(crate) fn sample_distant(
        &self,
        at: &Viewpoint<'_>,
        choice: &mut Variate,
        u: [Variate; 2],
    ) -> Option<DistantDirection> {
        let drawn = self.mixture.distant.as_ref()?.sample(at, choice, u)?;
        let share = self.shares.distant;
        Some(DistantDirection { pmf: share * drawn.pmf, pdf: share * drawn.pdf, ..drawn })
    }

    /// Returns the probability of a distant light by its place among them, or the expected number of directions.
    pub(crate) fn distant_pmf(&self, at: &Viewpoint<'_>, light: usize) -> f64 {
        self.mixture.distant.as_ref().map_or(0.0, |distant| self.shares.distant * distant.pmf(at, light))
    }

    /// Returns the density of a unit direction that leads to a distant light with an extent, by that light alone.
    pub(crate) fn distant_density(&self, at: &Viewpoint<'_>, light: usize, direction: Vec3) -> f64 {
        self.mixture.distant.as_ref().map_or(0.0, |distant| self.shares.distant * distant.pdf(at, light, direction))
    }

    /// Probability of the environment as a light, or the expected number of directions.
    pub(crate) fn sky_pmf(&self) -> f64 {
        self.mixture.sky.as_ref().map_or(0.0, |_| self.shares.sky)
    }

    /// Draws a direction of the environment as a light, if anything can arrive from it.
    #[inline(never)]
    pub(crate) fn sample_sky(&self, at: &Viewpoint<'_>, u: [Variate; 2]) -> Option<SkyDirection> {
        let SkyDirection { direction, pdf } = self.mixture.sky.as_ref()?.sample(at, u)?;
        Some(SkyDirection { direction, pdf: self.shares.sky * pdf })
    }

    /// Returns the density of a unit direction by the environment as a light.
    pub(crate) fn sky_density(&self, at: &Viewpoint<'_>, direction: Vec3) -> f64 {
        self.mixture.sky.as_ref().map_or(0.0, |sky| self.shares.sky * sky.pdf(at, direction))
    }

    /// Draws a point on a light by one of the techniques.
    #[inline(always)]
    pub(crate) fn sample<R>(
        &self,
        at: &Viewpoint<'_>,
        mut u: Variates,
        then: impl FnOnce(&Drawn, &LightView<'_>) -> Option<R>,
    ) -> Option<R> {
        if let Some(features) = &self.mixture.features {
            if pick_pair([features.total() as f32, self.mixture.rest], &mut u.choice) == 0 {
                return self.sample_feature(at, u, then);
            }
        }
        self.trees.sample(at, u, |point, trees, view| {
            then(&Drawn::new(point, self.complete(at, point.point, trees, view)), view)
        })
    }

    /// Draws a point on a light that the trees have chosen with this probability, or visit this many times.
    #[inline(always)]
    pub(crate) fn sample_on<R>(
        &self,
        at: &Viewpoint<'_>,
        (leaf, pmf): (LightLeaf, f64),
        u: [Variate; 2],
        then: impl FnOnce(&Drawn, &LightView<'_>) -> Option<R>,
    ) -> Option<R> {
        self.trees.sample_on(at, leaf, pmf, u, |point, trees, view| {
            then(&Drawn::new(point, self.complete(at, point.point, trees, view)), view)
        })
    }

    /// Draws a point on a portal towards a feature, if any is visible.
    #[inline(never)]
    pub(crate) fn sample_feature<R>(
        &self,
        at: &Viewpoint<'_>,
        u: Variates,
        then: impl FnOnce(&Drawn, &LightView<'_>) -> Option<R>,
    ) -> Option<R> {
        let features = self.mixture.features.as_ref()?;
        features.sample(at, u, |point, features, view| {
            let trees = self.trees.density(at, point.point, view);
            then(&Drawn::new(point, self.mix(trees, features)), view)
        })
    }

    /// Returns a given point with its density.
    pub(crate) fn density(&self, at: &Viewpoint<'_>, point: LightPoint, view: &LightView<'_>) -> f64 {
        self.complete(at, point, self.trees.density(at, point, view), view).pdf
    }

    /// Returns the density of a point of a light that the trees have chosen.
    pub(crate) fn density_within(&self, at: &Viewpoint<'_>, point: LightPoint, view: &LightView<'_>) -> f64 {
        let Density { pmf, pdf } = self.trees.density(at, point, view);
        if pmf > 0.0 { pdf / pmf } else { 0.0 }
    }

    /// Returns the probability of a light by the trees, or the expected number of visits.
    pub(crate) fn pmf(&self, at: &Viewpoint<'_>, leaf: LightLeaf) -> f64 {
        self.shares.trees * self.trees.pmf(at, leaf)
    }

    /// Adds the density by the features to that by the trees.
    #[inline(always)]
    fn complete(&self, at: &Viewpoint<'_>, point: LightPoint, trees: Density, view: &LightView<'_>) -> Density {
        match &self.mixture.features {
            None => self.mix(trees, Density { pmf: 0.0, pdf: 0.0 }),
            Some(features) => self.mix(trees, features.density(at, point, view)),
        }
    }

    #[inline(always)]
    fn mix(&self, trees: Density, features: Density) -> Density {
        let pdf = self.shares.trees * trees.pdf + self.shares.features * features.pdf;
        Density { pmf: trees.pmf * self.shares.trees, pdf }
    }
}
