//! The renderer's light sampling: every call of `fanlight` is in this file.

use fanlight::{Environment, Filter, LightSampler, Mesh, ShadingPoint, Sides, Texture, Weight, Wrap};
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
        let mut builder = LightSampler::builder();
        builder.environment(environment);

        let window = &room.portal;
        let mut portal = Mesh::portal(&window.positions, &window.indices).sides(Sides::One);
        if let Some(mask) = &room.mask {
            let texture = builder.add_texture(transmittance(mask)?);
            portal = portal.weight(Weight::Texture(texture)).uvs(&window.uvs);
        }
        builder.add_mesh(&portal)?;
        Ok(Self { lights: builder.build()? })
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

    /// A direction from `x` through a window, by what comes in there and reaches `x`.
    pub(crate) fn sample_portals(&self, x: &SurfacePoint, u: [f32; 3]) -> Option<Proposal> {
        let x = shading_point(x);
        let sample = self.lights.sample(&x, u)?;
        // Not `sample.pdf`, the density of this one point: were there another window behind this one, the same
        // direction could have been found through that.
        Some(Proposal { direction: sample.direction, pdf: self.lights.pdf_sample_direction(&x, &sample) })
    }

    /// Density per solid angle of a direction under [`sample_portals`](Self::sample_portals).
    pub(crate) fn portal_pdf(&self, x: &SurfacePoint, direction: Vec3) -> f32 {
        self.lights.pdf_direction(&shading_point(x), direction)
    }
}

fn shading_point(x: &SurfacePoint) -> ShadingPoint {
    ShadingPoint::surface(x.position, x.normal)
}

/// How much light each place of a window lets through, read as the ray caster reads it.
fn transmittance(mask: &Mask) -> Result<Texture<'_>, fanlight::Error> {
    let size = mask.size() as usize;
    let texture = Texture::new(size, size, mask.texels())?;
    Ok(texture.filter(Filter::Nearest).wrap(Wrap::Clamp, Wrap::Clamp))
}
