//! Points on the lights for many shading points at once.

use smallvec::SmallVec;

use super::lights::LightSamplerView;
#[cfg(doc)]
use super::point::PointSampler;
use crate::light::{LightLeaf, MOST_FEW};
use crate::receiver::{NoLobe, ShadingPoint};
use crate::record::LightSample;
use crate::technique::{Variates, Viewpoint};
use crate::tlas::{Descent, INTERLEAVED};
use crate::warp::Variate;

impl LightSamplerView<'_> {
    /// Draws one sample for each shading point and its random numbers.
    ///
    /// The samples are those that [`PointSampler::sample`] draws, but faster: a walk down a large tree mostly waits for
    /// memory, and here several walks are interleaved. Where one slice is longer, the rest of it is left alone.
    pub fn sample_many(&self, queries: &[(ShadingPoint, [f32; 3])], samples: &mut [Option<LightSample>]) {
        for (queries, samples) in queries.chunks(INTERLEAVED).zip(samples.chunks_mut(INTERLEAVED)) {
            // With bright features a sample is mostly the search for them, and with the environment as a light walks
            // are few. Lobes are of different kinds, and a step goes down for one kind at a time. Instances have walks
            // of their own.
            let is_apart = self.scene.has_more_than_trees()
                || self.scene.lights.has_instances()
                || self.scene.lights.len() <= MOST_FEW;
            if is_apart || queries.iter().any(|(x, _)| x.receiver.has_lobe()) {
                let each = queries.iter().zip(samples);
                each.for_each(|((x, u), sample)| *sample = self.at(x).sample(*u));
            } else {
                self.sample_few(queries, samples);
            }
        }
    }

    fn sample_few(&self, queries: &[(ShadingPoint, [f32; 3])], samples: &mut [Option<LightSample>]) {
        let mut walks = SmallVec::<[Descent<Viewpoint<'_>, NoLobe>; INTERLEAVED]>::new();
        let mut points = SmallVec::<[[Variate; 2]; INTERLEAVED]>::new();
        for (x, u) in queries {
            let Variates { choice, point } = Variates::new(*u);
            walks.push(Descent::new(
                Viewpoint { scene: self.scene, x: *x, visibility: self.region(x) },
                NoLobe,
                choice,
            ));
            points.push(point);
        }
        self.scene.tlas.sample_many(&mut walks);
        for (leaf, _) in walks.iter().filter_map(Descent::leaf) {
            self.scene.lights.prefetch(leaf);
        }
        let Some((first, _)) = queries.first() else { return };
        // Without these, nothing but the point differs.
        let mut at = self.at(first);
        for (i, sample) in samples.iter_mut().enumerate().take(walks.len()) {
            at.move_to(&queries[i].0, self.region(&queries[i].0));
            *sample = walks[i].leaf().and_then(|(leaf, pmf)| at.sample_on((LightLeaf::alone(leaf), pmf), points[i]));
        }
    }
}
