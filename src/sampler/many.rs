//! Points on the lights for many shading points at once.

use smallvec::SmallVec;

#[cfg(doc)]
use super::at::PointSampler;
use super::lights::{LightSampler, LightSamplerView, Scene};
use super::sample::variates;
use crate::record::{LightSample, ShadingPoint};
use crate::simd::prefetch;
use crate::tlas::{Descent, INTERLEAVED};
use crate::warp::Variate;

impl<const M: usize> LightSampler<M> {
    /// See [`LightSamplerView::sample_many`].
    pub fn sample_many(&self, queries: &[(ShadingPoint, [f32; 3])], samples: &mut [Option<LightSample>]) {
        self.as_view().sample_many(queries, samples);
    }
}

impl<const M: usize> LightSamplerView<'_, M> {
    /// Draws one sample for each shading point and its random numbers, the same as
    /// [`PointSampler::sample`] draws, but faster: a walk down a large tree mostly waits,
    /// and here several take turns.
    ///
    /// Where one slice is longer, the rest of it is left alone.
    pub fn sample_many(&self, queries: &[(ShadingPoint, [f32; 3])], samples: &mut [Option<LightSample>]) {
        // A sample is mostly the search for suns, where there are any.
        if self.has_suns() {
            let each = queries.iter().zip(samples);
            return each.for_each(|((x, u), sample)| *sample = self.sample(x, *u));
        }
        for (queries, samples) in queries.chunks(INTERLEAVED).zip(samples.chunks_mut(INTERLEAVED)) {
            self.sample_few(queries, samples);
        }
    }

    fn sample_few(&self, queries: &[(ShadingPoint, [f32; 3])], samples: &mut [Option<LightSample>]) {
        let mut walks = SmallVec::<[Descent<Scene<'_>>; INTERLEAVED]>::new();
        let mut points = SmallVec::<[[Variate; 2]; INTERLEAVED]>::new();
        for (x, u) in queries {
            let [choice, point @ ..] = variates(*u);
            walks.push(Descent::new(x, self.scene(x), choice));
            points.push(point);
        }
        self.tlas.sample_many(&mut walks);
        for (leaf, _) in walks.iter().filter_map(Descent::leaf) {
            prefetch(&self.triangles[leaf as usize]);
        }
        let Some((first, _)) = queries.first() else { return };
        // Without suns, nothing but the point differs.
        let mut at = self.at(first);
        for (i, sample) in samples.iter_mut().enumerate().take(walks.len()) {
            at.x = queries[i].0;
            *sample = walks[i].leaf().and_then(|(leaf, pmf)| at.sample_on(leaf, pmf, points[i]));
        }
    }
}
