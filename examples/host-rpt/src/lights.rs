//! All that it takes to light `rpt` through `fanlight`.

use fanlight::glam::{Vec2, Vec3};
use fanlight::{Error, LightSampler, Mesh, ShadingPoint, Texture, Weight};
use rand::{Rng, rngs::StdRng};
use rpt::glm::{self, DVec3};
use rpt::{HitRecord, Ray, Shape};

use crate::emitter::{Emitter, SIZE};

/// The emitters of a scene, as one shape that `rpt` asks for points.
pub(crate) struct Lights {
    sampler: LightSampler,
    emitters: Vec<Emitter>,
}

impl Lights {
    pub(crate) fn new(emitters: Vec<Emitter>) -> Result<Self, Error> {
        let positions = |emitter: &Emitter| emitter.positions.iter().map(|p| to_f32(*p)).collect::<Vec<_>>();
        let uvs = |emitter: &Emitter| emitter.uvs.iter().map(|uv| Vec2::from(*uv)).collect::<Vec<_>>();
        let mut builder = LightSampler::builder();
        for emitter in &emitters {
            let weight = Weight::Texture(builder.add_texture(Texture::new(SIZE[0], SIZE[1], &emitter.image)?));
            builder
                .add_mesh(&Mesh::emitter(&positions(emitter), &emitter.indices).uvs(&uvs(emitter)).weight(weight))?;
        }
        let sampler = builder.build()?;
        Ok(Self { sampler, emitters })
    }
}

impl Shape for Lights {
    /// Lights are invisible in `rpt`.
    fn intersect(&self, _: &Ray, _: f64, _: &mut HitRecord) -> bool {
        false
    }

    /// A point, its normal, and its density per area. `rpt` knows a single radiance for a shape, so that the one of
    /// this point goes into the density. It does not say which way the surface faces that is lit.
    fn sample(&self, target: &DVec3, rng: &mut StdRng) -> (DVec3, DVec3, f64) {
        let sample = self.sampler.at(&ShadingPoint::volume(to_f32(*target))).sample(rng.r#gen());
        let Some((sample, hit)) = sample.and_then(|sample| Some((sample, sample.hit()?))) else {
            // A sample of zero, in a direction that is in the plane of no surface: `rpt` would divide by a cosine.
            let direction = glm::vec3(0.48, 0.64, 0.6);
            return (target + direction, direction, f64::INFINITY);
        };
        let triangle = hit.triangle;
        let radiance = self.emitters[triangle.mesh.index() as usize].radiance(triangle.triangle, hit.barycentrics);
        (to_f64(sample.position), to_f64(sample.normal), f64::from(sample.pdf_area) / radiance)
    }
}

fn to_f32(v: DVec3) -> Vec3 {
    Vec3::new(v.x as f32, v.y as f32, v.z as f32)
}

fn to_f64(v: Vec3) -> DVec3 {
    glm::vec3(v.x.into(), v.y.into(), v.z.into())
}
