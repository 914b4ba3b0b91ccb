//! Samplers of all arities behind one face.

use fanlight::{Hit, LightSample, LightSampler, LightSamplerView, PointSampler, ShadingPoint, Splitting, TriangleId};
use glam::Vec3;
use smallvec::SmallVec;

use super::scene::Scene;

/// The calls that the tests make, of any arities.
pub(crate) trait Lights: Sync {
    fn at<'a>(&'a self, x: &ShadingPoint) -> Box<dyn Point + 'a>;
    fn sample(&self, x: &ShadingPoint, u: [f32; 3]) -> Option<LightSample>;
    fn pdf(&self, x: &ShadingPoint, hit: &Hit) -> f32;
    fn pmf(&self, x: &ShadingPoint, triangle: TriangleId) -> f32;
    fn pdf_direction(&self, x: &ShadingPoint, direction: Vec3) -> f32;
    fn pdf_sample_direction(&self, x: &ShadingPoint, sample: &LightSample) -> f32;
    fn pdf_split(&self, x: &ShadingPoint, hit: &Hit, splitting: &Splitting) -> f32;
    fn pdf_split_direction(&self, x: &ShadingPoint, direction: Vec3, splitting: &Splitting) -> f32;
    fn sample_split(&self, x: &ShadingPoint, u: [f32; 3], splitting: &Splitting) -> SmallVec<[LightSample; 16]>;
    fn to_bytes(&self) -> Vec<u8>;
    /// Samples of the same sampler after a round trip through bytes, all at once.
    fn sample_from_bytes(&self, points: &[(ShadingPoint, [f32; 3])]) -> Vec<Option<LightSample>>;
}

impl<const N: usize> Lights for LightSampler<N> {
    fn at<'a>(&'a self, x: &ShadingPoint) -> Box<dyn Point + 'a> {
        Box::new(LightSampler::at(self, x))
    }

    fn sample(&self, x: &ShadingPoint, u: [f32; 3]) -> Option<LightSample> {
        LightSampler::sample(self, x, u)
    }

    fn pdf(&self, x: &ShadingPoint, hit: &Hit) -> f32 {
        LightSampler::pdf(self, x, hit)
    }

    fn pmf(&self, x: &ShadingPoint, triangle: TriangleId) -> f32 {
        LightSampler::pmf(self, x, triangle)
    }

    fn pdf_direction(&self, x: &ShadingPoint, direction: Vec3) -> f32 {
        LightSampler::pdf_direction(self, x, direction)
    }

    fn pdf_sample_direction(&self, x: &ShadingPoint, sample: &LightSample) -> f32 {
        LightSampler::pdf_sample_direction(self, x, sample)
    }

    fn pdf_split(&self, x: &ShadingPoint, hit: &Hit, splitting: &Splitting) -> f32 {
        LightSampler::pdf_split(self, x, hit, splitting)
    }

    fn pdf_split_direction(&self, x: &ShadingPoint, direction: Vec3, splitting: &Splitting) -> f32 {
        LightSampler::pdf_split_direction(self, x, direction, splitting)
    }

    fn sample_split(&self, x: &ShadingPoint, u: [f32; 3], splitting: &Splitting) -> SmallVec<[LightSample; 16]> {
        let mut samples = SmallVec::new();
        LightSampler::sample_split(self, x, u, splitting, &mut samples);
        samples
    }

    fn to_bytes(&self) -> Vec<u8> {
        LightSampler::to_bytes(self)
    }

    fn sample_from_bytes(&self, points: &[(ShadingPoint, [f32; 3])]) -> Vec<Option<LightSample>> {
        let words = aligned(&self.to_bytes());
        let view = LightSamplerView::<N>::from_bytes(bytemuck::cast_slice(&words)).expect("its own bytes load");
        let mut samples = vec![None; points.len()];
        view.sample_many(points, &mut samples);
        samples
    }
}

/// The calls at one shading point.
pub(crate) trait Point {
    fn sample(&self, u: [f32; 3]) -> Option<LightSample>;
    fn pdf(&self, hit: &Hit) -> f32;
    fn pmf(&self, triangle: TriangleId) -> f32;
    fn pdf_direction(&self, direction: Vec3) -> f32;
    fn pdf_sample_direction(&self, sample: &LightSample) -> f32;
}

impl<const N: usize> Point for PointSampler<'_, N> {
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

/// Bytes at an address that suits `from_bytes`.
pub(crate) fn aligned(bytes: &[u8]) -> Vec<u32> {
    assert!(bytes.len().is_multiple_of(4));
    bytes.chunks_exact(4).map(bytemuck::pod_read_unaligned).collect()
}

/// The arities that are tested: of the tree over triangles, and of the trees over textures.
pub(crate) const ARITIES: [(usize, usize); 3] = [(8, 4), (4, 4), (16, 4)];

/// A sampler of these arities.
pub(crate) fn build(scene: &Scene, arities: (usize, usize)) -> Box<dyn Lights> {
    match arities {
        (4, 4) => Box::new(scene.build::<4>()),
        (8, 4) => Box::new(scene.build::<8>()),
        (16, 4) => Box::new(scene.build::<16>()),
        _ => unreachable!("no such arities are tested"),
    }
}
