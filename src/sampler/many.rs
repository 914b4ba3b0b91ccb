//! Points on the lights for many shading points at once.

use smallvec::SmallVec;

use super::at::PointSampler;
use super::lights::{LightSampler, LightSamplerView, Scene};
use super::sample::variates;
use super::techniques::{Technique, Techniques};
use crate::record::{LightSample, ShadingPoint};
use crate::simd::prefetch;
use crate::tlas::Walk;

/// Walks down the tree that take turns: enough to hide what one waits for, few enough to stay in the cache.
const TURNS: usize = 8;

impl<const N: usize, const M: usize> LightSampler<N, M> {
    /// See [`LightSamplerView::sample_many`].
    pub fn sample_many(&self, queries: &[(ShadingPoint, [f32; 3])], samples: &mut [Option<LightSample>]) {
        self.as_view().sample_many(queries, samples);
    }
}

impl<const N: usize, const M: usize> LightSamplerView<'_, N, M> {
    /// Draws one sample for each shading point and its random numbers, the same as
    /// [`PointSampler::sample`] draws, but faster: a walk down a large tree mostly waits,
    /// and here several take turns.
    ///
    /// Where one slice is longer, the rest of it is left alone.
    pub fn sample_many(&self, queries: &[(ShadingPoint, [f32; 3])], samples: &mut [Option<LightSample>]) {
        for (queries, samples) in queries.chunks(TURNS).zip(samples.chunks_mut(TURNS)) {
            self.sample_few(queries, samples);
        }
    }

    fn sample_few(&self, queries: &[(ShadingPoint, [f32; 3])], samples: &mut [Option<LightSample>]) {
        let mut walks = SmallVec::<[Walk<Scene<'_>>; TURNS]>::new();
        // The places and techniques of those that go down the tree.
        let mut waiting = SmallVec::<[(usize, Techniques); TURNS]>::new();
        for (i, ((x, u), sample)) in queries.iter().zip(&mut *samples).enumerate() {
            let techniques = self.techniques(x);
            let [mut choice, point @ ..] = variates(*u);
            match techniques.choose(&mut choice) {
                Technique::Sun(sun) => {
                    *sample = PointSampler { lights: *self, x: *x, techniques }.sample_sun(sun, point, None);
                }
                Technique::Trees => {
                    walks.push(Walk::new(x, self.scene(x), choice));
                    waiting.push((i, techniques));
                }
            }
        }
        self.tlas.sample_many(&mut walks);
        for (leaf, _) in walks.iter().filter_map(Walk::leaf) {
            prefetch(&self.triangles[leaf as usize]);
        }
        for (walk, &(i, techniques)) in walks.iter().zip(&waiting) {
            let (x, u) = queries[i];
            let [_, point @ ..] = variates(u);
            let at = PointSampler { lights: *self, x, techniques };
            samples[i] = walk.leaf().and_then(|(leaf, pmf)| at.sample_on(leaf, pmf, point));
        }
    }
}
