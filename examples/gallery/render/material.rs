//! What surfaces are made of.

use glam::{Vec2, Vec3};

use super::bitmap::Bitmap;

/// What a surface does with light that falls on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Lobe {
    /// Scatters it evenly to the side that it came from.
    Diffuse,
    /// Lets it pass straight through, tinted: a thin pane.
    Clear,
    /// Scatters this share of it evenly to the other side, and the rest to the side that it came from: paper.
    Translucent(f32),
    /// Reflects it around the mirror direction, the closer the larger the exponent (Phong's lobe).
    Glossy(f32),
    /// Reflects it by microfacets of this roughness (GGX).
    Rough(f32),
}

/// A material. Images are numbers into the model's list.
#[derive(Clone, Debug)]
pub(crate) struct Material {
    /// A name that starts with the portal prefix makes a portal of every mesh of this material.
    pub(crate) name: String,
    pub(crate) lobe: Lobe,
    pub(crate) color: Vec3,
    /// Multiplies the color.
    pub(crate) color_map: Option<usize>,
    /// Whether the color map's alpha is a mask: where it is below one half there is a hole.
    pub(crate) masked: bool,
    pub(crate) emission: Vec3,
    /// Multiplies the emission.
    pub(crate) emission_map: Option<usize>,
    /// Whether light leaves from both sides; from the front alone otherwise.
    pub(crate) two_sided: bool,
    /// Whether the emission takes the place of the color, so that the colors of vertices multiply it.
    pub(crate) unlit: bool,
}

impl Material {
    /// A diffuse one.
    pub(crate) fn new(name: &str, color: Vec3) -> Self {
        Self {
            name: name.to_owned(),
            lobe: Lobe::Diffuse,
            color,
            color_map: None,
            masked: false,
            emission: Vec3::ZERO,
            emission_map: None,
            two_sided: false,
            unlit: false,
        }
    }

    /// A black one that emits light.
    pub(crate) fn emitter(name: &str, emission: Vec3) -> Self {
        Self { emission, ..Self::new(name, Vec3::ZERO) }
    }

    /// Returns the material with another lobe.
    pub(crate) fn lobe(self, lobe: Lobe) -> Self {
        Self { lobe, ..self }
    }

    /// Returns the material with an image on it.
    pub(crate) fn map(self, bitmap: usize) -> Self {
        Self { color_map: Some(bitmap), ..self }
    }

    /// Returns the material with an image on it, and with holes where that has no alpha.
    pub(crate) fn mask(self, bitmap: usize) -> Self {
        Self { color_map: Some(bitmap), masked: true, ..self }
    }

    /// Whether it sends light of its own.
    pub(crate) fn emits(&self) -> bool {
        self.emission.max_element() > 0.0
    }

    /// Whether rays may pass straight through it somewhere.
    pub(crate) fn has_holes(&self) -> bool {
        self.masked || self.lobe == Lobe::Clear
    }

    /// Color at a place.
    pub(crate) fn color_at(&self, bitmaps: &[Bitmap], uv: Vec2) -> Vec3 {
        self.color_map.map_or(self.color, |map| self.color * bitmaps[map].at(uv).truncate())
    }

    /// Radiance that leaves a place.
    pub(crate) fn emission_at(&self, bitmaps: &[Bitmap], uv: Vec2) -> Vec3 {
        self.emission_map.map_or(self.emission, |map| self.emission * bitmaps[map].at(uv).truncate())
    }

    /// What passes straight through at a place; `None` if it is solid there.
    pub(crate) fn passes(&self, bitmaps: &[Bitmap], uv: Vec2, tint: impl FnOnce() -> Vec3) -> Option<Vec3> {
        if self.masked && self.color_map.is_some_and(|map| bitmaps[map].at(uv).w < 0.5) {
            return Some(Vec3::ONE);
        }
        (self.lobe == Lobe::Clear).then(|| tint() * self.color_at(bitmaps, uv))
    }
}
