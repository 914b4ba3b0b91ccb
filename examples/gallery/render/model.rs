//! A scene as it is described: by a file, or by one of the built-in generators.

use super::alloc::sync::Arc;

use glam::Vec3;

use super::bitmap::Bitmap;
use super::camera::Camera;
use super::lamp::Lamp;
use super::material::{Lobe, Material};
use super::mesh::Mesh;
use super::sky::Sky;

/// Fog that is the same everywhere in a box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fog {
    pub(crate) low: Vec3,
    pub(crate) high: Vec3,
    /// How much of the light is scattered, per length.
    pub(crate) density: f32,
}

/// Everything that a picture is made of.
#[derive(Clone)]
pub(crate) struct Model {
    pub(crate) meshes: Vec<Mesh>,
    /// Lights without a surface.
    pub(crate) lamps: Vec<Lamp>,
    pub(crate) materials: Vec<Material>,
    pub(crate) bitmaps: Vec<Bitmap>,
    pub(crate) camera: Camera,
    /// What is seen outside; nothing if there is none.
    pub(crate) sky: Option<Arc<Sky>>,
    /// Texels a side of the sky's image that guides the sampling; as many as it has itself if there is no number.
    pub(crate) guide_texels: Option<usize>,
    pub(crate) fog: Option<Fog>,
    /// Materials whose names start with this are portals, in capitals or not.
    pub(crate) portal_prefix: String,
}

impl Model {
    /// An empty scene.
    pub(crate) fn new(camera: Camera, sky: Option<Sky>) -> Self {
        Self {
            meshes: Vec::new(),
            lamps: Vec::new(),
            materials: Vec::new(),
            bitmaps: Vec::new(),
            camera,
            sky: sky.map(Arc::new),
            guide_texels: None,
            fog: None,
            portal_prefix: "window".to_owned(),
        }
    }

    /// Adds a material; returns an empty mesh of it.
    pub(crate) fn material(&mut self, material: Material) -> Mesh {
        self.materials.push(material);
        Mesh::of(self.materials.len() - 1)
    }

    /// Adds an image.
    pub(crate) fn bitmap(&mut self, bitmap: Bitmap) -> usize {
        self.bitmaps.push(bitmap);
        self.bitmaps.len() - 1
    }

    /// Adds a mesh.
    pub(crate) fn add(&mut self, mesh: Mesh) {
        self.meshes.push(mesh);
    }

    /// Distance from the lowest corner to the highest one; 1 if there is nothing.
    pub(crate) fn diagonal(&self) -> f32 {
        let corners = || self.meshes.iter().flat_map(|mesh| mesh.positions.iter().copied());
        let (low, high) = (corners().reduce(Vec3::min), corners().reduce(Vec3::max));
        low.zip(high).map_or(1.0, |(low, high)| (high - low).length())
    }

    /// Whether there are rough mirrors.
    pub(crate) fn has_rough(&self) -> bool {
        self.materials.iter().any(|material| matches!(material.lobe, Lobe::Rough(_)))
    }

    /// Whether a mesh was flagged as a portal by the name of its material, in capitals or not.
    pub(crate) fn is_portal(&self, mesh: &Mesh) -> bool {
        let start = self.materials[mesh.material].name.get(..self.portal_prefix.len());
        start.is_some_and(|start| start.eq_ignore_ascii_case(&self.portal_prefix))
    }
}
