//! Photons through a portal: every call of `fanlight` that guides light from its source is in this file.
//!
//! A photon's power is what the source sends there over the density of having sent it there.

use core::f32::consts::{PI, TAU};

use fanlight::{Emission, Environment, Filter, LightSampler, Mesh, PointSampler, ShadingPoint, Sides, Texture, Weight};
use glam::{Vec2, Vec3};

use crate::render::{Error, LUMINANCE, Model, Sky};

/// What light comes from, outside of the room.
#[derive(Clone, Copy, Debug)]
pub(super) enum Source {
    /// A point of intensity 1 in all directions.
    Point(Vec3),
    /// A distant light of irradiance 1 from a direction.
    Distant(Vec3),
    /// The model's sky.
    Sky,
}

/// Light on its way.
pub(super) struct Photon {
    pub(super) origin: Vec3,
    pub(super) direction: Vec3,
    pub(super) power: f32,
}

/// A portal, and the source of light behind it.
pub(super) struct Emitter<'a> {
    sampler: LightSampler,
    sky: &'a Sky,
    source: Source,
    /// Around all that is to be lit.
    center: Vec3,
    radius: f32,
}

/// One way to send photons out.
pub(super) enum Way<'a> {
    /// To all of the sphere around the room.
    Unguided,
    /// Through the portal, from the lights behind it.
    Guided(Box<Emission<'a>>),
    /// Through the portal, as seen from a point.
    From(Box<PointSampler<'a>>),
}

impl<'a> Emitter<'a> {
    /// Hands the model's portal over.
    pub(super) fn new(model: &'a Model, source: Source) -> Result<Self, Error> {
        let mesh = model.meshes.iter().find(|mesh| model.is_portal(mesh)).ok_or("there is no portal")?;
        let map = model.materials[mesh.material].color_map.ok_or("the portal has no image")?;
        let bitmap = &model.bitmaps[map];
        let open: Vec<f32> = bitmap.texels().map(|texel| 1.0 - texel.w).collect();
        let sky = model.sky.as_deref().ok_or("there is no sky")?;

        let mut builder = LightSampler::builder();
        if let Source::Sky = source {
            let environment =
                Environment::from_lat_long(sky.width(), sky.height(), &sky.luminance(), Filter::Bilinear)?;
            builder = builder.environment(environment.with_rotation(Environment::Y_UP_LAT_LONG)?);
        }
        let texture = Texture::new(bitmap.width, bitmap.height, &open)?.filter(bitmap.filter);
        let texture = builder.add_texture(texture.wrap(bitmap.wrap[0], bitmap.wrap[1]));
        // A light outside looks at the portal from behind.
        let sides = if let Source::Point(_) = source { Sides::Two } else { Sides::One };
        let portal = Mesh::portal(&mesh.positions, &mesh.indices).uvs(&mesh.uvs).sides(sides);
        let sampler = builder.mesh(&portal.weight(Weight::Texture(texture)))?.build()?;

        let corners = || model.meshes.iter().flat_map(|mesh| mesh.positions.iter().copied());
        let (low, high) = (corners().fold(Vec3::INFINITY, Vec3::min), corners().fold(Vec3::NEG_INFINITY, Vec3::max));
        let (center, radius) = (0.5 * (low + high), 0.5 * (high - low).length());
        Ok(Self { sampler, sky, source, center, radius })
    }

    /// The way through the portal.
    pub(super) fn guided(&self) -> Way<'_> {
        match self.source {
            Source::Point(origin) => Way::From(Box::new(self.sampler.at(&ShadingPoint::volume(origin)))),
            Source::Distant(_) | Source::Sky => Way::Guided(Box::new(self.sampler.emission())),
        }
    }

    /// One photon.
    pub(super) fn photon(&self, way: &Way<'_>, u: [f32; 5]) -> Option<Photon> {
        let [u0, u1, u2, ..] = u;
        match (way, self.source) {
            (Way::From(portal), Source::Point(origin)) => {
                let sample = portal.sample([u0, u1, u2])?;
                Some(Photon { origin, direction: sample.direction, power: 1.0 / sample.pdf })
            }
            (Way::Guided(emission), Source::Distant(towards)) => {
                let ray = emission.sample_distant(-towards, [u0, u1, u2])?;
                Some(Photon { origin: ray.position, direction: ray.direction, power: 1.0 / ray.pdf })
            }
            (Way::Guided(emission), Source::Sky) => {
                let ray = emission.sample(u)?;
                let power = self.radiance(-ray.direction) / ray.pdf;
                Some(Photon { origin: ray.position, direction: ray.direction, power })
            }
            _ => self.unguided(u),
        }
    }

    fn unguided(&self, u: [f32; 5]) -> Option<Photon> {
        let [u0, u1, u2, u3, _] = u;
        match self.source {
            Source::Point(origin) => {
                // The cone around the sphere.
                let step = self.center - origin;
                let cosine = (1.0 - (self.radius * self.radius / step.length_squared()).min(1.0)).sqrt();
                let height = 1.0 - u0 * (1.0 - cosine);
                let disc = (1.0 - height * height).sqrt() * Vec2::from_angle(TAU * u1);
                let direction = across(step.normalize(), disc) + height * step.normalize();
                Some(Photon { origin, direction: direction.normalize(), power: TAU * (1.0 - cosine) })
            }
            Source::Distant(towards) => Some(self.on_disc(towards, 1.0, [u0, u1])),
            Source::Sky => {
                let sample = self.sampler.environment().sample([u0, u1])?;
                Some(self.on_disc(sample.direction, self.radiance(sample.direction) / sample.pdf, [u2, u3]))
            }
        }
    }

    /// A photon that starts on a disc outside which hides the sphere.
    fn on_disc(&self, towards: Vec3, irradiance: f32, [u, v]: [f32; 2]) -> Photon {
        let disc = self.radius * u.sqrt() * Vec2::from_angle(TAU * v);
        let origin = self.center + 2.0 * self.radius * towards + across(towards, disc);
        Photon { origin, direction: -towards, power: irradiance * PI * self.radius * self.radius }
    }

    fn radiance(&self, towards: Vec3) -> f32 {
        self.sky.radiance(towards).dot(LUMINANCE)
    }
}

/// A place of the plane across an axis.
fn across(axis: Vec3, place: Vec2) -> Vec3 {
    let (tangent, bitangent) = axis.any_orthonormal_pair();
    place.x * tangent + place.y * bitangent
}
