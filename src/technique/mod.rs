//! Ways to choose a point on the lights for a shading point, and the one file that mixes them.
//!
//! A [`Technique`] estimates the irradiance that it accounts for, draws a point on a light and knows the density of any
//! point. [`Mixture`] chooses among the techniques in proportion to their estimates; a density is that of the mixture,
//! whichever technique drew the point. There are two: the [trees](trees), and the [bright features](features) of the
//! environment as the portals show them. Two more draw directions instead of points: the environment [itself](sky),
//! where it is a light, and [distant] lights.

mod distant;
mod features;
mod instances;
mod learned;
mod mixture;
mod segment;
mod sky;
mod trees;
mod viewpoint;

use glam::DVec3;

use crate::light::{LightPoint, LightView};
use crate::warp::{Variate, seed};

pub(crate) use distant::DistantDirection;
pub(crate) use mixture::{Drawn, Mixed, Mixture};
pub(crate) use segment::{Distances, MediumSegment};
pub(crate) use sky::SkyDirection;
pub(crate) use viewpoint::{LightScene, Viewpoint};

/// The random numbers of one sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Variates {
    /// Chooses the technique, and the light.
    pub(crate) choice: Variate,
    /// Choose the point on the light.
    pub(crate) point: [Variate; 2],
}

impl Variates {
    #[inline]
    pub(crate) fn new(u: [f32; 3]) -> Self {
        let salt = seed(&u);
        Self { choice: Variate::new(u[0], salt), point: [Variate::new(u[1], salt ^ 1), Variate::new(u[2], salt ^ 2)] }
    }
}

/// The density of a point by one technique.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Density {
    /// Probability of the light as such, or the expected number of visits where the tree is split. Zero for a technique
    /// that does not choose a light first.
    pub(crate) pmf: f64,
    /// Per solid angle at the shading point, times [`Technique::total`].
    pub(crate) pdf: f64,
}

/// A point on a light that was drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedPoint {
    pub(crate) point: LightPoint,
    /// Relative to the shading point.
    pub(crate) relative: DVec3,
}

/// One way to choose a point on the lights.
pub(crate) trait Technique {
    /// Returns what the densities of this technique integrate to. What they are divided by is left to the mixture, so
    /// that estimates of irradiances serve as probabilities as they are.
    fn total(&self) -> f64;

    /// Draws a point on a light, and passes it on together with its density and the light as seen from the shading
    /// point. `None` where nothing can arrive from the part of the lights that the variates lead to.
    ///
    /// The result is passed on rather than returned because a light's view is large.
    fn sample<R>(
        &self,
        at: &Viewpoint<'_>,
        u: Variates,
        then: impl FnOnce(PlacedPoint, Density, &LightView<'_>) -> Option<R>,
    ) -> Option<R>;

    /// Returns the density of a point on a light, of which the view is given.
    fn density(&self, at: &Viewpoint<'_>, point: LightPoint, view: &LightView<'_>) -> Density;
}
