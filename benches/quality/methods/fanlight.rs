//! The crate itself.

use ::fanlight::{Hit, Illumination, LightSample, LightSampler, LightSamplerBuilder, Mesh, ShadingPoint, Weight};

use super::{Drawn, Method};
use crate::scenes::sky::environment;
use crate::scenes::{Scene, Weight as SceneWeight};

/// `N` is the arity of the tree over triangles, by default that of the crate.
pub(crate) struct Fanlight<'a, const N: usize = 16> {
    scene: &'a Scene,
    sampler: LightSampler<N>,
    /// Whether a ray can cross several portals, so that the density of a point is not that of its direction.
    layered: bool,
}

impl<'a, const N: usize> Fanlight<'a, N> {
    /// The crate with its defaults, or with another term inside of triangles.
    pub(crate) fn new(scene: &'a Scene, illumination: Option<Illumination>) -> Self {
        let mut builder = LightSamplerBuilder::new();
        if let Some(illumination) = illumination {
            builder.illumination(illumination);
        }
        if let Some(sky) = &scene.sky {
            builder.environment(environment(&sky.texels));
        }
        let texture = scene.image.as_ref().map(|image| builder.add_texture(image.texture()));
        for mesh in &scene.meshes {
            let new = if mesh.portal { Mesh::portal } else { Mesh::emitter };
            let weight = match (mesh.weight, texture) {
                (SceneWeight::Image, Some(texture)) => Weight::Texture(texture),
                (SceneWeight::Constant(weight), _) => Weight::Constant(weight),
                (SceneWeight::Image, None) => panic!("the scene has no image"),
            };
            let mesh = new(&mesh.positions, &mesh.indices).uvs(&mesh.uvs).weight(weight);
            builder.add_mesh(&mesh).expect("workloads are valid");
        }
        let sampler = builder.build().expect("workloads are valid");
        Self { scene, sampler, layered: scene.walls.len() > 1 }
    }
}

impl<const N: usize> Fanlight<'_, N> {
    pub(crate) fn sampler(&self) -> &LightSampler<N> {
        &self.sampler
    }

    /// A sample as all methods return it.
    #[inline]
    pub(crate) fn drawn(&self, sample: &LightSample, pdf: f32) -> Drawn {
        Drawn {
            light: self.scene.light_index(sample.hit.triangle),
            barycentrics: sample.hit.barycentrics,
            direction: sample.direction,
            pdf: f64::from(pdf),
            radiance: None,
        }
    }
}

impl<const N: usize> Method for Fanlight<'_, N> {
    #[inline]
    fn sample(&self, x: &ShadingPoint, u: [f32; 3]) -> Option<Drawn> {
        let sample = self.sampler.at(x).sample(u)?;
        let pdf = if self.layered { self.sampler.at(x).pdf_sample_direction(&sample) } else { sample.pdf };
        Some(self.drawn(&sample, pdf))
    }

    /// For emitters `at` and `sample`; for portals, whatever their layers, the density of the direction as well.
    #[inline]
    fn call(&self, x: &ShadingPoint, u: [f32; 3]) -> Option<f64> {
        let here = self.sampler.at(x);
        let sample = here.sample(u)?;
        let pdf = if self.scene.sky.is_some() { here.pdf_sample_direction(&sample) } else { sample.pdf };
        Some(f64::from(pdf))
    }

    #[inline]
    fn pdf(&self, x: &ShadingPoint, drawn: &Drawn) -> f64 {
        if self.layered {
            return f64::from(self.sampler.at(x).pdf_direction(drawn.direction));
        }
        let hit = Hit::new(self.scene.lights[drawn.light].id, drawn.barycentrics);
        f64::from(self.sampler.at(x).pdf(&hit))
    }

    fn pmfs(&self, x: &ShadingPoint, wanted: &dyn Fn(usize) -> bool) -> Option<Vec<f64>> {
        let pmf = |l: usize| if wanted(l) { self.sampler.at(x).pmf(self.scene.lights[l].id) } else { 0.0 };
        Some((0..self.scene.lights.len()).map(|l| f64::from(pmf(l))).collect())
    }

    fn bytes(&self) -> usize {
        self.sampler.as_view().bytes().iter().sum()
    }

    fn draws_suns_apart(&self) -> bool {
        self.scene.sky.as_ref().is_some_and(|sky| !sky.sun.is_empty())
    }
}
