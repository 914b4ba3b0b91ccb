//! What is known of the region of a shading point: how much of each light, and of each part of the environment, gets
//! there.

use super::Viewpoint;
use crate::env::RegionSums;
use crate::math::only_if;
use crate::tlas::{FACTORS, FactorBytes};
use crate::visibility::{FEATURES, RegionFactors, SKY};
use crate::warp::{keep_positive, within_range};

impl Viewpoint<'_> {
    /// Returns the same viewpoint without anything that was learned.
    pub(crate) fn unlearned(&self) -> Self {
        Self { visibility: None, ..*self }
    }

    /// Returns the factors of a node of the light tree.
    #[inline(always)]
    pub(super) fn node_factors(&self, node: u32) -> Option<&FactorBytes> {
        self.visibility.as_ref()?.get(node).map(|factors| &factors.0)
    }

    /// Returns the factor in `(0, 1]` for bright features that are seen through a portal: that of the nearest entry on
    /// the way from its leaf to the root, first of those for features, then of those for all.
    #[inline(never)]
    pub(super) fn feature_factor(&self, region: &RegionFactors<'_>, leaf: u32) -> f32 {
        let (mut of_features, mut of_all) = (None, None);
        self.scene.tlas.visit_path(leaf, |node, lane| {
            let factor = |key: u32| region.get(key).map(|factors| factors.get(lane as usize));
            of_features = of_features.or_else(|| factor(node | FEATURES));
            of_all = of_all.or_else(|| factor(node));
        });
        of_features.or(of_all).unwrap_or(1.0)
    }

    /// Multiplies the weights of the environment's regions by what is known of them.
    #[inline(never)]
    pub(super) fn dim_sky(&self, sums: &mut RegionSums) {
        let Some(region) = &self.visibility else { return };
        let Some(all) = region.get(SKY) else { return };
        let weights = sums.weights_mut();
        for (group, weights) in (0..).zip(weights.chunks_exact_mut(FACTORS)) {
            let known = region.get(SKY + 1 + group);
            for (lane, weight) in weights.iter_mut().enumerate() {
                let factor = known.map_or_else(|| all.get(0), |factors| factors.get(lane));
                *weight = only_if(*weight > 0.0, within_range(*weight * factor));
            }
        }
        keep_positive(weights);
        sums.sum_up();
    }
}
