//! Several points on the lights at once.

use glam::Vec3;
use smallvec::{Array, SmallVec};

use super::lights::{LightSampler, LightSamplerView};
use super::sample::to_finite;
use crate::record::{Hit, LightSample, ShadingPoint};
use crate::tlas::Splitting;
use crate::warp::{Variate, seed};

impl<const N: usize, const M: usize> LightSampler<N, M> {
    /// See [`LightSamplerView::sample_split`].
    #[inline]
    pub fn sample_split<A: Array<Item = LightSample>>(
        &self,
        x: &ShadingPoint,
        u: [f32; 3],
        splitting: &Splitting,
        samples: &mut SmallVec<A>,
    ) {
        self.as_view().sample_split(x, u, splitting, samples);
    }

    /// See [`LightSamplerView::pdf_split`].
    #[inline]
    pub fn pdf_split(&self, x: &ShadingPoint, hit: &Hit, splitting: &Splitting) -> f32 {
        self.as_view().pdf_split(x, hit, splitting)
    }

    /// See [`LightSamplerView::pdf_split_direction`].
    #[inline]
    pub fn pdf_split_direction(&self, x: &ShadingPoint, direction: Vec3, splitting: &Splitting) -> f32 {
        self.as_view().pdf_split_direction(x, direction, splitting)
    }
}

impl<const N: usize, const M: usize> LightSamplerView<'_, N, M> {
    /// Draws one point from each part of the light tree that adaptive splitting visits (Conty Estevez and Kulla
    /// 2018), and one towards a sun if any is seen, and appends them to `samples`, which allocates only if they do not fit inline.
    ///
    /// The estimate is the *sum* of `f / pdf` over the samples: `pdf` and `pdf_area` are expected densities, the
    /// expected number of samples per measure, and `pmf` the expected number on that triangle.
    pub fn sample_split<A: Array<Item = LightSample>>(
        &self,
        x: &ShadingPoint,
        u: [f32; 3],
        splitting: &Splitting,
        samples: &mut SmallVec<A>,
    ) {
        let salt = seed(&u);
        // Every number gets a key of its own, which tells apart the draws and the three dimensions.
        let variate = |draw: u32, i: usize| {
            let key = 4 * u64::from(draw) + i as u64;
            Variate::scrambled(u[i], key, salt ^ key)
        };
        let techniques = self.techniques(x).side_by_side();
        let mut visits = 0;
        self.tlas.sample_split(
            x,
            &self.scene(x),
            splitting,
            |draw| variate(draw, 0),
            |leaf, count| {
                let point = [variate(visits, 1), variate(visits, 2)];
                samples.extend(self.sample_on(leaf, count, x, point, &techniques));
                visits += 1;
            },
        );
        // A draw that no part of the tree has.
        let last = u32::MAX >> 2;
        if let Some(sun) = techniques.choose_sun(&mut variate(last, 0)) {
            let point = [variate(last, 1), variate(last, 2)];
            samples.extend(self.sample_sun(sun, x, point, &techniques, Some(splitting)));
        }
    }

    /// Expected density per solid angle of the samples of [`Self::sample_split`] at a point of a triangle, for
    /// multiple importance sampling.
    pub fn pdf_split(&self, x: &ShadingPoint, hit: &Hit, splitting: &Splitting) -> f32 {
        self.pdf_of_hit(x, hit, &self.techniques(x).side_by_side(), Some(splitting))
    }

    /// Expected density per solid angle of the samples of [`Self::sample_split`] in a direction: the sum over all
    /// points that the ray crosses.
    pub fn pdf_split_direction(&self, x: &ShadingPoint, direction: Vec3, splitting: &Splitting) -> f32 {
        to_finite(self.direction_density(x, direction, &self.techniques(x).side_by_side(), Some(splitting)))
    }
}
