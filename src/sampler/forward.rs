//! The questions of [`PointSampler`](super::PointSampler), for hosts that ask only one at a point.

use glam::Vec3;
use smallvec::{Array, SmallVec};

#[cfg(doc)]
use super::PointSampler;
use super::lights::{LightSampler, LightSamplerView};
use crate::record::{Hit, LightSample, ShadingPoint, TriangleId};
use crate::tlas::Splitting;

impl<const N: usize> LightSampler<N> {
    /// See [`PointSampler::sample`].
    #[inline]
    pub fn sample(&self, x: &ShadingPoint, u: [f32; 3]) -> Option<LightSample> {
        self.at(x).sample(u)
    }

    /// See [`PointSampler::pdf`].
    #[inline]
    pub fn pdf(&self, x: &ShadingPoint, hit: &Hit) -> f32 {
        self.at(x).pdf(hit)
    }

    /// See [`PointSampler::pmf`].
    #[inline]
    pub fn pmf(&self, x: &ShadingPoint, triangle: TriangleId) -> f32 {
        self.at(x).pmf(triangle)
    }

    /// See [`PointSampler::pdf_direction`].
    #[inline]
    pub fn pdf_direction(&self, x: &ShadingPoint, direction: Vec3) -> f32 {
        self.at(x).pdf_direction(direction)
    }

    /// See [`PointSampler::pdf_sample_direction`].
    #[inline]
    pub fn pdf_sample_direction(&self, x: &ShadingPoint, sample: &LightSample) -> f32 {
        self.at(x).pdf_sample_direction(sample)
    }

    /// See [`PointSampler::sample_split`].
    #[inline]
    pub fn sample_split<A: Array<Item = LightSample>>(
        &self,
        x: &ShadingPoint,
        u: [f32; 3],
        splitting: &Splitting,
        samples: &mut SmallVec<A>,
    ) {
        self.at(x).sample_split(u, splitting, samples);
    }

    /// See [`PointSampler::pdf_split`].
    #[inline]
    pub fn pdf_split(&self, x: &ShadingPoint, hit: &Hit, splitting: &Splitting) -> f32 {
        self.at(x).pdf_split(hit, splitting)
    }

    /// See [`PointSampler::pdf_split_direction`].
    #[inline]
    pub fn pdf_split_direction(&self, x: &ShadingPoint, direction: Vec3, splitting: &Splitting) -> f32 {
        self.at(x).pdf_split_direction(direction, splitting)
    }
}

impl<const N: usize> LightSamplerView<'_, N> {
    /// See [`PointSampler::sample`].
    #[inline]
    pub fn sample(&self, x: &ShadingPoint, u: [f32; 3]) -> Option<LightSample> {
        self.at(x).sample(u)
    }

    /// See [`PointSampler::pdf`].
    #[inline]
    pub fn pdf(&self, x: &ShadingPoint, hit: &Hit) -> f32 {
        self.at(x).pdf(hit)
    }

    /// See [`PointSampler::pmf`].
    #[inline]
    pub fn pmf(&self, x: &ShadingPoint, triangle: TriangleId) -> f32 {
        self.at(x).pmf(triangle)
    }

    /// See [`PointSampler::pdf_direction`].
    #[inline]
    pub fn pdf_direction(&self, x: &ShadingPoint, direction: Vec3) -> f32 {
        self.at(x).pdf_direction(direction)
    }

    /// See [`PointSampler::pdf_sample_direction`].
    #[inline]
    pub fn pdf_sample_direction(&self, x: &ShadingPoint, sample: &LightSample) -> f32 {
        self.at(x).pdf_sample_direction(sample)
    }

    /// See [`PointSampler::sample_split`].
    #[inline]
    pub fn sample_split<A: Array<Item = LightSample>>(
        &self,
        x: &ShadingPoint,
        u: [f32; 3],
        splitting: &Splitting,
        samples: &mut SmallVec<A>,
    ) {
        self.at(x).sample_split(u, splitting, samples);
    }

    /// See [`PointSampler::pdf_split`].
    #[inline]
    pub fn pdf_split(&self, x: &ShadingPoint, hit: &Hit, splitting: &Splitting) -> f32 {
        self.at(x).pdf_split(hit, splitting)
    }

    /// See [`PointSampler::pdf_split_direction`].
    #[inline]
    pub fn pdf_split_direction(&self, x: &ShadingPoint, direction: Vec3, splitting: &Splitting) -> f32 {
        self.at(x).pdf_split_direction(direction, splitting)
    }
}
