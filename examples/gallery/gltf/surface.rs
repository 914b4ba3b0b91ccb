//! Materials and images of a glTF file.

use glam::{Vec2, Vec3, Vec4, Vec4Swizzles};
use gltf::image::{Data, Format};
use gltf::material::AlphaMode;
use gltf::texture::{MagFilter, WrappingMode};

use crate::render::{Bitmap, Error, Filter, Lobe, Material, Wrap};

/// Roughness from which on what is transmitted is scattered.
const ROUGH: f32 = 0.5;
/// Sharpest reflection that is traced.
const SHARPEST: f32 = 2000.0;

/// Takes a material over, and the images that it needs.
pub(super) fn material(
    source: &gltf::Material<'_>,
    images: &[Data],
    bitmaps: &mut Vec<Bitmap>,
) -> Result<Material, Error> {
    let name = source.name().unwrap_or_default();
    let pbr = source.pbr_metallic_roughness();
    let factor = Vec4::from(pbr.base_color_factor());
    let base = pbr.base_color_texture().map(|info| bitmap(&info.texture(), images)).transpose()?;
    let transmission = source.transmission();
    let share = transmission.as_ref().map_or(0.0, gltf::material::Transmission::transmission_factor);
    let share_map =
        transmission.and_then(|t| t.transmission_texture()).map(|info| bitmap(&info.texture(), images)).transpose()?;

    let mut material = Material::new(name, factor.xyz());
    material.two_sided = source.double_sided();
    let mut image = base;
    if share > 0.0 && pbr.roughness_factor() < ROUGH {
        material.lobe = Lobe::Clear;
        material.color *= share;
        if let Some(shares) = share_map {
            image = Some(multiplied(&shares, image.as_ref()));
        }
    } else if share > 0.0 {
        material.lobe = Lobe::Translucent(share);
    } else if pbr.metallic_factor() > 0.5 {
        let alpha = pbr.roughness_factor().powi(2).max(1e-3);
        material.lobe = Lobe::Glossy((2.0 / (alpha * alpha) - 2.0).clamp(1.0, SHARPEST));
    }
    match source.alpha_mode() {
        AlphaMode::Opaque => {}
        AlphaMode::Mask => {
            material.masked = true;
            let scale = factor.w * 0.5 / source.alpha_cutoff().unwrap_or(0.5).max(1e-3);
            image = image.map(|image| with_alpha(image, scale));
        }
        AlphaMode::Blend => {
            material.lobe = Lobe::Clear;
            material.color = if image.is_some() { Vec3::ONE } else { Vec3::splat(1.0 - factor.w) };
            image = image.map(|image| clear_by_alpha(&image, factor.w));
        }
    }
    let mut keep = |image: Bitmap| {
        bitmaps.push(image);
        bitmaps.len() - 1
    };
    material.color_map = image.map(&mut keep);
    material.emission = Vec3::from(source.emissive_factor()) * source.emissive_strength().unwrap_or(1.0);
    let emission = source.emissive_texture().map(|info| bitmap(&info.texture(), images)).transpose()?;
    material.emission_map = emission.map(&mut keep);
    Ok(material)
}

/// The set of texture coordinates that a material reads, if it has any image.
pub(super) fn coordinate_set(material: &gltf::Material<'_>) -> Option<u32> {
    let base = material.pbr_metallic_roughness().base_color_texture();
    let transmission = material.transmission().and_then(|t| t.transmission_texture());
    base.or(transmission).or(material.emissive_texture()).map(|info| info.tex_coord())
}

fn bitmap(texture: &gltf::Texture<'_>, images: &[Data]) -> Result<Bitmap, Error> {
    let data = &images[texture.source().index()];
    let sampler = texture.sampler();
    let mut bitmap = Bitmap::new(data.width as usize, data.height as usize, texels(data)?);
    bitmap.filter = match sampler.mag_filter() {
        Some(MagFilter::Nearest) => Filter::Nearest,
        _ => Filter::Bilinear,
    };
    bitmap.wrap = [sampler.wrap_s(), sampler.wrap_t()].map(|wrap| match wrap {
        WrappingMode::Repeat => Wrap::Repeat,
        WrappingMode::MirroredRepeat => Wrap::Mirror,
        WrappingMode::ClampToEdge => Wrap::Clamp,
    });
    Ok(bitmap)
}

fn texels(Data { pixels, format, .. }: &Data) -> Result<Vec<[u8; 4]>, Error> {
    // Of two bytes the second one is the more significant.
    let (channels, bytes) = match format {
        Format::R8 => (1, 1),
        Format::R8G8 => (2, 1),
        Format::R8G8B8 => (3, 1),
        Format::R8G8B8A8 => (4, 1),
        Format::R16 => (1, 2),
        Format::R16G16 => (2, 2),
        Format::R16G16B16 => (3, 2),
        Format::R16G16B16A16 => (4, 2),
        _ => return Err(format!("an image holds {format:?}, but must hold 8 or 16 bits a channel").into()),
    };
    let texel = |texel: &[u8]| {
        let channel = |i: usize| texel[(i + 1) * bytes - 1];
        match channels {
            1 => [channel(0), channel(0), channel(0), u8::MAX],
            2 => [channel(0), channel(0), channel(0), channel(1)],
            3 => [channel(0), channel(1), channel(2), u8::MAX],
            _ => [channel(0), channel(1), channel(2), channel(3)],
        }
    };
    Ok(pixels.chunks_exact(channels * bytes).map(texel).collect())
}

/// An image like another one, of other colours.
fn redrawn(like: &Bitmap, color: impl Fn(Vec2) -> Vec4) -> Bitmap {
    Bitmap { bytes: Bitmap::draw(like.width, like.height, color).bytes, ..like.clone() }
}

/// The red channel of an image of shares, which are stored as they are, times another image.
fn multiplied(shares: &Bitmap, image: Option<&Bitmap>) -> Bitmap {
    redrawn(shares, |uv| {
        let share = shares.stored_at(uv)[0];
        image.map_or(Vec4::ONE, |image| image.at(uv)) * Vec4::new(share, share, share, 1.0)
    })
}

/// An image with its alpha scaled.
fn with_alpha(mut image: Bitmap, scale: f32) -> Bitmap {
    for [.., alpha] in &mut image.bytes {
        *alpha = (f32::from(*alpha) * scale).min(255.0) as u8;
    }
    image
}

/// What an image that is blended over the background leaves of it.
fn clear_by_alpha(image: &Bitmap, scale: f32) -> Bitmap {
    redrawn(image, |uv| {
        let left = 1.0 - image.stored_at(uv)[3] * scale;
        Vec4::new(left, left, left, 1.0)
    })
}
