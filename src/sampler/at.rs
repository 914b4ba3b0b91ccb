//! A shading point's own sampler: what all questions about one point have in common is found once.

use super::lights::{LightSampler, LightSamplerView};
use super::techniques::Techniques;
use crate::record::ShadingPoint;

/// The lights as seen from one shading point: [`LightSampler::at`].
///
/// Every question to a [`LightSampler`] begins with a search for the suns behind the portals. A host that asks more
/// than one at the same point saves all searches but the first; the answers are the same.
#[derive(Clone, Copy, Debug)]
pub struct PointSampler<'a, const N: usize = 16> {
    pub(super) lights: LightSamplerView<'a, N>,
    pub(super) x: ShadingPoint,
    pub(super) techniques: Techniques,
    /// Weights of the tree's first choice, where they are known already.
    pub(super) first_weights: Option<[f32; N]>,
}

impl<const N: usize> LightSampler<N> {
    /// The lights as seen from one shading point, for more than one question about it.
    #[inline]
    pub fn at(&self, x: &ShadingPoint) -> PointSampler<'_, N> {
        self.as_view().into_at(x)
    }
}

impl<'a, const N: usize> LightSamplerView<'a, N> {
    /// The lights as seen from one shading point, for more than one question about it.
    #[inline]
    pub fn at(&self, x: &ShadingPoint) -> PointSampler<'a, N> {
        self.into_at(x)
    }

    /// The same of a view that is not needed any more.
    #[inline(always)]
    fn into_at(self, x: &ShadingPoint) -> PointSampler<'a, N> {
        if self.has_suns() {
            let (techniques, first_weights) = self.weigh(x);
            return PointSampler { lights: self, x: *x, techniques, first_weights };
        }
        PointSampler { lights: self, x: *x, techniques: Techniques::trees(), first_weights: None }
    }
}
