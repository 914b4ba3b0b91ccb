//! The renderer's light sampling: every call of `fanlight` is in this file.

use fanlight::{
    Emission, Environment, Filter, LightSampler, Mesh, PointSampler, ShadingPoint, Sides, Texture, Weight, Wrap,
};
use glam::Vec3;

use super::Error;
use super::mask::Mask;
use super::room::Room;
use super::scene::SurfacePoint;
use super::sky::Sky;

/// A direction worth tracing.
pub(crate) struct Proposal {
    pub(crate) direction: Vec3,
    /// The direction's density per solid angle, over all ways in which the same sampler could have chosen it.
    pub(crate) pdf: f32,
}

/// The sky and the windows that it is seen through, ready for sampling.
pub(crate) struct Lighting {
    lights: LightSampler,
}

impl Lighting {
    /// Hands the sky's luminance and the windows over.
    ///
    /// One number a texel guides well enough; the radiance itself is looked up in RGB, interpolated in the same way.
    pub(crate) fn new(room: &Room, sky: &Sky) -> Result<Self, Error> {
        let environment = Environment::from_lat_long(sky.width(), sky.height(), &sky.luminance(), Filter::Bilinear)?
            .with_rotation(Environment::Y_UP_LAT_LONG)?;
        let mut builder = LightSampler::builder().environment(environment);

        let window = &room.portal;
        let mut portal = Mesh::portal(&window.positions, &window.indices).sides(Sides::One);
        if let Some(mask) = &room.mask {
            let texture = builder.add_texture(transmittance(mask)?);
            portal = portal.weight(Weight::Texture(texture)).uvs(&window.uvs);
        }
        Ok(Self { lights: builder.mesh(&portal)?.build()? })
    }

    /// A direction to the sky, bright parts more often than dark ones.
    pub(crate) fn sample_environment(&self, u: [f32; 2]) -> Option<Proposal> {
        let sample = self.lights.environment().sample(u)?;
        Some(Proposal { direction: sample.direction, pdf: sample.pdf })
    }

    /// Density per solid angle of a direction under [`sample_environment`](Self::sample_environment).
    pub(crate) fn environment_pdf(&self, direction: Vec3) -> f32 {
        self.lights.environment().pdf(direction)
    }

    /// The light that comes in.
    pub(crate) fn incoming(&self) -> Incoming<'_> {
        Incoming { emission: self.lights.emission() }
    }

    /// The windows as seen from a point.
    pub(crate) fn portals_at(&self, x: &SurfacePoint) -> Portals<'_> {
        Portals { lights: self.lights.at(&ShadingPoint::surface(x.position, x.normal)) }
    }
}

/// A ray of light.
pub(crate) struct LightRay {
    pub(crate) origin: Vec3,
    /// Where the light travels to.
    pub(crate) direction: Vec3,
}

/// The light that comes in through the windows, whatever it falls on.
pub(crate) struct Incoming<'a> {
    emission: Emission<'a>,
}

impl Incoming<'_> {
    /// A ray from the sky through a window, by the light that it brings.
    pub(crate) fn sample(&self, u: [f32; 5]) -> Option<LightRay> {
        let ray = self.emission.sample(u)?;
        Some(LightRay { origin: ray.position, direction: ray.direction })
    }

    /// Density with which [`sample`](Self::sample) gives the ray that comes to a point from a direction: per solid
    /// angle, and per area perpendicular to the ray.
    pub(crate) fn pdf(&self, position: Vec3, towards: Vec3) -> f32 {
        self.emission.pdf_ray(position, towards)
    }
}

/// The windows as seen from a point of a wall.
pub(crate) struct Portals<'a> {
    lights: PointSampler<'a>,
}

impl Portals<'_> {
    /// A direction through a window, by what comes in there and reaches the point.
    pub(crate) fn sample(&self, u: [f32; 3]) -> Option<Proposal> {
        let sample = self.lights.sample(u)?;
        // Not `sample.pdf`, the density of this one point: were there another window behind this one, the same
        // direction could have been found through that.
        Some(Proposal { direction: sample.direction, pdf: self.lights.pdf_sample_direction(&sample) })
    }

    /// Density per solid angle of a direction under [`sample`](Self::sample).
    pub(crate) fn pdf(&self, direction: Vec3) -> f32 {
        self.lights.pdf_direction(direction)
    }
}

/// How much light each place of a window lets through, read as the ray caster reads it.
fn transmittance(mask: &Mask) -> Result<Texture<'_>, fanlight::Error> {
    let size = mask.size() as usize;
    let texture = Texture::new(size, size, mask.texels())?;
    Ok(texture.filter(Filter::Nearest).wrap(Wrap::Clamp, Wrap::Clamp))
}
