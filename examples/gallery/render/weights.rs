//! What guides `fanlight`: weights of meshes, and the sky.

use fanlight::{Environment, EnvironmentImage, Filter, LightSamplerBuilder, Texture, Weight};

use super::Error;
use super::bitmap::Bitmap;
use super::material::{Lobe, Material};
use super::model::Model;
use super::sky::LUMINANCE;

/// One number a texel guides well enough; the radiance itself is looked up in RGB, interpolated in the same way.
pub(super) fn environment(model: &Model) -> Result<Environment, Error> {
    let Some(sky) = &model.sky else { return Ok(Environment::constant(0.0)?) };
    let luminance = sky.luminance();
    let mut image = EnvironmentImage::lat_long(sky.width(), sky.height(), &luminance).filter(Filter::Bilinear);
    if let Some(size) = model.guide_texels {
        image = image.resolution(size);
    }
    Ok(Environment::new(&image)?.with_rotation(Environment::Y_UP_LAT_LONG)?)
}

/// A mesh's weight, one number or an image of them.
pub(super) struct Weights<'a> {
    constant: f32,
    texels: Vec<f32>,
    bitmap: Option<&'a Bitmap>,
}

impl<'a> Weights<'a> {
    fn new(model: &'a Model, map: Option<usize>, constant: f32, texel: impl Fn(glam::Vec4) -> f32) -> Self {
        let bitmap = map.map(|map| &model.bitmaps[map]);
        Self { constant, texels: bitmap.iter().flat_map(|bitmap| bitmap.texels()).map(texel).collect(), bitmap }
    }

    /// The weight of meshes, after the texels have been passed in.
    pub(super) fn weight<'b>(&'b self, builder: &mut LightSamplerBuilder<'b>) -> Result<Weight, Error> {
        Ok(match self.bitmap {
            None => Weight::Constant(self.constant),
            Some(Bitmap { width, height, filter, wrap, .. }) => {
                let texture = Texture::new(*width, *height, &self.texels)?.filter(*filter).wrap(wrap[0], wrap[1]);
                Weight::Texture(builder.add_texture(texture))
            }
        })
    }
}

/// Luminance of what a material emits.
pub(super) fn emission<'a>(model: &'a Model, material: &Material) -> Weights<'a> {
    let emission = material.emission;
    Weights::new(model, material.emission_map, LUMINANCE.dot(emission), |texel| {
        LUMINANCE.dot(emission * texel.truncate())
    })
}

/// Luminance of a material's color.
pub(super) fn colored<'a>(model: &'a Model, material: &Material) -> Weights<'a> {
    let color = material.color;
    Weights::new(model, material.color_map, LUMINANCE.dot(color), |texel| LUMINANCE.dot(color * texel.truncate()))
}

/// How much passes straight through a material. A hole's edge lies where interpolated alpha is one half, so that a
/// texel that is partly opaque counts.
pub(super) fn clear<'a>(model: &'a Model, material: &Material) -> Weights<'a> {
    let tint = if material.lobe == Lobe::Clear { material.color } else { glam::Vec3::ZERO };
    let masked = material.masked;
    Weights::new(model, material.color_map, LUMINANCE.dot(tint), |texel| {
        let hole = if masked { 1.0 - texel.w } else { 0.0 };
        hole.max(LUMINANCE.dot(tint * texel.truncate()))
    })
}
