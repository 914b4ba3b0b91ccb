//! The crate itself.

use ::fanlight::{Arity, Effort, Hit, Illumination, LightSample, LightSampler, Mesh, ShadingPoint, Weight};

use super::{Drawn, Method};
use crate::scenes::sky::environment;
use crate::scenes::{Scene, Weight as SceneWeight};

/// The crate's sampler of a scene.
pub(crate) struct Fanlight<'a> {
    scene: &'a Scene,
    sampler: LightSampler,
    /// Whether a ray can cross several portals, so that the density of a point is not that of its direction.
    layered: bool,
    effort: Effort,
}

impl<'a> Fanlight<'a> {
    /// The crate with its defaults.
    pub(crate) fn new(scene: &'a Scene) -> Self {
        Self::with(scene, Arity::default(), Illumination::default())
    }

    /// The crate with an arity of the tree over triangles, and a term inside of triangles.
    pub(crate) fn with(scene: &'a Scene, arity: Arity, illumination: Illumination) -> Self {
        let mut builder = LightSampler::builder().arity(arity).illumination(illumination);
        if let Some(sky) = &scene.sky {
            builder = builder.environment(environment(&sky.texels));
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
        Self { scene, sampler, layered: scene.walls.len() > 1, effort: Effort::Full }
    }

    /// The crate with an effort at all points.
    pub(crate) fn with_effort(self, effort: Effort) -> Self {
        Self { effort, ..self }
    }
}

impl Fanlight<'_> {
    pub(crate) fn sampler(&self) -> &LightSampler {
        &self.sampler
    }

    /// One of several samples, chosen by a target per solid angle, and its contribution weight. No ray may cross
    /// several portals.
    pub(crate) fn resampled(
        &self,
        x: &ShadingPoint,
        numbers: &[[f32; 3]],
        choice: f32,
        target: impl Fn(&Drawn) -> f64,
    ) -> Option<(Drawn, f64)> {
        assert!(!self.layered, "the density of a point is that of its direction");
        let target = |sample: &LightSample| target(&self.drawn(sample, sample.pdf)) as f32;
        let chosen = self.sampler.at(x).sample_resampled(numbers, choice, target)?;
        Some((self.drawn(&chosen.sample, chosen.sample.pdf), f64::from(chosen.weight)))
    }

    /// A sample as all methods return it.
    #[inline]
    pub(crate) fn drawn(&self, sample: &LightSample, pdf: f32) -> Drawn {
        Drawn {
            light: self.scene.light_index(sample.hit().expect("a triangle").triangle),
            barycentrics: sample.hit().expect("a triangle").barycentrics,
            direction: sample.direction,
            pdf: f64::from(pdf),
            radiance: None,
        }
    }
}

impl Method for Fanlight<'_> {
    #[inline]
    fn sample(&self, x: &ShadingPoint, u: [f32; 3]) -> Option<Drawn> {
        let here = self.sampler.at(&x.with_effort(self.effort));
        let sample = here.sample(u)?;
        let pdf = if self.layered { here.pdf_sample_direction(&sample) } else { sample.pdf };
        Some(self.drawn(&sample, pdf))
    }

    /// For emitters `at` and `sample`; for portals, whatever their layers, the density of the direction as well.
    #[inline]
    fn call(&self, x: &ShadingPoint, u: [f32; 3]) -> Option<f64> {
        let here = self.sampler.at(&x.with_effort(self.effort));
        let sample = here.sample(u)?;
        let pdf = if self.scene.sky.is_some() { here.pdf_sample_direction(&sample) } else { sample.pdf };
        Some(f64::from(pdf))
    }

    #[inline]
    fn pdf(&self, x: &ShadingPoint, drawn: &Drawn) -> f64 {
        let here = self.sampler.at(&x.with_effort(self.effort));
        if self.layered {
            return f64::from(here.pdf_direction(drawn.direction));
        }
        let hit = Hit::new(self.scene.lights[drawn.light].id, drawn.barycentrics);
        f64::from(here.pdf(&hit))
    }

    fn pmfs(&self, x: &ShadingPoint, wanted: &dyn Fn(usize) -> bool) -> Option<Vec<f64>> {
        let here = self.sampler.at(&x.with_effort(self.effort));
        let pmf = |l: usize| if wanted(l) { here.pmf(self.scene.lights[l].id) } else { 0.0 };
        Some((0..self.scene.lights.len()).map(|l| f64::from(pmf(l))).collect())
    }

    fn bytes(&self) -> usize {
        self.sampler.bytes().total()
    }

    fn draws_suns_apart(&self) -> bool {
        self.scene.sky.as_ref().is_some_and(|sky| !sky.sun.is_empty())
    }
}
