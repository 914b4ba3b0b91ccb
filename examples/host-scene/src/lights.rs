//! All that it takes to light `rust-pathtracer` through `fanlight`.
//!
//! The renderer chooses among spheres by itself and hands nothing over. But it asks the scene what a ray hits, and adds
//! the material's emission: light that `fanlight` finds at a point is such an emission. The renderer's state still
//! holds the vertex before, so that its own rays that hit a lamp are weighted with the density that `fanlight` had
//! there.

use fanlight::glam::Vec3;
use fanlight::{Error, LightId, LightSampler, PointSampler, SampledLight, ShadingPoint, SphereLight};
use rand::Rng;
use rust_pathtracer::prelude::{AnalyticalLight, F3, Ray, State};

/// How far from a surface the renderer's rays start. *Format*: its own constant.
const OFFSET: f32 = 0.005;

/// The lamps of a scene.
pub(crate) struct Lights {
    sampler: LightSampler,
    ids: Vec<LightId>,
}

impl Lights {
    pub(crate) fn new(lamps: &[AnalyticalLight]) -> Result<Self, Error> {
        let mut builder = LightSampler::builder();
        let mut ids = Vec::new();
        for AnalyticalLight { light } in lamps {
            ids.push(builder.add_light(SphereLight::new(vector(light.position), light.radius, light.emission.y))?);
        }
        Ok(Self { sampler: builder.build()?, ids })
    }

    fn at(&self, state: &State) -> PointSampler<'_> {
        let normal = vector(state.ffnormal);
        self.sampler.at(&ShadingPoint::surface(vector(state.fhp) + OFFSET * normal, normal))
    }

    /// Light that a diffuse point reflects along a ray back to its start, by one sample.
    pub(crate) fn reflected(
        &self,
        ray: &Ray,
        state: &State,
        lamps: &[AnalyticalLight],
        scene: impl Fn(&Ray, f32) -> bool,
    ) -> F3 {
        let Some(sample) = self.at(state).sample(rand::thread_rng().r#gen()) else { return F3::zeros() };
        let SampledLight::Shape(id) = sample.light else { return F3::zeros() };
        let normal = vector(state.ffnormal);
        let start = state.fhp + OFFSET * state.ffnormal;
        let direction = F3::new(sample.direction.x, sample.direction.y, sample.direction.z);
        let cosine = normal.dot(sample.direction);
        if cosine <= 0.0 || scene(&Ray::new(start, direction), sample.distance - OFFSET) {
            return F3::zeros();
        }
        let by_surface = cosine / core::f32::consts::PI;
        let weight = sample.pdf * sample.pdf / (sample.pdf * sample.pdf + by_surface * by_surface);
        let f = diffuse(
            cosine,
            -vector(ray.direction).dot(normal),
            sample.direction - vector(ray.direction),
            sample.direction,
        );
        let scale = f * cosine * weight / sample.pdf;
        scale * lamps[id.index() as usize].light.emission * state.material.rgb
    }

    /// Density with which the vertex before has found a lamp in a direction, or one for rays of the camera.
    pub(crate) fn pdf(&self, state: &State, lamp: usize, direction: F3) -> f32 {
        if state.hit_dist < 0.0 {
            return 1.0;
        }
        self.at(state).pdf_light(self.ids[lamp], vector(direction))
    }
}

/// The renderer's diffuse lobe (Burley 2012) for a roughness of one half.
fn diffuse(cosine: f32, outgoing: f32, half: Vec3, direction: Vec3) -> f32 {
    let along = half.normalize().dot(direction);
    let most = 0.5 + along * along;
    let share = |cosine: f32| 1.0 + (most - 1.0) * (1.0 - cosine).clamp(0.0, 1.0).powi(5);
    share(cosine) * share(outgoing) / core::f32::consts::PI
}

pub(crate) fn vector(v: F3) -> Vec3 {
    Vec3::new(v.x, v.y, v.z)
}
