//! The built-in scenes. Lengths are meters, y is up, and the sun stands towards -x.

extern crate alloc;

mod car;
mod facade;
mod fog;
mod glossy;
mod glyphs;
mod lantern;
mod letters;
mod neon;
mod nested;
mod pinhole;
mod room;
mod shapes;
mod street;
mod town;

pub(crate) use facade::{facade, overcast_facade};
pub(crate) use glyphs::is_ink;
pub(crate) use letters::letters;
pub(crate) use neon::neon;
pub(crate) use nested::nested;
pub(crate) use street::foggy_street;
pub(crate) use town::flattened;

use crate::render::Model;

/// Part of an image that is shown enlarged: its middle, as shares of width and height.
pub(crate) type Detail = [f32; 2];

/// A scene of which two pictures are compared.
pub(crate) struct Scene {
    pub(crate) name: &'static str,
    pub(crate) model: fn() -> Model,
    /// How many surfaces light may touch, for each comparison. The last one's pictures are kept.
    pub(crate) bounces: &'static [u32],
    pub(crate) detail: Detail,
}

/// All scenes, in the order of the contact sheet.
pub(crate) const ALL: [Scene; 12] = [
    Scene { name: "room", model: room::room, bounces: &[1, 5], detail: [0.72, 0.8] },
    Scene { name: "car", model: car::car, bounces: &[1, 5], detail: [0.5, 0.62] },
    Scene { name: "lantern", model: lantern::lantern, bounces: &[4], detail: [0.3, 0.75] },
    Scene { name: "letters", model: letters, bounces: &[1], detail: [0.5, 0.41] },
    Scene { name: "pinhole", model: pinhole::pinhole, bounces: &[1], detail: [0.5, 0.5] },
    Scene { name: "facade", model: || overcast_facade(100), bounces: &[1, 3], detail: [0.4, 0.8] },
    Scene { name: "nested", model: nested, bounces: &[1], detail: [0.6, 0.7] },
    Scene { name: "neon", model: neon, bounces: &[1], detail: [0.35, 0.85] },
    Scene { name: "fog", model: fog::fog, bounces: &[2], detail: [0.5, 0.5] },
    Scene { name: "street", model: street::street, bounces: &[1, 3], detail: [0.35, 0.75] },
    Scene { name: "town", model: town::town, bounces: &[1, 3], detail: [0.35, 0.75] },
    Scene { name: "glossy", model: glossy::glossy, bounces: &[1, 5], detail: [0.42, 0.75] },
];
