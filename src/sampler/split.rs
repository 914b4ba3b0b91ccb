//! Several points on the lights at once.

use glam::Vec3;
use smallvec::{Array, SmallVec};

use super::at::PointSampler;
use super::sample::to_finite;
use crate::record::{Hit, LightSample};
use crate::tlas::Splitting;
use crate::warp::{Variate, seed};

impl<const N: usize> PointSampler<'_, N> {
    /// Draws one point from each part of the light tree that adaptive splitting visits (Conty Estevez and Kulla
    /// 2018), and one towards a sun if any is seen, and appends them to `samples`, which allocates only if they do not fit inline.
    ///
    /// The estimate is the *sum* of `f / pdf` over the samples: `pdf` and `pdf_area` are expected densities, the
    /// expected number of samples per measure, and `pmf` the expected number on that triangle.
    pub fn sample_split<A: Array<Item = LightSample>>(
        &self,
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
        let this = &self.side_by_side();
        let mut visits = 0;
        self.lights.tlas.sample_split(
            &self.x,
            &self.lights.scene(&self.x),
            splitting,
            |draw| variate(draw, 0),
            |leaf, count| {
                let point = [variate(visits, 1), variate(visits, 2)];
                samples.extend(this.sample_on(leaf, count, point));
                visits += 1;
            },
        );
        // A draw that no part of the tree has.
        let last = u32::MAX >> 2;
        if let Some(sun) = this.techniques.choose_sun(&mut variate(last, 0)) {
            let point = [variate(last, 1), variate(last, 2)];
            samples.extend(this.sample_sun(sun, point, Some(splitting)));
        }
    }

    /// Expected density per solid angle of the samples of [`Self::sample_split`] at a point of a triangle, for
    /// multiple importance sampling.
    pub fn pdf_split(&self, hit: &Hit, splitting: &Splitting) -> f32 {
        self.side_by_side().pdf_of_hit(hit, Some(splitting))
    }

    /// Expected density per solid angle of the samples of [`Self::sample_split`] in a direction: the sum over all
    /// points that the ray crosses.
    pub fn pdf_split_direction(&self, direction: Vec3, splitting: &Splitting) -> f32 {
        to_finite(self.side_by_side().direction_density(direction, None, Some(splitting)))
    }

    /// The trees in any case, and one of the suns next to them.
    fn side_by_side(&self) -> Self {
        let mut this = *self;
        this.techniques.put_side_by_side();
        this
    }
}
