//! Textures: an image, how it is read between its texels and beyond its edges, and which coordinates it is read at.

use glam::{Vec2, vec2};
use serde::Deserialize;

use super::data::Data;
use super::document::{Sampler, TextureInfo, extension, member};
use super::images::Images;
use crate::render::{Bitmap, Error, Filter, Wrap};

/// Codes of samplers. *Format.*
const NEAREST: u32 = 9728;
const CLAMP: u32 = 33071;
const MIRROR: u32 = 33648;

/// Where an image is read: a set of texture coordinates, and what is done to them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mapping {
    pub(super) set: u32,
    scale: Vec2,
    rotation: f32,
    offset: Vec2,
}

impl Mapping {
    /// What coordinates become. Rotations are counter-clockwise as seen in the image, where `v` points down.
    pub(super) fn apply(&self, uv: Vec2) -> Vec2 {
        let (sin, cos) = self.rotation.sin_cos();
        let Vec2 { x, y } = uv * self.scale;
        vec2(cos * x + sin * y, cos * y - sin * x) + self.offset
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct Transform {
    offset: [f32; 2],
    rotation: f32,
    scale: [f32; 2],
    tex_coord: Option<u32>,
}

impl Default for Transform {
    fn default() -> Self {
        Self { offset: [0.0; 2], rotation: 0.0, scale: [1.0; 2], tex_coord: None }
    }
}

/// Where a texture is read.
pub(super) fn mapping(info: &TextureInfo) -> Result<Mapping, Error> {
    let transform = extension::<Transform>(&info.extensions, "KHR_texture_transform")?.unwrap_or_default();
    let Transform { offset, rotation, scale, tex_coord } = transform;
    Ok(Mapping { set: tex_coord.unwrap_or(info.tex_coord), scale: scale.into(), rotation, offset: offset.into() })
}

/// A texture's image.
pub(super) fn bitmap(info: &TextureInfo, data: &Data<'_>, images: &mut Images) -> Result<Bitmap, Error> {
    let texture = member(&data.document.textures, "texture", info.index)?;
    let picture = images.of_texture(data, info.index)?;
    let mut bitmap = Bitmap::new(picture.width, picture.height, picture.texels.clone());
    let default = Sampler::default();
    let sampler = texture.sampler.map(|index| member(&data.document.samplers, "sampler", index)).transpose()?;
    let sampler = sampler.unwrap_or(&default);
    bitmap.filter = if sampler.mag_filter == Some(NEAREST) { Filter::Nearest } else { Filter::Bilinear };
    bitmap.wrap = [sampler.wrap_s, sampler.wrap_t].map(|wrap| match wrap {
        Some(CLAMP) => Wrap::Clamp,
        Some(MIRROR) => Wrap::Mirror,
        _ => Wrap::Repeat,
    });
    Ok(bitmap)
}
