//! The renderer's light sampling: every call of `fanlight` that a path or a photon makes is in this file, and what
//! guides it in `weights.rs`.

pub(crate) use fanlight::{Filter, Illumination, Wrap};

use fanlight::{
    DistantLight, Emission, Hit, LightSample, LightSampler, LightSamplerBuilder, Mesh, MeshId, PointLight,
    PointSampler, RaySegment, SampledLight, ShadingPoint, Sides, SpotLight, TriangleId,
};
use glam::Vec3;

use super::Error;
use super::bsdf::Bsdf;
use super::lamp::{Lamp, LampKind};
use super::material::{Lobe, Material};
use super::model::Model;
use super::scene::Point;
use super::sky::LUMINANCE;
use super::weights::{clear, colored, emission, environment};

/// A direction worth tracing.
pub(crate) struct Proposal {
    pub(crate) direction: Vec3,
    /// The direction's density per solid angle, over all ways in which the same sampler could have chosen it.
    pub(crate) pdf: f32,
    /// How far away the point is that alone the density is for; `None` if it is for all along the direction.
    pub(crate) distance: Option<f32>,
    /// Number of the lamp that was chosen, if it is one. No ray finds it by chance, and the density is the probability of
    /// that choice.
    pub(crate) lamp: Option<usize>,
}

/// The emitters, and the sky with the portals that it is seen through.
pub(crate) struct Lights {
    sampler: LightSampler,
    /// What the sampler calls the model's triangles.
    ids: Vec<Option<TriangleId>>,
    /// Meshes below this number are emitters, the others portals.
    emitters: u32,
    /// Number of all meshes.
    meshes: u32,
}

impl Lights {
    /// Hands over all that emits light or lets it in.
    pub(crate) fn new(model: &Model, illumination: Illumination) -> Result<Self, Error> {
        Self::weighted(model, illumination, |_| 1.0)
    }

    /// The same with each portal's weight, by its number, times a factor.
    pub(crate) fn weighted(
        model: &Model,
        illumination: Illumination,
        factor: impl Fn(usize) -> f32,
    ) -> Result<Self, Error> {
        let emits = |mesh: &&super::mesh::Mesh| model.materials[mesh.material].emits();
        let emitters: Vec<_> = model.meshes.iter().filter(emits).collect();
        let flagged = model.meshes.iter().filter(|mesh| model.is_portal(mesh));
        let portals: Vec<_> = flagged.filter(|mesh| model.materials[mesh.material].has_holes()).collect();

        let emission: Vec<_> = emitters.iter().map(|mesh| emission(model, &model.materials[mesh.material])).collect();
        let transmission: Vec<_> = (portals.iter().enumerate())
            .map(|(i, mesh)| clear(model, &model.materials[mesh.material]).times(factor(i)))
            .collect();
        let mut builder = LightSampler::builder().illumination(illumination).environment(environment(model)?);
        for (mesh, weight) in emitters.iter().zip(&emission) {
            let mesh_light = Mesh::emitter(&mesh.positions, &mesh.indices).uvs(mesh.emission_uvs());
            weight.add(&mut builder, mesh_light.sides(sides(&model.materials[mesh.material])))?;
        }
        for (mesh, weight) in portals.iter().zip(&transmission) {
            let portal = Mesh::portal(&mesh.positions, &mesh.indices).uvs(&mesh.uvs);
            weight.add(&mut builder, portal.sides(sides(&model.materials[mesh.material])))?;
        }
        for lamp in &model.lamps {
            add_lamp(&mut builder, lamp)?;
        }
        let mut next = (0..).map(MeshId::from_index);
        let ids = model.meshes.iter().flat_map(|mesh| {
            let number = emits(&mesh).then(|| next.next()).flatten();
            (0..mesh.indices.len() as u32).map(move |triangle| number.map(|mesh| TriangleId::new(mesh, triangle)))
        });
        let meshes = (emitters.len() + portals.len()) as u32;
        Ok(Self { ids: ids.collect(), emitters: emitters.len() as u32, meshes, sampler: builder.build()? })
    }

    /// Whether rays of light start anywhere but at lamps.
    pub(crate) const fn have_surfaces(&self) -> bool {
        self.meshes > 0
    }

    /// A direction to the sky, bright parts more often than dark ones.
    pub(crate) fn sample_environment(&self, u: [f32; 2]) -> Option<Proposal> {
        let sample = self.sampler.environment().sample(u)?;
        Some(Proposal { direction: sample.direction, pdf: sample.pdf, distance: None, lamp: None })
    }

    /// Density per solid angle of a direction under [`sample_environment`](Self::sample_environment).
    pub(crate) fn environment_pdf(&self, direction: Vec3) -> f32 {
        self.sampler.environment().pdf(direction)
    }

    /// The lights as seen from a point of a surface.
    pub(crate) fn at_surface(&self, position: Vec3, bsdf: &Bsdf) -> LightsAt<'_> {
        LightsAt(self.sampler.at(&surface(position, bsdf)))
    }

    /// The lights as seen from a point in fog.
    pub(crate) fn at_volume(&self, position: Vec3) -> LightsAt<'_> {
        LightsAt(self.sampler.at(&ShadingPoint::volume(position)))
    }

    /// A distance along a stretch of a ray in fog of this density, by the light that is expected there, and its density per
    /// length.
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
        LightsAt(self.sampler.at(&ShadingPoint::surface(position, normal))).sample(u)
    }

    /// A portal's number and a direction through it, as drawn for a point of a surface.
    pub(crate) fn sample_portal(&self, position: Vec3, normal: Vec3, u: [f32; 3]) -> Option<(usize, Vec3)> {
        let sample = self.sampler.at(&ShadingPoint::surface(position, normal)).sample(u)?;
        let portal = sample.hit()?.triangle.mesh.index().checked_sub(self.emitters)?;
        Some((portal as usize, sample.direction))
    }

    /// Light as it leaves emitters, or comes in through portals.
    pub(crate) fn outgoing(&self) -> Outgoing<'_> {
        Outgoing { emission: self.sampler.emission(), lights: self }
    }
}

/// The lights as seen from one point.
pub(crate) struct LightsAt<'a>(PointSampler<'a>);

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

fn proposal(sample: &LightSample, pdf: f32) -> Proposal {
    let lamp = match sample.light {
        SampledLight::Punctual(id) => Some(id.index() as usize),
        _ => None,
    };
    Proposal { direction: sample.direction, pdf, distance: None, lamp }
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
        let emitted = ray.hit()?.triangle.mesh.index() < self.lights.emitters;
        Some(LightRay { origin: ray.position, direction: ray.direction, emitted })
    }

    /// Density with which [`sample`](Self::sample) gives the ray that comes to a point from a direction, and starts
    /// at an emitter's point or, if that is `None`, in the sky: per solid angle, and per area perpendicular to it.
    pub(crate) fn pdf(&self, position: Vec3, towards: Vec3, from: Option<&Point>) -> f32 {
        match from {
            None => self.emission.pdf_ray(position, towards),
            Some(Point { triangle, barycentrics, .. }) => self.lights.ids[*triangle]
                .map_or(0.0, |triangle| self.emission.pdf(&Hit::new(triangle, *barycentrics), -towards)),
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
            weight.add(&mut builder, Mesh::emitter(&mesh.positions, &mesh.indices).uvs(&mesh.uvs).sides(Sides::Two))?;
        }
        if papers.is_empty() { Ok(None) } else { Ok(Some(Self(builder.build()?))) }
    }

    /// The paper as seen from a point of a surface.
    pub(crate) fn at(&self, position: Vec3, bsdf: &Bsdf) -> LightsAt<'_> {
        LightsAt(self.0.at(&surface(position, bsdf)))
    }
}

/// Passes in a lamp, by its luminance.
fn add_lamp(builder: &mut LightSamplerBuilder<'_>, lamp: &Lamp) -> Result<(), Error> {
    let strength = LUMINANCE.dot(lamp.strength);
    match &lamp.kind {
        LampKind::Point(position) => builder.add_light(PointLight::new(*position, strength))?,
        LampKind::Spot(position, axis, angles) => {
            builder.add_light(SpotLight::new(*position, *axis, strength, *angles))?
        }
        LampKind::Distant(axis) => builder.add_light(DistantLight::new(*axis, strength))?,
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
