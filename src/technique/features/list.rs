//! The bright features that are visible at one shading point, each through a part of a portal.

use super::view::FeaturePart;
use crate::warp::sum;

/// Most parts of portals that features are listed through. Of a feature with more parts, directions are drawn as if there
/// were no walls.
///
/// A budget: it bounds the time and the memory of a shading point (2.5 kB). Half of it costs scenes with many small openings
/// noise; twice as many cost every shading point time.
pub(super) const MAX_VISIBLE: usize = 64;

/// Stands for all portals.
pub(super) const ANY_PORTAL: u32 = u32::MAX;

/// A feature through a part of a portal.
#[derive(Clone, Copy, Debug)]
pub(super) struct VisibleFeature {
    /// Leaf of the portal, or [`ANY_PORTAL`].
    pub(super) leaf: u32,
    pub(super) feature: u32,
    pub(super) part: FeaturePart,
}

/// Features through parts of portals.
#[derive(Clone, Debug)]
pub(crate) struct VisibleFeatures {
    visible: [VisibleFeature; MAX_VISIBLE],
    /// Irradiance from each.
    weights: [f32; MAX_VISIBLE],
    count: usize,
    /// Whether the shading point is close to one of the portals.
    is_close: bool,
}

impl Default for VisibleFeatures {
    /// No feature yet.
    #[inline]
    fn default() -> Self {
        Self {
            visible: [VisibleFeature { leaf: 0, feature: 0, part: FeaturePart::WHOLE }; MAX_VISIBLE],
            weights: [0.0; MAX_VISIBLE],
            count: 0,
            is_close: false,
        }
    }
}

impl VisibleFeatures {
    /// Irradiances from all that is listed.
    pub(super) fn weights(&self) -> &[f32] {
        &self.weights[..self.count]
    }

    /// Number of listed parts.
    pub(super) fn len(&self) -> usize {
        self.count
    }

    /// Appends a feature. There must be room for it.
    pub(super) fn push(&mut self, leaf: u32, feature: usize, part: FeaturePart, weight: f32) {
        self.visible[self.count] = VisibleFeature { leaf, feature: feature as u32, part };
        self.weights[self.count] = weight;
        self.count += 1;
    }

    /// Notes whether the shading point is close to a portal that a feature may be visible through.
    pub(super) fn note(&mut self, is_close: bool) {
        self.is_close |= is_close;
    }

    /// Whether the shading point is close to a portal that a feature may be visible through.
    pub(crate) fn is_close(&self) -> bool {
        self.is_close
    }

    /// Replaces all that is listed from `start` on by a feature as if there were no walls.
    pub(super) fn merge(&mut self, start: usize, feature: usize, weight: f32) {
        self.count = start;
        self.push(ANY_PORTAL, feature, FeaturePart::WHOLE, weight);
    }

    /// Returns the irradiance from all that is listed from `start` on.
    pub(super) fn irradiance_from(&self, start: usize) -> f32 {
        sum(&self.weights()[start..]) as f32
    }

    /// Returns the irradiance from all that is listed.
    pub(crate) fn irradiance(&self) -> f32 {
        self.irradiance_from(0)
    }

    /// Returns an entry of the list.
    pub(super) fn get(&self, index: usize) -> VisibleFeature {
        self.visible[index]
    }

    /// Returns the entries of one feature with their weights.
    pub(super) fn of_feature(&self, feature: usize) -> impl Iterator<Item = (VisibleFeature, f32)> {
        let listed = self.visible.iter().copied().zip(self.weights().iter().copied());
        listed.filter(move |(visible, _)| visible.feature as usize == feature)
    }
}
