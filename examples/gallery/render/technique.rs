//! The ways in which directions to light are found, next to the scattering of the surface itself.

use fanlight::ShadingPoint;

use super::Error;
use super::bsdf::Bsdf;
use super::camera::Camera;
use super::lighting::{Guide, Illumination, Lights, LightsAt, PlainAt, Proposal};
use super::model::Model;
use super::power_table::PowerTable;
use super::published::Published;
use super::scene::Point;
use super::texel_table::TexelTable;
use super::world::World;

/// How points on lights are chosen.
pub(crate) enum LightChoice {
    /// Not at all.
    None,
    /// By what they send to the shading point. A direction stands for all that arrives along it.
    Fanlight,
    /// By what they send to the shading point. A sample stands for the point of the emitter that was drawn, or for the
    /// sky.
    Plain,
    /// By what they send, and each sample with the density of the one point that was drawn. Wrong where a ray crosses
    /// several portals.
    Single,
    /// From one table for the whole scene, emitters only.
    Table(TexelTable),
    /// By power among emitters and lamps.
    Power(PowerTable),
    /// As it was published, emitters only.
    Published(Published),
}

/// The lights of a scene, and which techniques are used to find them.
pub(crate) struct Techniques {
    pub(crate) lights: Lights,
    guide: Option<Guide>,
    pub(crate) choice: LightChoice,
    /// Whether directions to the bright parts of the sky are a technique of their own.
    pub(crate) environment: bool,
    /// At how many vertices of a path points on lights are chosen.
    pub(crate) vertices: u32,
    /// Whether one ray of light is traced for each path, for the path's vertices to connect to.
    pub(crate) photons: bool,
}

impl Techniques {
    /// What a path tracer has that knows no lights at all: directions from the surfaces.
    pub(crate) fn surfaces(model: &Model) -> Result<Self, Error> {
        Ok(Self { environment: false, choice: LightChoice::None, ..Self::without(model)? })
    }

    /// What a path tracer has that knows no portals: the sky's bright parts, emitters by area and radiance, and lamps
    /// by power.
    pub(crate) fn without(model: &Model) -> Result<Self, Error> {
        let choice = if model.lamps.is_empty() {
            let table = TexelTable::areas(model);
            if table.is_empty() { LightChoice::None } else { LightChoice::Table(table) }
        } else {
            PowerTable::new(model).map_or(LightChoice::None, LightChoice::Power)
        };
        let lights = Lights::new(model, Illumination::default())?;
        Ok(Self { lights, guide: None, choice, environment: true, vertices: u32::MAX, photons: false })
    }

    /// A path tracer with one sample of `fanlight` at each vertex in place of those of [`without`](Self::without): of
    /// all lights, and of the sky through its portals or, where there are none, as one more light.
    pub(crate) fn plain(model: &Model) -> Result<Self, Error> {
        let lights = Lights::plain(model)?;
        let choice = LightChoice::Plain;
        Ok(Self { lights, guide: None, choice, environment: false, vertices: u32::MAX, photons: false })
    }

    /// All that this renderer has: at the point that the camera sees points on lights and the sky's bright parts, at
    /// those behind it rays of light that are traced from where they start. Lamps are chosen at all points, as no ray
    /// is traced from them.
    pub(crate) fn with_light_rays(model: &Model) -> Result<Self, Error> {
        let lights = Lights::new(model, Illumination::default())?;
        let guide = Guide::new(model)?;
        let photons = lights.have_surfaces();
        let vertices = if photons && model.lamps.is_empty() { 1 } else { u32::MAX };
        Ok(Self { lights, guide, choice: LightChoice::Fanlight, environment: true, vertices, photons })
    }

    /// Returns the techniques with another way to choose points on lights.
    pub(crate) fn choosing(self, choice: LightChoice) -> Self {
        Self { choice, ..self }
    }

    /// Returns the techniques with other lights.
    pub(crate) fn with_lights(self, lights: Lights) -> Self {
        Self { lights, ..self }
    }

    /// Returns the techniques, with every surface taken for a diffuse one where lights are chosen.
    pub(crate) fn without_lobes(self) -> Self {
        Self { lights: self.lights.without_lobes(), ..self }
    }

    /// Learns what walls hide from the surfaces that a camera sees, with the given number of rays.
    pub(crate) fn learned(self, world: &World, camera: &Camera, rays: u64) -> Result<Self, Error> {
        Ok(Self { lights: self.lights.learned(world, camera, rays)?, ..self })
    }

    /// The lights as seen from a point of a surface, the path's vertex of that number.
    pub(crate) fn lights_at(&self, point: &Point, bsdf: &Bsdf, vertex: u32) -> ChoiceAt<'_> {
        match &self.choice {
            LightChoice::Fanlight if vertex <= self.vertices => {
                ChoiceAt::Fanlight(self.lights.at_surface(point.position, bsdf))
            }
            LightChoice::Plain => ChoiceAt::Plain(self.lights.at_surface(point.position, bsdf).by_light(&self.lights)),
            LightChoice::Single => ChoiceAt::Single(self.lights.at_surface(point.position, bsdf)),
            LightChoice::Table(table) => ChoiceAt::Table(table, point.position),
            LightChoice::Power(table) => ChoiceAt::Power(table, point.position),
            LightChoice::Published(lights) => {
                ChoiceAt::Published(lights, ShadingPoint::surface(point.position, bsdf.normal()))
            }
            _ => ChoiceAt::None,
        }
    }

    /// The lights as seen from a point in fog.
    pub(crate) fn lights_in_fog(&self, position: glam::Vec3) -> ChoiceAt<'_> {
        match &self.choice {
            LightChoice::Fanlight => ChoiceAt::Fanlight(self.lights.at_volume(position)),
            LightChoice::Plain => ChoiceAt::Plain(self.lights.at_volume(position).by_light(&self.lights)),
            LightChoice::Table(table) => ChoiceAt::Table(table, position),
            LightChoice::Power(table) => ChoiceAt::Power(table, position),
            _ => ChoiceAt::None,
        }
    }

    /// A distance along a stretch of a ray in fog by the lights, and its density per length; `None` where only the fog
    /// itself chooses.
    pub(crate) fn distance_in_fog(
        &self,
        origin: glam::Vec3,
        direction: glam::Vec3,
        length: f32,
        density: f32,
        u: f32,
    ) -> Option<(f32, f32)> {
        match &self.choice {
            LightChoice::Fanlight | LightChoice::Plain => {
                self.lights.propose_distance(origin, direction, length, density, u)
            }
            _ => None,
        }
    }

    /// The paper that paths are led to, as seen from a point of a surface.
    pub(crate) fn guide_at(&self, point: &Point, bsdf: &Bsdf) -> Option<LightsAt<'_>> {
        self.guide.as_ref().filter(|_| !bsdf.transmits()).map(|guide| guide.at(point.position, bsdf))
    }
}

/// How points on lights are chosen for one shading point.
pub(crate) enum ChoiceAt<'a> {
    None,
    Fanlight(LightsAt<'a>),
    Plain(PlainAt<'a>),
    Single(LightsAt<'a>),
    Table(&'a TexelTable, glam::Vec3),
    Power(&'a PowerTable, glam::Vec3),
    Published(&'a Published, ShadingPoint),
}

impl ChoiceAt<'_> {
    /// A direction to a light.
    pub(crate) fn sample(&self, u: [f32; 3]) -> Option<Proposal> {
        match self {
            Self::None => None,
            Self::Fanlight(lights) => lights.sample(u),
            Self::Plain(lights) => lights.sample(u),
            Self::Single(lights) => lights.sample_single(u),
            Self::Table(table, position) => table.sample(*position, u),
            Self::Power(table, position) => table.sample(*position, u),
            Self::Published(lights, x) => lights.sample(x, u),
        }
    }

    /// Density per solid angle of a direction under [`sample`](Self::sample), which leads to an emitter's point, or to
    /// the sky if that is `None`.
    pub(crate) fn pdf(&self, direction: glam::Vec3, from: Option<&Point>) -> f32 {
        match self {
            Self::None | Self::Single(_) => 0.0,
            Self::Fanlight(lights) => lights.pdf(direction),
            Self::Plain(lights) => lights.pdf(direction, from),
            Self::Power(table, _) => table.pdf(direction, from),
            Self::Table(table, _) => from.map_or(0.0, |point| table.pdf(direction, point)),
            Self::Published(lights, x) => from.map_or(0.0, |point| lights.pdf(x, direction, point)),
        }
    }
}
