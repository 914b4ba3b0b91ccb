//! Reads a model from glTF.

use std::path::Path;

use glam::{Mat3, Mat4, Vec2, Vec3};
use gltf::image::Source;

use super::surface;
use crate::render::{Camera, Error, Mesh, Model, Sky};

/// Longest side of a scene: what is further than a thousand kilometres is a mistake in its units.
const LARGEST: f32 = 1e6;
/// And the shortest.
const SMALLEST: f32 = 1e-3;
/// Most triangles of a scene.
const MOST: usize = 50_000_000;

/// Reads a scene. Its environment is not in the file.
pub(crate) fn read(path: &Path, portal_prefix: &str, sky: Option<Sky>) -> Result<Model, Error> {
    read_model(path, portal_prefix, sky).map_err(|error| format!("cannot read {}: {error}", path.display()).into())
}

fn read_model(path: &Path, portal_prefix: &str, sky: Option<Sky>) -> Result<Model, Error> {
    let bytes = std::fs::read(path)?;
    let file = gltf::Gltf::from_slice(&bytes).map_err(|error| format!("this is not a glTF 2.0 file ({error})"))?;
    let folder = path.parent();
    let buffers = gltf::import_buffers(&file.document, folder, file.blob)
        .map_err(|error| format!("its .bin file cannot be read ({error})"))?;
    let images: Vec<_> = (file.document.images().enumerate())
        .map(|(i, image)| {
            gltf::image::Data::from_source(image.source(), folder, &buffers).map_err(|error| {
                let name = match image.source() {
                    Source::Uri { uri, .. } if !uri.starts_with("data:") => uri,
                    _ => image.name().unwrap_or("inside of the file"),
                };
                format!("its image {i} ({name}) cannot be read ({error})")
            })
        })
        .collect::<Result<_, _>>()?;

    let scene = file.document.default_scene().or_else(|| file.document.scenes().next()).ok_or("it holds no scene")?;
    let camera = Camera::looking(Vec3::ONE, Vec3::ZERO, 60.0);
    let mut reader = Reader { model: Model::new(camera, sky), buffers, has_camera: false };
    portal_prefix.clone_into(&mut reader.model.portal_prefix);
    for material in file.document.materials() {
        let read = surface::material(&material, &images, &mut reader.model.bitmaps)?;
        reader.model.materials.push(read);
    }
    // For meshes without a material.
    reader.model.material(crate::render::Material::new("", Vec3::splat(0.8)));
    for node in scene.nodes() {
        reader.add_node(&node, Mat4::IDENTITY)?;
    }
    reader.finish()
}

struct Reader {
    model: Model,
    buffers: Vec<gltf::buffer::Data>,
    has_camera: bool,
}

impl Reader {
    fn add_node(&mut self, node: &gltf::Node<'_>, parent: Mat4) -> Result<(), Error> {
        let transform = parent * Mat4::from_cols_array_2d(&node.transform().matrix());
        for primitive in node.mesh().iter().flat_map(gltf::Mesh::primitives) {
            if primitive.mode() == gltf::mesh::Mode::Triangles {
                self.add_primitive(&primitive, node.name().unwrap_or("without a name"), transform)?;
            }
        }
        if let Some(camera) = node.camera().filter(|_| !self.has_camera)
            && let gltf::camera::Projection::Perspective(perspective) = camera.projection()
        {
            let axes = Mat3::from_mat4(transform);
            let axes = Mat3::from_cols(axes.x_axis.normalize(), axes.y_axis.normalize(), axes.z_axis.normalize());
            self.model.camera = Camera::new(transform.w_axis.truncate(), axes, perspective.yfov());
            self.has_camera = true;
        }
        node.children().try_for_each(|child| self.add_node(&child, transform))
    }

    fn add_primitive(&mut self, primitive: &gltf::Primitive<'_>, name: &str, transform: Mat4) -> Result<(), Error> {
        let reader = primitive.reader(|buffer| Some(&self.buffers[buffer.index()]));
        let positions = reader.read_positions().ok_or_else(|| format!("mesh `{name}` has no positions"))?;
        let positions: Vec<Vec3> = positions.map(|position| transform.transform_point3(position.into())).collect();
        let indices: Vec<u32> = match reader.read_indices() {
            Some(indices) => indices.into_u32().collect(),
            None => (0..positions.len() as u32).collect(),
        };
        let mirrored = Mat3::from_mat4(transform).determinant() < 0.0;
        let indices: Vec<[u32; 3]> = (indices.as_chunks::<3>().0.iter())
            .map(|&[a, b, c]| if mirrored { [a, c, b] } else { [a, b, c] })
            .collect();
        if let Some(index) = indices.as_flattened().iter().find(|&&index| index as usize >= positions.len()) {
            return Err(format!("mesh `{name}` uses vertex {index}, but has {}", positions.len()).into());
        }
        let set = surface::coordinate_set(&primitive.material());
        let uvs: Vec<Vec2> = match (set, set.and_then(|set| reader.read_tex_coords(set))) {
            (_, Some(uvs)) => uvs.into_f32().map(Vec2::from).collect(),
            (None, None) => vec![Vec2::ZERO; positions.len()],
            (Some(set), None) => {
                let material = primitive.material().name().unwrap_or_default().to_owned();
                return Err(format!(
                    "mesh `{name}` has no texture coordinates TEXCOORD_{set}, but its material `{material}` has an image"
                )
                .into());
            }
        };
        let material = primitive.material().index().unwrap_or(self.model.materials.len() - 1);
        self.model.add(Mesh { positions, uvs, indices, material, ..Mesh::default() });
        Ok(())
    }

    /// Checks what was read, and tells what fanlight will do with it.
    fn finish(mut self) -> Result<Model, Error> {
        let corners = || self.model.meshes.iter().flat_map(|mesh| mesh.positions.iter().copied());
        if let Some(corner) = corners().find(|corner| !corner.is_finite()) {
            return Err(format!("a vertex is at {corner}").into());
        }
        let [Some(low), Some(high)] = [corners().reduce(Vec3::min), corners().reduce(Vec3::max)] else {
            return Err("it holds no triangles".into());
        };
        let size = (high - low).max_element().max(low.abs().max_element()).max(high.abs().max_element());
        if !(SMALLEST..=LARGEST).contains(&size) {
            return Err(format!(
                "the scene reaches from {low} to {high}, but its size must be from {SMALLEST} to {LARGEST:e} metres; \
                 was it exported in other units?"
            )
            .into());
        }
        let triangles: usize = self.model.meshes.iter().map(|mesh| mesh.indices.len()).sum();
        if triangles > MOST {
            return Err(format!("it holds {triangles} triangles, but at most {MOST} are rendered").into());
        }
        if !self.has_camera {
            eprintln!("note: the file has no camera; looking from a corner of the scene to its middle");
            self.model.camera = Camera::looking(low.lerp(high, 0.95), low.lerp(high, 0.45), 60.0);
        }
        let count = |wanted: &dyn Fn(&Mesh) -> bool| self.model.meshes.iter().filter(|mesh| wanted(mesh)).count();
        let portals = count(&|mesh| self.model.is_portal(mesh));
        let emitters = count(&|mesh| self.model.materials[mesh.material].emits());
        println!("triangles: {triangles}, portal meshes: {portals}, emitting meshes: {emitters}");
        if portals + emitters == 0 {
            eprintln!(
                "note: no material emits light, and none has a name that starts with `{}`: there is nothing to gain",
                self.model.portal_prefix
            );
        }
        Ok(self.model)
    }
}
