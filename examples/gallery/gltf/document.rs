//! The JSON part of a glTF file, as the format lays it down. Members that nothing here reads are left out.

use serde::Deserialize;
use serde::de::{DeserializeOwned, IgnoredAny};
use serde_json::{Map, Value};

use crate::render::Error;

/// Members of extensions, by the extension's name.
pub(super) type Extensions = Map<String, Value>;

/// A whole file.
#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Document {
    pub(super) extensions_used: Vec<String>,
    pub(super) extensions_required: Vec<String>,
    pub(super) extensions: Extensions,
    pub(super) scene: Option<usize>,
    pub(super) scenes: Vec<Scene>,
    pub(super) nodes: Vec<Node>,
    pub(super) cameras: Vec<Camera>,
    pub(super) meshes: Vec<Mesh>,
    pub(super) skins: Vec<Skin>,
    pub(super) materials: Vec<Material>,
    pub(super) textures: Vec<Texture>,
    pub(super) samplers: Vec<Sampler>,
    pub(super) images: Vec<Image>,
    pub(super) accessors: Vec<Accessor>,
    pub(super) buffer_views: Vec<BufferView>,
    pub(super) buffers: Vec<Buffer>,
    pub(super) animations: Vec<IgnoredAny>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Scene {
    pub(super) name: Option<String>,
    pub(super) nodes: Vec<usize>,
    pub(super) extensions: Extensions,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Node {
    pub(super) name: Option<String>,
    pub(super) children: Vec<usize>,
    pub(super) matrix: Option<[f32; 16]>,
    pub(super) translation: Option<[f32; 3]>,
    pub(super) rotation: Option<[f32; 4]>,
    pub(super) scale: Option<[f32; 3]>,
    pub(super) mesh: Option<usize>,
    pub(super) skin: Option<usize>,
    pub(super) camera: Option<usize>,
    pub(super) weights: Vec<f32>,
    pub(super) extensions: Extensions,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Camera {
    pub(super) name: Option<String>,
    pub(super) perspective: Option<Perspective>,
    pub(super) orthographic: Option<Orthographic>,
}

#[derive(Deserialize)]
pub(super) struct Perspective {
    pub(super) yfov: f32,
}

#[derive(Deserialize)]
pub(super) struct Orthographic {
    pub(super) ymag: f32,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Mesh {
    pub(super) name: Option<String>,
    pub(super) primitives: Vec<Primitive>,
    pub(super) weights: Vec<f32>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Primitive {
    pub(super) attributes: Map<String, Value>,
    pub(super) indices: Option<usize>,
    pub(super) material: Option<usize>,
    pub(super) mode: Option<u32>,
    pub(super) targets: Vec<Map<String, Value>>,
    pub(super) extensions: Extensions,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Skin {
    pub(super) name: Option<String>,
    pub(super) inverse_bind_matrices: Option<usize>,
    pub(super) joints: Vec<usize>,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Material {
    pub(super) name: Option<String>,
    pub(super) pbr_metallic_roughness: Metallic,
    pub(super) normal_texture: Option<TextureInfo>,
    pub(super) occlusion_texture: Option<TextureInfo>,
    pub(super) emissive_texture: Option<TextureInfo>,
    pub(super) emissive_factor: [f32; 3],
    pub(super) alpha_mode: Option<String>,
    pub(super) alpha_cutoff: Option<f32>,
    pub(super) double_sided: bool,
    pub(super) extensions: Extensions,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Metallic {
    pub(super) base_color_factor: [f32; 4],
    pub(super) base_color_texture: Option<TextureInfo>,
    pub(super) metallic_factor: f32,
    pub(super) roughness_factor: f32,
    pub(super) metallic_roughness_texture: Option<TextureInfo>,
}

impl Default for Metallic {
    fn default() -> Self {
        Self {
            base_color_factor: [1.0; 4],
            base_color_texture: None,
            metallic_factor: 1.0,
            roughness_factor: 1.0,
            metallic_roughness_texture: None,
        }
    }
}

#[derive(Clone, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct TextureInfo {
    pub(super) index: usize,
    #[serde(default)]
    pub(super) tex_coord: u32,
    #[serde(default)]
    pub(super) extensions: Extensions,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Texture {
    pub(super) name: Option<String>,
    pub(super) source: Option<usize>,
    pub(super) sampler: Option<usize>,
    pub(super) extensions: Extensions,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Sampler {
    pub(super) mag_filter: Option<u32>,
    pub(super) wrap_s: Option<u32>,
    pub(super) wrap_t: Option<u32>,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Image {
    pub(super) name: Option<String>,
    pub(super) uri: Option<String>,
    pub(super) buffer_view: Option<usize>,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Accessor {
    pub(super) buffer_view: Option<usize>,
    pub(super) byte_offset: usize,
    pub(super) component_type: u32,
    pub(super) normalized: bool,
    pub(super) count: usize,
    #[serde(rename = "type")]
    pub(super) kind: String,
    pub(super) sparse: Option<Sparse>,
}

#[derive(Deserialize)]
pub(super) struct Sparse {
    pub(super) count: usize,
    pub(super) indices: SparsePart,
    pub(super) values: SparsePart,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparsePart {
    pub(super) buffer_view: usize,
    #[serde(default)]
    pub(super) byte_offset: usize,
    /// Type of the indices; the values are of the accessor's type.
    #[serde(default)]
    pub(super) component_type: u32,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct BufferView {
    pub(super) buffer: usize,
    pub(super) byte_offset: usize,
    pub(super) byte_length: usize,
    pub(super) byte_stride: Option<usize>,
    pub(super) extensions: Extensions,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Buffer {
    pub(super) uri: Option<String>,
    pub(super) byte_length: usize,
}

/// Reads the members of an extension, if it is there.
pub(super) fn extension<T: DeserializeOwned>(extensions: &Extensions, name: &str) -> Result<Option<T>, Error> {
    let Some(value) = extensions.get(name) else { return Ok(None) };
    T::deserialize(value).map(Some).map_err(|error| format!("its {name} cannot be read ({error})").into())
}

/// The accessor of an attribute, by the attribute's name.
pub(super) fn attribute(attributes: &Map<String, Value>, name: &str) -> Result<Option<usize>, Error> {
    let Some(value) = attributes.get(name) else { return Ok(None) };
    let index = value.as_u64().and_then(|index| usize::try_from(index).ok());
    index.map(Some).ok_or_else(|| format!("its {name} is {value}, but must be the number of an accessor").into())
}

/// What messages call a part of the file: its kind, its number and its name.
pub(super) fn called(kind: &str, index: usize, name: Option<&str>) -> String {
    match name {
        Some(name) if !name.is_empty() => format!("{kind} {index} `{}`", name.escape_debug()),
        _ => format!("{kind} {index}"),
    }
}

/// A member of a list of the file.
pub(super) fn member<'a, T>(list: &'a [T], kind: &str, index: usize) -> Result<&'a T, Error> {
    list.get(index).ok_or_else(|| format!("there is no {kind} {index}, the file has {}", list.len()).into())
}

impl Document {
    /// What messages call a node.
    pub(super) fn node(&self, index: usize) -> String {
        called("node", index, self.nodes.get(index).and_then(|node| node.name.as_deref()))
    }

    /// What messages call a mesh.
    pub(super) fn mesh(&self, index: usize) -> String {
        called("mesh", index, self.meshes.get(index).and_then(|mesh| mesh.name.as_deref()))
    }

    /// What messages call a material.
    pub(super) fn material(&self, index: usize) -> String {
        called("material", index, self.materials.get(index).and_then(|material| material.name.as_deref()))
    }

    /// What messages call an image.
    pub(super) fn image(&self, index: usize) -> String {
        let image = self.images.get(index);
        let uri = image.and_then(|image| image.uri.as_deref()).filter(|uri| !uri.starts_with("data:"));
        called("image", index, image.and_then(|image| image.name.as_deref()).or(uri))
    }
}
