//! One of several samples, chosen by a target of the host's: resampled importance sampling (Talbot, Cline and Egbert
//! 2005).
//!
//! With M candidates `y_j` of the densities `p(y_j)` and a target `t`, a candidate is chosen in proportion to its
//! weight `w_j = t(y_j) / p(y_j)`, and gets the contribution weight
//!
//! ```text
//! W = (w_1 + ... + w_M) / (M t(y))
//! ```
//!
//! For any integrand `f` that is zero wherever the target is, the expectation of `f(y) W` is, first over the choice and
//! then over the candidates,
//!
//! ```text
//! E[ Σ_j (w_j / Σ w) f(y_j) (Σ w) / (M t(y_j)) ] = E[ 1/M Σ_j f(y_j) / p(y_j) ] = ∫ f
//! ```
//!
//! so that the estimate is unbiased for any M. The better the target matches the integrand, the less noise is left.

use super::point::PointSampler;
use crate::math::{at_least, at_most};
use crate::record::LightSample;
use crate::warp::{Variate, seed};

/// Least weight of a candidate with a positive target. *Proved*: what underflows stays possible, and the sum of any
/// number of candidates that there can be is finite.
const LEAST_CANDIDATE_WEIGHT: f64 = 1e-200;

/// A sample that was chosen among several candidates: see [`PointSampler::sample_resampled`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ResampledLight {
    /// The candidate that was chosen. Its densities are those of [`PointSampler::sample`], and *not* those of the
    /// choice, which nobody knows.
    pub sample: LightSample,
    /// Unbiased contribution weight: what stands in the estimate in the place of one over a density per solid angle.
    /// Positive and finite.
    pub weight: f32,
}

impl PointSampler<'_> {
    /// Draws a candidate for each element of `numbers`, as [`sample`](Self::sample) does, and chooses one in proportion
    /// to `target` over its density. `choice` is uniform in `[0, 1)`. Where there are many lights, the candidates' walks
    /// through the tree are interleaved.
    ///
    /// The target is the host's: what a candidate is expected to contribute per solid angle if nothing is in between,
    /// such as luminance of light times BSDF times cosine. It must be positive wherever the true contribution can be.
    /// What is negative or NaN counts as zero, and an infinite one as a large number. Candidates that are `None` count
    /// as well, as zeros.
    ///
    /// The estimate is `f(sample) * weight`, with `f` as it would be divided by the density of a single sample. It is
    /// unbiased for any number of candidates and any target. A sample on an emitter stands for its point alone. A
    /// sample on a portal, or on the environment as a light, stands for all of the environment that arrives along its
    /// direction, and for no emitter on the way: those have samples of their own. The pair of sample and weight is the
    /// initial candidate of reservoir methods (Bitterli et al. 2020).
    ///
    /// For multiple importance sampling there is no density of the result, and one over the weight must not stand in
    /// for it: it is random. But the weights of the techniques may be any functions of the direction that add up to 1.
    /// So take those of the balance heuristic with the density of *one* candidate, multiply both estimates by them, and
    /// put the same weight into the target if it matters.
    ///
    /// Returns `None` where no candidate has a positive target; that counts as a sample of zero.
    ///
    /// ```
    /// use fanlight::{LightSample, LightSampler, Mesh, ShadingPoint, glam::Vec3};
    ///
    /// let lamp = [Vec3::Z, Vec3::new(0.0, 1.0, 1.0), Vec3::new(1.0, 0.0, 1.0)];
    /// let lights = LightSampler::builder().mesh(&Mesh::emitter(&lamp, &[[0, 1, 2]]))?.build()?;
    /// let here = lights.at(&ShadingPoint::surface(Vec3::ZERO, Vec3::Z));
    /// // A BSDF that the crate does not know, and a crude guess of it.
    /// let reflected = |s: &LightSample| s.direction.z * (1.0 + 20.0 * s.direction.x.powi(4));
    /// let guess = |s: &LightSample| 0.1 + s.direction.x;
    ///
    /// let mut state = 1_u64;
    /// let mut random = || {
    ///     state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    ///     (state >> 40) as f32 / 16_777_216.0
    /// };
    /// let (mut plain, mut resampled, count) = (0.0, 0.0, 40_000);
    /// for _ in 0..count {
    ///     let numbers: [[f32; 3]; 8] = core::array::from_fn(|_| [random(), random(), random()]);
    ///     if let Some(sample) = here.sample(numbers[0]) {
    ///         plain += f64::from(reflected(&sample) / sample.pdf);
    ///     }
    ///     if let Some(chosen) = here.sample_resampled(&numbers, random(), guess) {
    ///         resampled += f64::from(reflected(&chosen.sample) * chosen.weight);
    ///     }
    /// }
    /// // Both have the same mean.
    /// assert!((resampled / plain - 1.0).abs() < 0.01);
    /// # Ok::<(), fanlight::Error>(())
    /// ```
    #[must_use]
    pub fn sample_resampled(
        &self,
        numbers: &[[f32; 3]],
        choice: f32,
        mut target: impl FnMut(&LightSample) -> f32,
    ) -> Option<ResampledLight> {
        let mut choice = Variate::new(choice, seed(&[choice]));
        let (mut chosen, mut sum) = (None, 0.0);
        self.sample_all(numbers, |candidate| {
            let Some(sample) = candidate else { return };
            let value = f64::from(at_most(at_least(target(&sample), 0.0), f32::MAX));
            if value == 0.0 {
                return;
            }
            let weight = (value / f64::from(self.density_of_contribution(&sample))).max(LEAST_CANDIDATE_WEIGHT);
            // A reservoir of one: the new candidate takes the place with the probability of its share.
            let total = sum + weight;
            let offset = choice.value() * total;
            if offset < weight {
                choice.stretch(offset, weight, total);
                chosen = Some((sample, value));
            } else {
                choice.stretch(offset - weight, sum, total);
            }
            sum = total;
        });
        chosen.map(|(sample, value)| {
            let weight = sum / (numbers.len() as f64 * value);
            ResampledLight { sample, weight: (weight as f32).clamp(f32::MIN_POSITIVE, f32::MAX) }
        })
    }

    /// Density of what a sample stands for: the point of an emitter, or the direction.
    fn density_of_contribution(&self, sample: &LightSample) -> f32 {
        let lights = &self.at.scene.lights;
        let emits = lights.leaf_of_sampled(&sample.light).is_some_and(|leaf| !lights.is_portal(leaf));
        if emits { sample.pdf } else { self.pdf_sample_direction(sample) }
    }
}
