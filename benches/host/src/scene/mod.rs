//! What pictures are taken of.

mod building;
mod catalogue;
mod cornell;
mod data;
mod dome;
mod lamps;
mod night;
mod room;
mod scene_file;
mod skies;
mod star;
mod street;
mod texture;
mod two_rooms;

use std::sync::Arc;

use glam::Vec3;

use crate::bsdf::Material;
use crate::camera::Camera;
use crate::geometry::{Mesh, Rectangle};
use crate::sky::Sky;

pub(crate) use catalogue::{ENTRIES, Entry};
pub(crate) use data::Data;
pub(crate) use scene_file::{Surroundings, read};
pub(crate) use texture::Texture;

/// Radiance of an emitter, the same in all channels.
#[derive(Clone, Debug)]
pub(crate) enum Radiance {
    Constant(f32),
    /// A texture, seen through the mesh's texture coordinates.
    Textured(Arc<Texture>),
}

/// A mesh that emits light from its front. It reflects none.
#[derive(Clone, Debug)]
pub(crate) struct Emitter {
    pub(crate) mesh: Mesh,
    pub(crate) radiance: Radiance,
}

/// An opening that the sky shines in through. Its front faces the room.
#[derive(Clone, Debug)]
pub(crate) struct Portal {
    pub(crate) mesh: Mesh,
    /// The opening, if it is a rectangle.
    pub(crate) rectangle: Option<Rectangle>,
}

impl From<Rectangle> for Portal {
    fn from(rectangle: Rectangle) -> Self {
        Self { mesh: rectangle.mesh(), rectangle: Some(rectangle) }
    }
}

/// A scene.
#[derive(Clone, Debug)]
pub(crate) struct Scene {
    pub(crate) camera: Camera,
    /// What reflects light, on both sides.
    pub(crate) solids: Vec<(Mesh, Material)>,
    pub(crate) emitters: Vec<Emitter>,
    pub(crate) portals: Vec<Portal>,
    pub(crate) sky: Option<Sky>,
    /// Two corners of the box that holds all surfaces, if it is a closed one: rounding puts some points near its
    /// corners on the wrong side of a wall, where a single one in the sun outshines the corner.
    pub(crate) inside: Option<[Vec3; 2]>,
}
