//! The tree over the lights, then the tree over the texture of the one that was chosen.

use super::{Density, PlacedPoint, Technique, Variates, Viewpoint};
use crate::light::{DrawnPoint, LightKind, LightLeaf, LightPoint, LightView, LightViewKind, LocalPoint};
use crate::math::{at_least, only_if};
use crate::tlas::{FirstWeights, Splitting};
use crate::warp::Variate;

/// Both trees, as they are walked at one shading point.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Trees<'t> {
    /// Weights of the first choice, where they are known already.
    pub(crate) first: Option<&'t FirstWeights>,
    /// How far the tree over the lights is split, if it is.
    pub(crate) splitting: Option<&'t Splitting>,
}

impl Trees<'_> {
    /// Returns the probability of a light, or the expected number of visits if the tree is split.
    pub(crate) fn pmf(&self, at: &Viewpoint<'_>, leaf: LightLeaf) -> f64 {
        if self.splitting.is_none() && at.has_few() {
            if let Some([pmf, _]) = at.density_of_few(leaf, LocalPoint::NONE) {
                return pmf;
            }
        }
        self.pmf_of_tree(at, leaf)
    }

    /// Returns the same by walks through the tree.
    fn pmf_of_tree(&self, at: &Viewpoint<'_>, leaf: LightLeaf) -> f64 {
        let pmf = match self.splitting {
            None => at.scene.tlas.pmf(leaf.top, at, self.first),
            Some(splitting) => at.scene.tlas.expected_count(leaf.top, at, splitting),
        };
        pmf * at.pmf_within(leaf)
    }

    /// Draws a point on a light that has been chosen with this probability, or is visited this many times.
    #[inline(always)]
    pub(crate) fn sample_on<R>(
        &self,
        at: &Viewpoint<'_>,
        leaf: LightLeaf,
        pmf: f64,
        u: [Variate; 2],
        then: impl FnOnce(PlacedPoint, Density, &LightView<'_>) -> Option<R>,
    ) -> Option<R> {
        // By reference: what `?` moves is copied.
        let view = &at.view(leaf);
        let view = view.as_ref()?;
        let DrawnPoint { point, relative, pdf } = view.sample(u)?;
        let point = PlacedPoint { point: LightPoint { leaf, point }, relative };
        then(point, Density { pmf, pdf: pmf * pdf }, view)
    }
}

impl Technique for Trees<'_> {
    fn total(&self) -> f64 {
        1.0
    }

    #[inline(always)]
    fn sample<R>(
        &self,
        at: &Viewpoint<'_>,
        u: Variates,
        then: impl FnOnce(PlacedPoint, Density, &LightView<'_>) -> Option<R>,
    ) -> Option<R> {
        let (leaf, pmf) = at.choose(self.first, u.choice)?;
        self.sample_on(at, leaf, pmf, u.point, then)
    }

    fn density(&self, at: &Viewpoint<'_>, LightPoint { leaf, point }: LightPoint, view: &LightView<'_>) -> Density {
        if self.splitting.is_none() && at.has_few() {
            if let Some([pmf, pdf]) = at.density_of_few(leaf, point) {
                return Density { pmf, pdf };
            }
        }
        match self.pmf_of_tree(at, leaf) {
            0.0 => Density { pmf: 0.0, pdf: 0.0 },
            pmf => Density { pmf, pdf: pmf * view.pdf(point).unwrap_or(0.0) },
        }
    }
}

/// Estimates the irradiance that the trees account for: without the environment's bright features. `first` are the
/// weights of the tree's first choice, if the tree has nodes. Zero only where nothing can arrive.
pub(super) fn irradiance(at: &Viewpoint<'_>, first: Option<&FirstWeights>) -> f32 {
    if let Some(first) = first {
        let (energy, sum) = (at.scene.lights.energy, first.sum());
        // Positive whatever underflows.
        return only_if(energy > 0.0 && sum > 0.0, at_least(energy * sum, f32::MIN_POSITIVE));
    }
    // A tree without nodes has one light, or none.
    if at.scene.lights.is_empty() {
        return 0.0;
    }
    if let Some(irradiance) = at.irradiance_of_instance(0) {
        return irradiance;
    }
    let leaf = LightLeaf::alone(0);
    let weight = || at.scene.lights.light(0).weight() * at.scene.lights.scale(leaf);
    at.view(leaf).map_or(0.0, |view| view.irradiance(weight()))
}
