//! The renderer's light sampling: every call of `fanlight` that a path or a photon makes is in this file, and what
//! guides it in `weights.rs`.

pub(crate) use fanlight::{Filter, Illumination, Wrap};

use fanlight::{
    DistantLight, Emission, LightSample, LightSampler, LightSamplerBuilder, Mesh, PointLight, PointSampler, ProfileId,
    ProfileLight, RaySegment, SampledLight, ShadingPoint, Sides, SphereLight, SpotLight, Visibility,
};
use glam::Vec3;

use super::Error;
use super::alloc::collections::{BTreeMap, BTreeSet};
use super::alloc::sync::Arc;
use super::bsdf::Bsdf;
use super::camera::Camera;
use super::lamp::{Diagram, Lamp, LampKind};
use super::material::{Lobe, Material};
use super::model::Model;
use super::random::Random;
use super::scene::Point;
use super::sky::LUMINANCE;
use super::sources::{Meshes, Passed, Sources};
use super::weights::{clear, colored, emission, environment};
use super::world::World;

/// Which random numbers points are drawn with that visibility is learned at.
const LEARNING: u64 = 99;

/// A direction worth tracing.
pub(crate) struct Proposal {
    pub(crate) direction: Vec3,
    /// The direction's density per solid angle, over all ways in which the same sampler could have chosen it.
    pub(crate) pdf: f32,
    /// What the density is for.
    pub(crate) aim: Aim,
}

/// What a direction was proposed for: nothing else that arrives from there counts.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Aim {
    /// Whatever arrives.
    Any,
    /// The sky, with what is as far away.
    Sky,
    /// The emitter's point at this distance.
    Point(f32),
    /// The lamp of this number. No ray finds it by chance, and the density is the probability of its choice.
    Lamp(usize),
}

/// The emitters, and the sky with the portals that it is seen through.
pub(crate) struct Lights {
    sampler: LightSampler,
    sources: Sources,
    passed: Passed,
    /// Whether a hit of an emitter tells which point of which light it is, and rays to the sky cross no emitter.
    knows_hits: bool,
    /// Whether the sky is one of the lights, and all that rays find which leave the scene.
    open_sky: bool,
    /// Whether the lobes of rough mirrors are told.
    tells_lobes: bool,
    /// What walls hide, if that has been learned.
    visibility: Option<Visibility>,
}

impl Lights {
    /// Passes in all that emits light or lets it in.
    pub(crate) fn new(model: &Model, illumination: Illumination) -> Result<Self, Error> {
        Self::build(model, illumination, false)
    }

    /// Passes in all that emits light or lets it in, and the sky as one more light where no portal leads to it.
    pub(crate) fn plain(model: &Model) -> Result<Self, Error> {
        let is_portal = |mesh: &super::mesh::Mesh| model.is_portal(mesh) && model.materials[mesh.material].has_holes();
        let open_sky = model.sky.is_some() && !model.meshes.iter().any(is_portal);
        Self::build(model, Illumination::default(), open_sky)
    }

    fn build(model: &Model, illumination: Illumination, open_sky: bool) -> Result<Self, Error> {
        let material = |mesh: &super::mesh::Mesh| &model.materials[mesh.material];
        let firsts =
            model.meshes.iter().scan(0, |next, mesh| Some(core::mem::replace(next, *next + mesh.indices.len())));
        let emitters: Vec<_> = model.meshes.iter().zip(firsts).filter(|(mesh, _)| material(mesh).emits()).collect();
        let flagged = model.meshes.iter().filter(|mesh| model.is_portal(mesh));
        let portals: Vec<_> = flagged.filter(|mesh| material(mesh).has_holes()).collect();

        let mut meshes = Meshes::of(model);
        // Once for each material.
        let used: BTreeSet<_> = emitters.iter().map(|(mesh, _)| mesh.material).collect();
        let emission: BTreeMap<_, _> =
            used.into_iter().map(|number| (number, emission(model, &model.materials[number]))).collect();
        let transmission: Vec<_> = portals.iter().map(|mesh| clear(model, material(mesh))).collect();
        let mut builder = LightSampler::builder().illumination(illumination).environment(environment(model)?);
        if open_sky {
            builder = builder.environment_as_light();
        }
        let has_caps = model.lamps.iter().any(|lamp| lamp.cap().is_some());
        let open_sky = open_sky && !has_caps;
        // Rays that leave through an emitter's hole have a density along all of their way.
        let counts_holes = !open_sky && (has_caps || model.sky.is_some());
        let is_vague = |mesh: &super::mesh::Mesh| mesh.bulb.is_some() || counts_holes && material(mesh).has_holes();
        let knows_hits = !emitters.iter().any(|(mesh, _)| is_vague(mesh));
        // Their numbers are those of the model.
        let mut profiles = BTreeMap::new();
        for lamp in &model.lamps {
            add_lamp(&mut builder, &mut profiles, lamp)?;
        }
        let mut emitted = BTreeMap::new();
        for (&number, weight) in &emission {
            emitted.insert(number, weight.weight(&mut builder)?);
        }
        for (mesh, first) in emitters {
            if let Some((center, radius)) = mesh.bulb {
                builder.add_light(SphereLight::new(center, radius, LUMINANCE.dot(material(mesh).emission)))?;
                continue;
            }
            let (sides, weight) = (sides(material(mesh)), emitted[&mesh.material]);
            meshes.add_emitter(&mut builder, mesh, first, &|mesh| {
                Mesh::emitter(&mesh.positions, &mesh.indices).uvs(mesh.emission_uvs()).sides(sides).weight(weight)
            })?;
        }
        for (mesh, weight) in portals.into_iter().zip(&transmission) {
            let (sides, weight) = (sides(material(mesh)), weight.weight(&mut builder)?);
            meshes.add_portal(&mut builder, mesh, &|mesh| {
                Mesh::portal(&mesh.positions, &mesh.indices).uvs(&mesh.uvs).sides(sides).weight(weight)
            })?;
        }
        let (sources, passed) = meshes.finish();
        let sampler = builder.build()?;
        Ok(Self { sources, passed, knows_hits, open_sky, sampler, tells_lobes: true, visibility: None })
    }

    /// Returns the lights, with every surface taken for a diffuse one.
    pub(crate) fn without_lobes(self) -> Self {
        Self { tells_lobes: false, ..self }
    }

    /// Learns what walls hide from the surfaces that a camera sees, with the given number of rays.
    pub(crate) fn learned(mut self, world: &World, camera: &Camera, rays: u64) -> Result<Self, Error> {
        let point = |i: u64| {
            let mut random = Random::new(i, LEARNING);
            let [u, v]: [f32; 2] = random.take();
            let pixel = glam::vec2(u * camera.width() as f32, v * camera.height() as f32);
            let (origin, direction) = camera.ray(pixel);
            world.trace(origin, direction).1.map_or(ShadingPoint::volume(Vec3::NAN), |point| {
                self.shading_point(point.start(point.normal), &world.bsdf(&point, direction))
            })
        };
        let passed = |x: &ShadingPoint, sample: &LightSample| {
            let is_emitter = sample.hit().is_some_and(|hit| self.sources.emits(&hit));
            let passed = if is_emitter {
                world.passes(x.position, sample.position)
            } else {
                world.scene.passes(x.position, sample.direction, f32::INFINITY)
            };
            LUMINANCE.dot(passed)
        };
        self.visibility = Some(Visibility::learn(&self.sampler.as_view(), rays, point, passed)?);
        Ok(self)
    }

    /// What was passed in, and the memory that it takes.
    pub(crate) fn described(&self) -> String {
        let Passed { meshes, objects, instances } = self.passed;
        let bytes = self.sampler.bytes();
        let kilobytes = |bytes: usize| bytes as f64 / 1e3;
        format!(
            "fanlight: {} lights; {meshes} meshes, and {instances} instances of {objects} more; {:.1} kB, of which {:.1} kB \
             are of the environment",
            self.sampler.light_count(),
            kilobytes(bytes.total()),
            kilobytes(bytes.environment)
        )
    }

    /// Whether rays of light start anywhere but at lamps.
    pub(crate) const fn have_surfaces(&self) -> bool {
        self.passed.meshes + self.passed.instances > 0
    }

    /// A direction to the sky, bright parts more often than dark ones.
    pub(crate) fn sample_environment(&self, u: [f32; 2]) -> Option<Proposal> {
        let sample = self.sampler.environment().sample(u)?;
        Some(Proposal { direction: sample.direction, pdf: sample.pdf, aim: Aim::Sky })
    }

    /// Density per solid angle of a direction under [`sample_environment`](Self::sample_environment).
    pub(crate) fn environment_pdf(&self, direction: Vec3) -> f32 {
        self.sampler.environment().pdf(direction)
    }

    /// The lights as seen from a point of a surface.
    pub(crate) fn at_surface(&self, position: Vec3, bsdf: &Bsdf) -> LightsAt<'_> {
        LightsAt(self.at(&self.shading_point(position, bsdf)))
    }

    /// The lights as seen from a point in fog.
    pub(crate) fn at_volume(&self, position: Vec3) -> LightsAt<'_> {
        LightsAt(self.at(&ShadingPoint::volume(position)))
    }

    /// A distance along a stretch of a ray in fog of this density, by the light that is expected there, and its density
    /// per length.
    pub(crate) fn propose_distance(
        &self,
        origin: Vec3,
        direction: Vec3,
        length: f32,
        density: f32,
        u: f32,
    ) -> Option<(f32, f32)> {
        self.sampler.along(&RaySegment::new(origin, direction, length, density)).sample_distance(u)
    }

    /// One direction to a light and its density, for a point of a surface.
    pub(crate) fn propose(&self, position: Vec3, normal: Vec3, u: [f32; 3]) -> Option<Proposal> {
        LightsAt(self.at(&ShadingPoint::surface(position, normal))).sample(u)
    }

    /// The sampler for a point, with what has been learned.
    fn at(&self, x: &ShadingPoint) -> PointSampler<'_> {
        let known = self.visibility.as_ref().and_then(|visibility| self.sampler.with_visibility(visibility).ok());
        match known {
            Some(lights) => lights.at(x),
            None => self.sampler.at(x),
        }
    }

    /// What `fanlight` is told of a point of a surface.
    fn shading_point(&self, position: Vec3, bsdf: &Bsdf) -> ShadingPoint {
        match bsdf.facets() {
            Some(facets) if self.tells_lobes => ShadingPoint::glossy(position, facets.glossy()),
            _ => surface(position, bsdf),
        }
    }

    /// Light as it leaves emitters, or comes in through portals.
    pub(crate) fn outgoing(&self) -> Outgoing<'_> {
        Outgoing { emission: self.sampler.emission(), lights: self }
    }
}

/// The lights as seen from one point.
pub(crate) struct LightsAt<'a>(PointSampler<'a>);

impl<'a> LightsAt<'a> {
    /// Returns the lights with samples that stand for one light each.
    pub(crate) fn by_light(self, lights: &'a Lights) -> PlainAt<'a> {
        PlainAt { here: self.0, lights }
    }
}

impl LightsAt<'_> {
    /// A direction to a light, by what comes from there and counts at the point.
    pub(crate) fn sample(&self, u: [f32; 3]) -> Option<Proposal> {
        // Not `sample.pdf`, the density of this one point: were there another portal behind this one, the same
        // direction could have been found through that.
        self.0.sample(u).map(|sample| proposal(&sample, self.0.pdf_sample_direction(&sample)))
    }

    /// Density per solid angle of a direction under [`sample`](Self::sample).
    pub(crate) fn pdf(&self, direction: Vec3) -> f32 {
        self.0.pdf_direction(direction)
    }

    /// A direction with the density of the one point that was drawn: what to compare with, not what to use.
    pub(crate) fn sample_single(&self, u: [f32; 3]) -> Option<Proposal> {
        self.0.sample(u).map(|sample| proposal(&sample, sample.pdf))
    }
}

/// The lights as seen from one point. A sample stands for the point of the emitter that was drawn, or for the sky.
pub(crate) struct PlainAt<'a> {
    here: PointSampler<'a>,
    lights: &'a Lights,
}

impl PlainAt<'_> {
    /// A direction to a light, by what comes from there and counts at the point.
    pub(crate) fn sample(&self, u: [f32; 3]) -> Option<Proposal> {
        let sample = self.here.sample(u)?;
        let Lights { sources, knows_hits, open_sky, .. } = self.lights;
        Some(match sample.light {
            SampledLight::Punctual(_) => proposal(&sample, sample.pdf),
            _ if !knows_hits => proposal(&sample, self.here.pdf_sample_direction(&sample)),
            SampledLight::Triangle(hit) if sources.emits(&hit) => {
                Proposal { aim: Aim::Point(sample.distance), ..proposal(&sample, sample.pdf) }
            }
            SampledLight::Environment if *open_sky => Proposal { aim: Aim::Sky, ..proposal(&sample, sample.pdf) },
            _ => Proposal { aim: Aim::Sky, ..proposal(&sample, self.here.pdf_sample_direction(&sample)) },
        })
    }

    /// Density per solid angle of a direction under [`sample`](Self::sample), which leads to an emitter's point, or to
    /// the sky if that is `None`.
    pub(crate) fn pdf(&self, direction: Vec3, from: Option<&Point>) -> f32 {
        match from {
            Some(point) if self.lights.knows_hits => {
                self.lights.sources.hit(point).map_or(0.0, |hit| self.here.pdf(&hit))
            }
            None if self.lights.knows_hits && self.lights.open_sky => self.here.pdf_environment(direction),
            _ => self.here.pdf_direction(direction),
        }
    }
}

fn proposal(sample: &LightSample, pdf: f32) -> Proposal {
    let aim = match sample.light {
        SampledLight::Punctual(id) => Aim::Lamp(id.index() as usize),
        _ => Aim::Any,
    };
    Proposal { direction: sample.direction, pdf, aim }
}

/// A ray of light.
pub(crate) struct LightRay {
    pub(crate) origin: Vec3,
    /// Where the light travels to.
    pub(crate) direction: Vec3,
    /// Whether an emitter sends it, and not the sky.
    pub(crate) emitted: bool,
}

/// Light at its source, whatever it falls on.
pub(crate) struct Outgoing<'a> {
    emission: Emission<'a>,
    lights: &'a Lights,
}

impl Outgoing<'_> {
    /// A ray from an emitter or through a portal, by the light that it brings.
    pub(crate) fn sample(&self, u: [f32; 5]) -> Option<LightRay> {
        let ray = self.emission.sample(u)?;
        let emitted = self.lights.sources.emits(&ray.hit()?);
        Some(LightRay { origin: ray.position, direction: ray.direction, emitted })
    }

    /// Density with which [`sample`](Self::sample) gives the ray that comes to a point from a direction, and starts
    /// at an emitter's point or, if that is `None`, in the sky: per solid angle, and per area perpendicular to it.
    pub(crate) fn pdf(&self, position: Vec3, towards: Vec3, from: Option<&Point>) -> f32 {
        match from {
            None => self.emission.pdf_ray(position, towards),
            Some(point) => self.lights.sources.hit(point).map_or(0.0, |hit| self.emission.pdf(&hit, -towards)),
        }
    }
}

/// Paper that paths are led to, because the light is behind it: portals that scatter what they let in.
pub(crate) struct Guide(LightSampler);

impl Guide {
    /// Hands the flagged meshes over that are translucent; `None` if none is.
    ///
    /// What comes in through them is not known beforehand, only how much of it is let in where. That is how the
    /// sampler sees an emitter with a texture.
    pub(crate) fn new(model: &Model) -> Result<Option<Self>, Error> {
        let translucent = |mesh: &&super::mesh::Mesh| {
            model.is_portal(mesh) && matches!(model.materials[mesh.material].lobe, Lobe::Translucent(_))
        };
        let papers: Vec<_> = model.meshes.iter().filter(translucent).collect();
        let weights: Vec<_> = papers.iter().map(|mesh| colored(model, &model.materials[mesh.material])).collect();
        let mut builder = LightSampler::builder();
        for (mesh, weight) in papers.iter().zip(&weights) {
            let paper = Mesh::emitter(&mesh.positions, &mesh.indices).uvs(&mesh.uvs).sides(Sides::Two);
            let weight = weight.weight(&mut builder)?;
            builder.add_mesh(&paper.weight(weight))?;
        }
        if papers.is_empty() { Ok(None) } else { Ok(Some(Self(builder.build()?))) }
    }

    /// The paper as seen from a point of a surface.
    pub(crate) fn at(&self, position: Vec3, bsdf: &Bsdf) -> LightsAt<'_> {
        LightsAt(self.0.at(&surface(position, bsdf)))
    }
}

/// Passes in a lamp, by its luminance; a diagram that several have only once.
fn add_lamp(
    builder: &mut LightSamplerBuilder<'_>,
    profiles: &mut BTreeMap<*const Diagram, ProfileId>,
    lamp: &Lamp,
) -> Result<(), Error> {
    let strength = LUMINANCE.dot(lamp.strength);
    match &lamp.kind {
        LampKind::Point(position) => builder.add_light(PointLight::new(*position, strength))?,
        LampKind::Spot(position, axis, angles) => {
            builder.add_light(SpotLight::new(*position, *axis, strength, *angles))?
        }
        LampKind::Luminaire(position, diagram) => {
            let key = Arc::as_ptr(diagram);
            let profile = match profiles.get(&key) {
                Some(&profile) => profile,
                None => builder.add_profile(&diagram.profile())?,
            };
            profiles.insert(key, profile);
            builder.add_light(ProfileLight::new(*position, diagram.axis, profile, strength).facing(diagram.zero))?
        }
        LampKind::Distant(axis, radius) => {
            builder.add_light(DistantLight::new(*axis, strength).angular_radius(*radius))?
        }
    };
    Ok(())
}

const fn sides(material: &Material) -> Sides {
    if material.two_sided { Sides::Two } else { Sides::One }
}

fn surface(position: Vec3, bsdf: &Bsdf) -> ShadingPoint {
    if bsdf.transmits() {
        ShadingPoint::transmissive(position, bsdf.normal())
    } else {
        ShadingPoint::surface(position, bsdf.normal())
    }
}
