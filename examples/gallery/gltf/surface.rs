//! Materials.

use glam::{Vec2, Vec3, Vec4, Vec4Swizzles};
use serde::Deserialize;

use super::data::Data;
use super::document::{Material as Source, TextureInfo, extension};
use super::extensions;
use super::images::Images;
use super::notes::Notes;
use super::texture::{Mapping, bitmap, mapping};
use crate::render::{Bitmap, Error, Lobe, Material};

/// Roughness from which on what is transmitted is scattered.
const ROUGH: f32 = 0.5;
/// Sharpest reflection that is traced.
const SHARPEST: f32 = 2000.0;
/// Brightest emission. Sums of what is brighter overflow.
const BRIGHTEST: f32 = 1e20;

/// A material with its own images, and where these are read.
pub(super) struct Surface {
    pub(super) material: Material,
    pub(super) color_map: Option<Map>,
    pub(super) color_mapping: Option<Mapping>,
    pub(super) emission_map: Option<Map>,
    pub(super) emission_mapping: Option<Mapping>,
}

/// An image of a material.
#[derive(Clone)]
pub(super) struct Map {
    pub(super) bitmap: Bitmap,
    /// The texture that it is, if nothing else was put into it: materials share such.
    pub(super) texture: Option<usize>,
}

impl Map {
    /// An image that no other material has.
    const fn own(bitmap: Bitmap) -> Self {
        Self { bitmap, texture: None }
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Strength {
    #[serde(default = "one")]
    emissive_strength: f32,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", default)]
#[derive(Default)]
struct Transmission {
    transmission_factor: f32,
    transmission_texture: Option<TextureInfo>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", default)]
#[derive(Default)]
struct DiffuseTransmission {
    diffuse_transmission_factor: f32,
}

/// The older way to describe a material.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct Glossiness {
    diffuse_factor: [f32; 4],
    diffuse_texture: Option<TextureInfo>,
}

impl Default for Glossiness {
    fn default() -> Self {
        Self { diffuse_factor: [1.0; 4], diffuse_texture: None }
    }
}

const fn one() -> f32 {
    1.0
}

/// What a material is made from, and where to say what is not honored.
pub(super) struct Reading<'a, 'b> {
    pub(super) data: &'a Data<'b>,
    pub(super) images: &'a mut Images,
    pub(super) notes: &'a mut Notes,
    /// What messages call the material.
    pub(super) called: &'a str,
}

impl Reading<'_, '_> {
    /// Takes a material over.
    pub(super) fn surface(&mut self, source: &Source) -> Result<Surface, Error> {
        self.note_ignored(source);
        let mut base = Base::new(source)?;
        let [metallic, roughness] = self.metallic_roughness(source, &mut base);
        let mut material = Material::new(source.name.as_deref().unwrap_or_default(), base.factor.xyz().max(Vec3::ZERO));
        material.two_sided = source.double_sided;
        let mut image = base.texture.as_ref().map(|info| self.map(info)).transpose()?;
        let mut color_mapping = base.texture.as_ref().map(mapping).transpose()?;

        let transmission = extension::<Transmission>(&source.extensions, "KHR_materials_transmission")?;
        let transmission = transmission.unwrap_or_default();
        let diffuse = extension::<DiffuseTransmission>(&source.extensions, "KHR_materials_diffuse_transmission")?;
        let diffuse = diffuse.map_or(0.0, |diffuse| diffuse.diffuse_transmission_factor);
        let share = transmission.transmission_factor.clamp(0.0, 1.0);
        if share > 0.0 && roughness < ROUGH {
            material.lobe = Lobe::Clear;
            material.color *= share;
            if let Some(info) = &transmission.transmission_texture {
                let own = mapping(info)?;
                let shares = self.map(info)?.bitmap;
                if color_mapping.is_some_and(|color| color != own) {
                    self.note("its transmission's image is read where that of the base color is");
                }
                color_mapping = color_mapping.or(Some(own));
                image = Some(Map::own(multiplied(&shares, image.as_ref().map(|image| &image.bitmap))));
            }
        } else if share > 0.0 || diffuse > 0.0 {
            material.lobe = Lobe::Translucent(share.max(diffuse).min(1.0));
        } else if metallic > 0.5 {
            let alpha = roughness.powi(2).max(1e-3);
            material.lobe = Lobe::Glossy((2.0 / (alpha * alpha) - 2.0).clamp(1.0, SHARPEST));
        }
        let image = with_alpha_mode(source, base.factor.w, &mut material, image);

        let mut surface =
            Surface { material, color_map: image, color_mapping, emission_map: None, emission_mapping: None };
        if source.extensions.contains_key("KHR_materials_unlit") {
            self.note("it is unlit: it emits its base color, and so lights other surfaces, too");
            make_unlit(&mut surface);
        } else {
            self.add_emission(source, &mut surface)?;
        }
        Ok(surface)
    }

    fn add_emission(&mut self, source: &Source, surface: &mut Surface) -> Result<(), Error> {
        let strength = extension::<Strength>(&source.extensions, "KHR_materials_emissive_strength")?;
        let strength = strength.map_or(1.0, |strength| strength.emissive_strength);
        let emission = Vec3::from(source.emissive_factor) * strength;
        if emission.min_element() < 0.0 || !(emission.max_element() <= BRIGHTEST) {
            return Err(format!("its emission is {emission}, but must be from 0 to {BRIGHTEST:e}").into());
        }
        surface.material.emission = emission;
        // An image that nothing multiplies is not needed.
        if let Some(info) = source.emissive_texture.as_ref().filter(|_| surface.material.emits()) {
            surface.emission_map = Some(self.map(info)?);
            surface.emission_mapping = Some(mapping(info)?);
        }
        Ok(())
    }

    fn map(&mut self, info: &TextureInfo) -> Result<Map, Error> {
        Ok(Map { bitmap: bitmap(info, self.data, self.images)?, texture: Some(info.index) })
    }

    fn note(&mut self, text: &str) {
        self.notes.about(self.called, text);
    }

    /// Metallic and roughness, of which an image counts as its mean.
    fn metallic_roughness(&mut self, source: &Source, base: &mut Base) -> [f32; 2] {
        if base.is_diffuse {
            return [0.0, 1.0];
        }
        let pbr = &source.pbr_metallic_roughness;
        let [metallic, roughness] = [pbr.metallic_factor, pbr.roughness_factor].map(|share| share.clamp(0.0, 1.0));
        let Some(info) = &pbr.metallic_roughness_texture else { return [metallic, roughness] };
        match self.images.of_texture(self.data, info.index) {
            Ok(picture) => {
                let count = picture.texels.len() as f64 * 255.0;
                let mean = |channel: usize| {
                    let sum: u64 = picture.texels.iter().map(|texel| u64::from(texel[channel])).sum();
                    (sum as f64 / count) as f32
                };
                let means = [metallic * mean(2), roughness * mean(1)];
                self.note("metallic and roughness are the means of their image");
                means
            }
            Err(error) => {
                self.note(&format!("the image of metallic and roughness is ignored, and it is diffuse ({error})"));
                [0.0, 1.0]
            }
        }
    }

    fn note_ignored(&mut self, source: &Source) {
        if source.normal_texture.is_some() {
            self.note("its normal map is ignored");
        }
        if source.occlusion_texture.is_some() {
            self.note("its occlusion map is ignored: light finds out what is in its way");
        }
        if source.extensions.contains_key("KHR_materials_pbrSpecularGlossiness") {
            self.note("of KHR_materials_pbrSpecularGlossiness, specular and glossiness are ignored");
        }
        if source.extensions.contains_key("KHR_materials_diffuse_transmission") {
            self.note("of KHR_materials_diffuse_transmission, color and images are ignored");
        }
        for name in source.extensions.keys().filter(|name| !extensions::KNOWN.contains(&name.as_str())) {
            self.note(&format!("its {} is ignored", name.escape_debug()));
        }
    }
}

/// The color of a material, however it is described.
struct Base {
    factor: Vec4,
    texture: Option<TextureInfo>,
    /// Whether it says nothing of metallic and roughness.
    is_diffuse: bool,
}

impl Base {
    fn new(source: &Source) -> Result<Self, Error> {
        if let Some(older) = extension::<Glossiness>(&source.extensions, "KHR_materials_pbrSpecularGlossiness")? {
            let factor = Vec4::from(older.diffuse_factor);
            return Ok(Self { factor, texture: older.diffuse_texture, is_diffuse: true });
        }
        let pbr = &source.pbr_metallic_roughness;
        let factor = Vec4::from(pbr.base_color_factor);
        Ok(Self { factor, texture: pbr.base_color_texture.clone(), is_diffuse: false })
    }
}

fn with_alpha_mode(source: &Source, alpha: f32, material: &mut Material, image: Option<Map>) -> Option<Map> {
    match source.alpha_mode.as_deref() {
        Some("MASK") => {
            let cutoff = source.alpha_cutoff.unwrap_or(0.5);
            material.masked = true;
            let scale = alpha * 0.5 / cutoff.max(1e-3);
            match image {
                Some(image) => Some(Map::own(with_alpha(image.bitmap, scale))),
                // Nothing is left of it, or all.
                None if alpha < cutoff => Some(Map::own(Bitmap::draw(1, 1, |_| Vec4::new(1.0, 1.0, 1.0, 0.0)))),
                None => None,
            }
        }
        Some("BLEND") => {
            material.lobe = Lobe::Clear;
            let alpha = alpha.clamp(0.0, 1.0);
            material.color = if image.is_some() { Vec3::ONE } else { Vec3::splat(1.0 - alpha) };
            image.map(|image| Map::own(clear_by_alpha(&image.bitmap, alpha)))
        }
        _ => image,
    }
}

/// Makes a surface look as its color says, whatever light falls on it.
fn make_unlit(surface: &mut Surface) {
    let material = &mut surface.material;
    material.unlit = true;
    if material.lobe != Lobe::Clear {
        material.emission = material.color;
        material.color = Vec3::ZERO;
        material.lobe = Lobe::Diffuse;
        surface.emission_map.clone_from(&surface.color_map);
        surface.emission_mapping = surface.color_mapping;
    }
}

/// An image like another one, of other colors.
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
        *alpha = (f32::from(*alpha) * scale).clamp(0.0, 255.0) as u8;
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
