//! The bright features that are visible at one shading point, each through a part of a portal.

use smallvec::SmallVec;

use super::view::FeaturePart;
use crate::light::LightLeaf;
use crate::math::{at_least, only_if};
use crate::warp::sum;

/// Most parts of portals that features are listed through. Of a feature with more parts, directions are drawn as if
/// there were no walls.
///
/// A budget: it bounds the time and the memory of a shading point (2.5 kB). Larger: points that see a feature through
/// many small openings take more time. Smaller: more of them draw directions as if there were no walls.
pub(super) const MAX_VISIBLE: usize = 64;

/// Stands for all portals.
pub(super) const ANY_PORTAL: LightLeaf = LightLeaf::alone(u32::MAX);

/// A feature, or a group of features, through a part of a portal.
#[derive(Clone, Copy, Debug)]
pub(super) struct VisibleFeature {
    /// Leaf of the portal, or [`ANY_PORTAL`].
    pub(super) leaf: LightLeaf,
    /// Node of the tree over the features.
    pub(super) node: u32,
    pub(super) part: FeaturePart,
}

/// Features through parts of portals. Written only as far as it is used: most points see few.
#[derive(Clone, Default)]
pub(crate) struct VisibleFeatures {
    /// Never more than there is room for.
    visible: SmallVec<[VisibleFeature; MAX_VISIBLE]>,
    /// Irradiance from each.
    weights: SmallVec<[f32; MAX_VISIBLE]>,
    /// Whether the shading point is close to one of the portals.
    is_close: bool,
}

crate::buffers::debug_counts!(VisibleFeatures, features => {
    visible: features.visible.len(),
    is_close: features.is_close,
});

impl VisibleFeatures {
    /// Irradiances from all that is listed.
    #[inline]
    pub(super) fn weights(&self) -> &[f32] {
        &self.weights
    }

    /// Number of listed parts.
    #[inline]
    pub(super) fn len(&self) -> usize {
        self.visible.len()
    }

    /// Appends a feature. Without room for it, it replaces the last one.
    pub(super) fn push(&mut self, leaf: LightLeaf, node: u32, part: FeaturePart, weight: f32) {
        self.truncate(MAX_VISIBLE - 1);
        self.visible.push(VisibleFeature { leaf, node, part });
        self.weights.push(weight);
    }

    /// Forgets all but the first entries.
    #[inline]
    fn truncate(&mut self, len: usize) {
        self.visible.truncate(len);
        self.weights.truncate(len);
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
    pub(super) fn merge(&mut self, start: usize, node: u32, weight: f32) {
        self.truncate(start);
        self.push(ANY_PORTAL, node, FeaturePart::WHOLE, weight);
    }

    /// Multiplies the irradiance through each portal by a factor. What has no portal stays.
    #[inline(never)]
    pub(super) fn dim(&mut self, factor: impl Fn(u32) -> f32) {
        for (visible, weight) in self.visible.iter().zip(&mut self.weights) {
            if visible.leaf != ANY_PORTAL {
                // Positive whatever underflows.
                let dimmed = at_least(*weight * factor(visible.leaf.top), f32::MIN_POSITIVE);
                *weight = only_if(*weight > 0.0, dimmed);
            }
        }
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

    /// Returns the entries with their weights.
    #[inline]
    pub(super) fn entries(&self) -> impl Iterator<Item = (&VisibleFeature, f32)> {
        self.visible.iter().zip(self.weights().iter().copied())
    }
}
