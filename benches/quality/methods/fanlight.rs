//! The crate itself.

use ::fanlight::{
    Arity, Hit, Illumination, LightSample, LightSampler, LightSamplerBuilder, Mesh, ShadingPoint, Weight,
};

use super::{Drawn, Method};
use crate::scenes::sky::environment;
use crate::scenes::{Scene, Weight as SceneWeight};

pub(crate) struct Fanlight<'a> {
    scene: &'a Scene,
    sampler: LightSampler,
    /// Whether a ray can cross several portals, so that the density of a point is not that of its direction.
    layered: bool,
}

impl<'a> Fanlight<'a> {
    /// The crate with its defaults, or with another term inside of triangles.
    pub(crate) fn new(scene: &'a Scene, illumination: Option<Illumination>) -> Self {
        Self::of_arity(scene, illumination, Arity::default())
    }

    /// The crate with another arity of the tree over triangles.
    pub(crate) fn of_arity(scene: &'a Scene, illumination: Option<Illumination>, arity: Arity) -> Self {
        let mut builder = LightSamplerBuilder::new();
        builder.arity(arity);
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

impl Fanlight<'_> {
    pub(crate) fn sampler(&self) -> &LightSampler {
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

impl Method for Fanlight<'_> {
    #[inline]
    fn sample(&self, x: &ShadingPoint, u: [f32; 3]) -> Option<Drawn> {
        let sample = self.sampler.sample(x, u)?;
        let pdf = if self.layered { self.sampler.pdf_sample_direction(x, &sample) } else { sample.pdf };
        Some(self.drawn(&sample, pdf))
    }

    #[inline]
    fn pdf(&self, x: &ShadingPoint, drawn: &Drawn) -> f64 {
        if self.layered {
            return f64::from(self.sampler.pdf_direction(x, drawn.direction));
        }
        let hit = Hit { triangle: self.scene.lights[drawn.light].id, barycentrics: drawn.barycentrics };
        f64::from(self.sampler.pdf(x, &hit))
    }

    fn pmfs(&self, x: &ShadingPoint, wanted: &dyn Fn(usize) -> bool) -> Option<Vec<f64>> {
        let pmf = |l: usize| if wanted(l) { self.sampler.pmf(x, self.scene.lights[l].id) } else { 0.0 };
        Some((0..self.scene.lights.len()).map(|l| f64::from(pmf(l))).collect())
    }

    fn bytes(&self) -> usize {
        self.sampler.as_view().bytes().iter().sum()
    }

    fn draws_suns_apart(&self) -> bool {
        self.scene.sky.is_some() && !self.sampler.environment().as_view().suns().is_empty()
    }
}
