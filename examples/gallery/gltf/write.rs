//! Writes a model as glTF: a `.gltf`, a `.bin` and the images as PNG.

use std::fs;
use std::path::{Path, PathBuf};

use glam::{Mat4, Vec3, Vec4};
use serde_json::{Value, json};

use crate::render::{Bitmap, Camera, Error, Filter, Lobe, Material, Mesh, Model, Wrap};

/// Writes a model; returns the path of the `.gltf`.
pub(crate) fn write(folder: &Path, name: &str, model: &Model) -> Result<PathBuf, Error> {
    let failed = |path: &Path, error: &dyn core::fmt::Display| format!("cannot write {}: {error}", path.display());
    fs::create_dir_all(folder).map_err(|error| failed(folder, &error))?;
    for (i, bitmap) in model.bitmaps.iter().enumerate() {
        let path = folder.join(image_name(name, i));
        let bytes = bitmap.bytes.as_flattened();
        let size = [bitmap.width as u32, bitmap.height as u32];
        image::save_buffer(&path, bytes, size[0], size[1], image::ColorType::Rgba8)
            .map_err(|error| failed(&path, &error))?;
    }
    let mut buffer = Buffer::default();
    let meshes: Vec<_> = model.meshes.iter().map(|mesh| buffer.add_mesh(mesh, model)).collect();
    let binary = folder.join(name).with_extension("bin");
    fs::write(&binary, &buffer.bytes).map_err(|error| failed(&binary, &error))?;

    let mut nodes: Vec<_> = (0..meshes.len()).map(|mesh| json!({ "mesh": mesh })).collect();
    nodes.push(camera_node(&model.camera));
    let scene = json!({
        "asset": { "version": "2.0", "generator": "fanlight gallery" },
        "extensionsUsed": ["KHR_materials_transmission", "KHR_materials_emissive_strength"],
        "scene": 0,
        "scenes": [{ "nodes": (0..nodes.len()).collect::<Vec<_>>() }],
        "nodes": nodes,
        "cameras": [camera(&model.camera)],
        "meshes": meshes,
        "materials": model.materials.iter().map(material).collect::<Vec<_>>(),
        "textures": (0..model.bitmaps.len()).map(|i| json!({ "source": i, "sampler": i })).collect::<Vec<_>>(),
        "images": (0..model.bitmaps.len()).map(|i| json!({ "uri": image_name(name, i) })).collect::<Vec<_>>(),
        "samplers": model.bitmaps.iter().map(sampler).collect::<Vec<_>>(),
        "buffers": [{ "uri": format!("{name}.bin"), "byteLength": buffer.bytes.len() }],
        "bufferViews": buffer.views,
        "accessors": buffer.accessors,
    });
    let path = folder.join(name).with_extension("gltf");
    fs::write(&path, serde_json::to_string_pretty(&without_empty(scene))?).map_err(|error| failed(&path, &error))?;
    Ok(path)
}

fn image_name(scene: &str, i: usize) -> String {
    format!("{scene}_{i}.png")
}

/// The format wants no empty lists.
fn without_empty(scene: Value) -> Value {
    let Value::Object(members) = scene else { return scene };
    members.into_iter().filter(|(_, value)| value != &json!([])).collect()
}

/// The binary part.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    /// Appends an array of the given number of elements; returns its accessor.
    fn add(&mut self, bytes: &[u8], count: usize, kind: [Value; 2], target: u32) -> usize {
        self.views.push(json!({
            "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len(), "target": target,
        }));
        self.bytes.extend_from_slice(bytes);
        let [component, kind] = kind;
        self.accessors.push(json!({
            "bufferView": self.views.len() - 1, "componentType": component, "count": count, "type": kind,
        }));
        self.accessors.len() - 1
    }

    fn add_mesh(&mut self, mesh: &Mesh, model: &Model) -> Value {
        const VERTICES: u32 = 34962;
        const INDICES: u32 = 34963;
        const FLOAT: u32 = 5126;
        const INTEGER: u32 = 5125;
        let positions: Vec<f32> = mesh.positions.iter().flat_map(Vec3::to_array).collect();
        let uvs: Vec<f32> = mesh.uvs.iter().flat_map(glam::Vec2::to_array).collect();
        let bytes = |values: &[f32]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<_>>();
        let count = mesh.positions.len();
        let position = self.add(&bytes(&positions), count, [json!(FLOAT), json!("VEC3")], VERTICES);
        let low = mesh.positions.iter().copied().reduce(Vec3::min).unwrap_or_default();
        let high = mesh.positions.iter().copied().reduce(Vec3::max).unwrap_or_default();
        self.accessors[position]["min"] = json!(low.to_array());
        self.accessors[position]["max"] = json!(high.to_array());
        let uv = self.add(&bytes(&uvs), count, [json!(FLOAT), json!("VEC2")], VERTICES);
        let corners: Vec<u8> = mesh.indices.as_flattened().iter().flat_map(|i| i.to_le_bytes()).collect();
        let indices = self.add(&corners, 3 * mesh.indices.len(), [json!(INTEGER), json!("SCALAR")], INDICES);
        json!({
            "name": model.materials[mesh.material].name,
            "primitives": [{
                "attributes": { "POSITION": position, "TEXCOORD_0": uv },
                "indices": indices,
                "material": mesh.material,
            }],
        })
    }
}

fn material(material: &Material) -> Value {
    let (metallic, roughness, transmission) = match material.lobe {
        Lobe::Diffuse => (0.0, 1.0, 0.0),
        Lobe::Glossy(exponent) => (1.0, (2.0 / (exponent + 2.0)).powf(0.25), 0.0),
        Lobe::Rough(alpha) => (1.0, alpha.sqrt(), 0.0),
        Lobe::Clear => (0.0, 0.0, 1.0),
        Lobe::Translucent(share) => (0.0, 1.0, share),
    };
    let mut value = json!({
        "name": material.name,
        "pbrMetallicRoughness": {
            "baseColorFactor": Vec4::from((material.color, 1.0)).to_array(),
            "metallicFactor": metallic,
            "roughnessFactor": roughness,
        },
        "doubleSided": material.two_sided,
    });
    if let Some(map) = material.color_map {
        value["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": map });
    }
    if material.masked {
        value["alphaMode"] = json!("MASK");
    }
    if transmission > 0.0 {
        value["extensions"]["KHR_materials_transmission"] = json!({ "transmissionFactor": transmission });
    }
    if material.emits() {
        let strength = material.emission.max_element();
        value["emissiveFactor"] = json!((material.emission / strength).to_array());
        value["extensions"]["KHR_materials_emissive_strength"] = json!({ "emissiveStrength": strength });
        if let Some(map) = material.emission_map {
            value["emissiveTexture"] = json!({ "index": map });
        }
    }
    value
}

fn sampler(bitmap: &Bitmap) -> Value {
    let filter = match bitmap.filter {
        Filter::Nearest => 9728,
        Filter::Bilinear => 9729,
    };
    let [s, t] = bitmap.wrap.map(|wrap| match wrap {
        Wrap::Repeat => 10497,
        Wrap::Mirror => 33648,
        Wrap::Clamp => 33071,
    });
    json!({ "magFilter": filter, "minFilter": filter, "wrapS": s, "wrapT": t })
}

fn camera(camera: &Camera) -> Value {
    let aspect = camera.width() as f32 / camera.height() as f32;
    json!({ "type": "perspective", "perspective": {
        "yfov": camera.field_of_view, "aspectRatio": aspect, "znear": 0.01,
    } })
}

fn camera_node(camera: &Camera) -> Value {
    let matrix = Mat4::from_translation(camera.position) * Mat4::from_mat3(camera.axes);
    json!({ "camera": 0, "matrix": matrix.to_cols_array() })
}
