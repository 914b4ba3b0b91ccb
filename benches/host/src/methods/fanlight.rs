//! Every call of `fanlight` is in this file: emitters and sky as the crate's documentation recommends.
//!
//! One sampler holds the emitters and the portals, and the sky where no portal leads to it. A sample on an emitter
//! stands for that point alone; a sample on a portal stands for the sky along the direction, through whatever portals
//! the ray crosses.

use fanlight::{
    Effort, Environment, Filter, Glossy, Hit, LightSample, LightSampler, LightSamplerView, Mesh, MeshId, PointSampler,
    SampledLight, ShadingPoint, Texture, TriangleId, Visibility, Weight, Wrap,
};
use glam::Vec3;

use super::{Lighting, LightsHere, Proposal, Target};
use crate::Error;
use crate::bsdf::{Material, Vertex};
use crate::integrator::random_vertex;
use crate::random::Pcg32;
use crate::scene::Radiance;
use crate::world::{EmitterPoint, World};

/// A point at which nothing arrives.
const NOWHERE: ShadingPoint = ShadingPoint::volume(Vec3::splat(f32::NAN));

/// The lights of a scene.
pub(super) struct Fanlight {
    lights: LightSamplerView<'static>,
    /// What the sampler calls each triangle of the emitters.
    ids: Vec<TriangleId>,
    /// The number of the first triangle of each emitter among all of them.
    starts: Vec<u32>,
    /// Whether the sky is a light itself, as no portal leads to it.
    open_sky: bool,
    /// Whether glossy surfaces are passed as such.
    tells_lobes: bool,
    /// How much a call may do at the first vertex of a path, and at later ones.
    efforts: [Effort; 2],
}

impl Fanlight {
    /// Hands the lights of a scene over.
    pub(super) fn new(world: &World) -> Result<Self, Error> {
        let scene = &world.scene;
        let mut builder = LightSampler::builder();
        if let Some(sky) = &scene.sky {
            let environment =
                Environment::from_lat_long(sky.image().width, sky.image().height, &sky.luminance(), Filter::Bilinear)?;
            builder = builder.environment(environment.with_rotation(sky.rotation())?);
        }
        let open_sky = scene.sky.is_some() && scene.portals.is_empty();
        if open_sky {
            builder = builder.environment_as_light();
        }
        for emitter in &scene.emitters {
            let mesh = Mesh::emitter(&emitter.mesh.positions, &emitter.mesh.indices);
            let weight = match &emitter.radiance {
                Radiance::Constant(radiance) => Weight::Constant(*radiance),
                Radiance::Textured(texture) => {
                    let image = Texture::new(texture.size, texture.size, &texture.texels)?;
                    Weight::Texture(builder.add_texture(image.wrap(Wrap::Clamp, Wrap::Clamp)))
                }
            };
            builder.add_mesh(&mesh.uvs(&emitter.mesh.uvs).weight(weight))?;
        }
        for portal in &scene.portals {
            builder.add_mesh(&Mesh::portal(&portal.mesh.positions, &portal.mesh.indices))?;
        }
        let ids = world.emitters.iter().map(|e| TriangleId::new(MeshId::from_index(e.mesh), e.triangle));
        let starts = scene.emitters.iter().scan(0, |next, emitter| {
            let first = *next;
            *next += emitter.mesh.indices.len() as u32;
            Some(first)
        });
        // A frame's view, as a renderer keeps it. The few scenes of a run stay in memory until its end.
        let lights: &'static LightSampler = Box::leak(Box::new(builder.build()?));
        Ok(Self {
            lights: lights.as_view(),
            ids: ids.collect(),
            starts: starts.collect(),
            open_sky,
            tells_lobes: true,
            efforts: [Effort::Full; 2],
        })
    }

    /// Returns the same without lobes: all surfaces are taken for diffuse ones.
    pub(super) fn blind(self) -> Self {
        Self { tells_lobes: false, ..self }
    }

    /// Returns the same with an effort at the first vertex of a path, and another at later ones.
    pub(super) fn with_efforts(self, efforts: [Effort; 2]) -> Self {
        Self { efforts, ..self }
    }

    /// Returns the same with what walls hide, learned at vertices of paths through the camera.
    pub(super) fn learned(mut self, world: &World, bounces: u32, rays: u64) -> Result<Self, Error> {
        let point = |i: u64| {
            let vertex = random_vertex(world, bounces, &mut Pcg32::new(i, 2000));
            vertex.map_or(NOWHERE, |vertex| self.shading_point(&vertex))
        };
        let transmittance = |x: &ShadingPoint, sample: &LightSample| {
            let is_emitter =
                sample.hit().is_some_and(|hit| (hit.triangle.mesh.index() as usize) < world.scene.emitters.len());
            let is_seen = if is_emitter {
                world.sees(x.position, sample.position)
            } else {
                world.sees_sky(x.position, sample.direction)
            };
            f32::from(u8::from(is_seen))
        };
        let visibility: &'static Visibility =
            Box::leak(Box::new(Visibility::learn(&self.lights, rays, point, transmittance)?));
        self.lights = self.lights.with_visibility(visibility.as_view())?;
        Ok(self)
    }

    /// Returns what the crate is told of a vertex.
    #[inline]
    fn shading_point(&self, vertex: &Vertex) -> ShadingPoint {
        let point = match vertex.material {
            Material::Glossy { alpha, .. } if self.tells_lobes => {
                ShadingPoint::glossy(vertex.position, Glossy::new(vertex.normal, vertex.outgoing, alpha))
            }
            _ => ShadingPoint::surface(vertex.position, vertex.normal),
        };
        point.with_effort(self.efforts[usize::from(vertex.depth > 0)])
    }
}

/// The lights as seen from a vertex.
pub(super) struct Here<'a> {
    fanlight: &'a Fanlight,
    lights: PointSampler<'a>,
}

impl Lighting for Fanlight {
    type Here<'a> = Here<'a>;

    #[inline]
    fn at(&self, vertex: &Vertex) -> Here<'_> {
        Here { fanlight: self, lights: self.lights.at(&self.shading_point(vertex)) }
    }
}

impl LightsHere for Here<'_> {
    #[inline]
    fn propose(&self, random: &mut Pcg32, mut visit: impl FnMut(Proposal)) {
        let Some(sample) = self.lights.sample(random.uniform3()) else { return };
        let (target, pdf) = match sample.light {
            SampledLight::Triangle(Hit { triangle: TriangleId { mesh, triangle, .. }, barycentrics, .. }) => {
                match self.fanlight.starts.get(mesh.index() as usize) {
                    Some(first) => {
                        let point =
                            EmitterPoint { triangle: first + triangle, barycentrics, position: sample.position };
                        (Target::Emitter(point), sample.pdf)
                    }
                    None => (Target::Sky, self.lights.pdf_sample_direction(&sample)),
                }
            }
            SampledLight::Environment => (Target::Sky, sample.pdf),
            _ => return,
        };
        visit(Proposal { direction: sample.direction, target, pdf });
    }

    #[inline]
    fn sky_pdf(&self, direction: Vec3) -> f32 {
        if self.fanlight.open_sky {
            self.lights.pdf_environment(direction)
        } else {
            self.lights.pdf_direction(direction)
        }
    }

    #[inline]
    fn emitter_pdf(&self, point: &EmitterPoint, _: Vec3) -> f32 {
        let triangle = self.fanlight.ids[point.triangle as usize];
        self.lights.pdf(&Hit::new(triangle, point.barycentrics))
    }
}
