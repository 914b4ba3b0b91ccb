//! Many points on the lights at once, for many shading points or for one.

use smallvec::SmallVec;

use super::lights::LightSamplerView;
use super::point::PointSampler;
use crate::light::{LightLeaf, MOST_FEW};
use crate::receiver::{Lobe, NoLobe, ShadingPoint, for_lobe};
use crate::record::LightSample;
use crate::technique::{LightScene, Variates, Viewpoint};
use crate::tlas::{Descent, FirstWeights, INTERLEAVED};
use crate::warp::Variate;

/// Whether walks down the tree are most of what samples are. With bright features a sample is mostly the search for
/// them, and with the environment as a light walks are few. Instances have walks of their own.
fn gains_by_interleaving(scene: &LightScene<'_>) -> bool {
    !scene.has_more_than_trees() && !scene.lights.has_instances() && scene.lights.len() > MOST_FEW
}

impl LightSamplerView<'_> {
    /// Draws one sample for each shading point and its random numbers.
    ///
    /// The samples are those that [`PointSampler::sample`] draws, but faster: a walk down a large tree mostly waits for
    /// memory, and here several walks are interleaved. Where one slice is longer, the rest of it is left alone.
    pub fn sample_many(&self, queries: &[(ShadingPoint, [f32; 3])], samples: &mut [Option<LightSample>]) {
        for (queries, samples) in queries.chunks(INTERLEAVED).zip(samples.chunks_mut(INTERLEAVED)) {
            // Lobes are of different kinds, and a step goes down for one kind at a time.
            if !gains_by_interleaving(&self.scene) || queries.iter().any(|(x, _)| x.receiver.has_lobe()) {
                let each = queries.iter().zip(samples);
                each.for_each(|((x, u), sample)| *sample = self.at(x).sample(*u));
            } else {
                self.sample_interleaved(queries, samples);
            }
        }
    }

    fn sample_interleaved(&self, queries: &[(ShadingPoint, [f32; 3])], samples: &mut [Option<LightSample>]) {
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
        self.scene.tlas.sample_many(&mut walks, None);
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

impl PointSampler<'_> {
    /// Draws a sample for each element of `numbers`: those that [`Self::sample`] draws, but with interleaved walks, and
    /// with one look at the root of the tree for all of a slice.
    pub(super) fn sample_all(&self, numbers: &[[f32; 3]], mut visit: impl FnMut(Option<LightSample>)) {
        if !gains_by_interleaving(&self.at.scene) {
            numbers.iter().for_each(|u| visit(self.sample(*u)));
            return;
        }
        let first = self.at.scene.tlas.first_weights(&self.at);
        for numbers in numbers.chunks(INTERLEAVED) {
            for_lobe!(self.at.x.receiver, lobe => self.sample_chunk(numbers, first.as_ref(), lobe, &mut visit));
        }
    }

    fn sample_chunk(
        &self,
        numbers: &[[f32; 3]],
        first: Option<&FirstWeights>,
        lobe: impl Lobe,
        mut visit: impl FnMut(Option<LightSample>),
    ) {
        let mut walks = SmallVec::<[_; INTERLEAVED]>::new();
        let mut points = SmallVec::<[[Variate; 2]; INTERLEAVED]>::new();
        for u in numbers {
            let Variates { choice, point } = Variates::new(*u);
            walks.push(Descent::new(&self.at, lobe, choice));
            points.push(point);
        }
        self.at.scene.tlas.sample_many(&mut walks, first);
        for (leaf, _) in walks.iter().filter_map(Descent::leaf) {
            self.at.scene.lights.prefetch(leaf);
        }
        for (walk, point) in walks.iter().zip(points) {
            let sample = walk.leaf().and_then(|(leaf, pmf)| self.sample_on((LightLeaf::alone(leaf), pmf), point));
            visit(sample);
        }
    }
}
