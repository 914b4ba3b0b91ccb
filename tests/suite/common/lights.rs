//! Samplers of all arities.

use fanlight::{
    Arity, Hit, LightSample, LightSampler, LightSamplerView, PointSampler, ShadingPoint, Splitting, TriangleId,
};
use glam::Vec3;

use super::scene::Scene;

/// The arities that are tested.
pub(crate) const ARITIES: [Arity; 3] = [Arity::Eight, Arity::Four, Arity::Sixteen];

/// Bytes at an address that suits `from_bytes`.
pub(crate) fn aligned(bytes: &[u8]) -> Vec<u32> {
    assert!(bytes.len() % 4 == 0);
    bytes.chunks_exact(4).map(bytemuck::pod_read_unaligned).collect()
}

/// A sampler of an arity.
pub(crate) fn build(scene: &Scene, arity: Arity) -> LightSampler {
    scene.build(arity)
}

/// Samples of the same sampler after a round trip through bytes, all at once.
pub(crate) fn sample_from_bytes(
    lights: &LightSampler,
    points: &[(ShadingPoint, [f32; 3])],
) -> Vec<Option<LightSample>> {
    let words = aligned(&lights.to_bytes());
    let view = LightSamplerView::from_bytes(bytemuck::cast_slice(&words)).expect("its own bytes load");
    let mut samples = vec![None; points.len()];
    view.sample_many(points, &mut samples);
    samples
}

/// Samples of a split tree.
pub(crate) fn sample_split(at: &PointSampler<'_>, u: [f32; 3], splitting: &Splitting) -> Vec<LightSample> {
    let mut samples = Vec::new();
    at.sample_split(u, splitting, &mut samples);
    samples
}

/// The calls at one shading point: those of the crate, or of a twin that is wrong on purpose.
pub(crate) trait Point {
    fn sample(&self, u: [f32; 3]) -> Option<LightSample>;
    fn pdf(&self, hit: &Hit) -> f32;
    fn pmf(&self, triangle: TriangleId) -> f32;
    fn pdf_direction(&self, direction: Vec3) -> f32;
    fn pdf_sample_direction(&self, sample: &LightSample) -> f32;
}

impl Point for PointSampler<'_> {
    fn sample(&self, u: [f32; 3]) -> Option<LightSample> {
        PointSampler::sample(self, u)
    }

    fn pdf(&self, hit: &Hit) -> f32 {
        PointSampler::pdf(self, hit)
    }

    fn pmf(&self, triangle: TriangleId) -> f32 {
        PointSampler::pmf(self, triangle)
    }

    fn pdf_direction(&self, direction: Vec3) -> f32 {
        PointSampler::pdf_direction(self, direction)
    }

    fn pdf_sample_direction(&self, sample: &LightSample) -> f32 {
        PointSampler::pdf_sample_direction(self, sample)
    }
}
