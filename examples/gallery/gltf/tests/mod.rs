//! Reads files that the tests make: a lamp of one square meter two meters above a floor, and what else there is to a
//! file.

mod broken;
mod geometry;
mod lights;
mod nodes;
mod surfaces;
mod unpacking;

use glam::Vec3;
use image::{ImageFormat, Rgba, RgbaImage};
use serde_json::{Value, json};

use super::{Limits, Read, read};
use crate::render::{Budget, Error, Model, PathTracer, Progressive, Techniques, World};

/// Pixels of the pictures.
const SIZE: [u32; 2] = [32, 24];
/// What a test may read.
const LIMITS: Limits = Limits { triangles: 10_000, bytes: 1 << 20 };

/// A file that is being made.
pub(super) struct File {
    pub(super) json: Value,
    bytes: Vec<u8>,
}

impl File {
    /// The lamp is node, mesh and material 0, the floor 1; the camera is node 2.
    pub(super) fn lamp() -> Self {
        let mut file = Self { json: json!({ "asset": { "version": "2.0" }, "scene": 0 }), bytes: vec![] };
        let square = [[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0], [1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]];
        let position = file.floats("VEC3", square.as_flattened());
        let indices = file.shorts(&[0, 1, 2, 0, 2, 3]);
        let uv = file.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0]);
        assert_eq!([position, indices, uv], [0, 1, 2]);
        let mesh = |material: usize| {
            json!({ "primitives": [{
                "attributes": { "POSITION": 0, "TEXCOORD_0": 2 }, "indices": 1, "material": material,
            }] })
        };
        let floor = json!({ "metallicFactor": 0, "baseColorFactor": [0.8, 0.8, 0.8, 1] });
        let camera = json!({ "type": "perspective", "perspective": { "yfov": 0.8, "znear": 0.01 } });
        for (name, value) in [
            ("scenes", json!([{ "nodes": [0, 1, 2] }])),
            (
                "nodes",
                json!([
                    { "name": "lamp", "mesh": 0, "translation": [0, 2, 0], "scale": [0.5, 1, 0.5] },
                    { "name": "floor", "mesh": 1, "scale": [4, 1, 4] },
                    { "camera": 0, "translation": [0, 1.2, 5], "rotation": [-0.1, 0, 0, 0.995] },
                ]),
            ),
            ("meshes", json!([mesh(0), mesh(1)])),
            (
                "materials",
                json!([
                    { "name": "lamp", "emissiveFactor": [1, 1, 1] },
                    { "name": "floor", "doubleSided": true, "pbrMetallicRoughness": floor },
                ]),
            ),
            ("cameras", json!([camera])),
        ] {
            file.json[name] = value;
        }
        file
    }

    /// Adds an array; returns the accessor's number.
    pub(super) fn array(&mut self, component: u32, kind: &str, count: usize, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let start = self.bytes.len();
        self.bytes.extend_from_slice(bytes);
        let view = self.push("bufferViews", json!({ "buffer": 0, "byteOffset": start, "byteLength": bytes.len() }));
        self.push("accessors", json!({ "bufferView": view, "componentType": component, "count": count, "type": kind }))
    }

    pub(super) fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let size = match kind {
            "SCALAR" => 1,
            "MAT4" => 16,
            kind => usize::from(kind.as_bytes()[3] - b'0'),
        };
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.array(5126, kind, values.len() / size, &bytes)
    }

    pub(super) fn shorts(&mut self, values: &[u16]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.array(5123, "SCALAR", values.len(), &bytes)
    }

    /// Adds a texture of 8×8 texels; returns its number.
    pub(super) fn texture(&mut self, texel: impl Fn(u32, u32) -> [u8; 4]) -> usize {
        let image = RgbaImage::from_fn(8, 8, |x, y| Rgba(texel(x, y)));
        let mut png = std::io::Cursor::new(vec![]);
        image.write_to(&mut png, ImageFormat::Png).expect("a PNG");
        self.texture_of("image/png", png.get_ref())
    }

    /// Adds a texture of an image's bytes, which is read by the nearest texel.
    pub(super) fn texture_of(&mut self, kind: &str, bytes: &[u8]) -> usize {
        let uri = format!("data:{kind};base64,{}", base64(bytes));
        let image = self.push("images", json!({ "uri": uri }));
        let sampler = self.push("samplers", json!({ "magFilter": 9728 }));
        self.push("textures", json!({ "source": image, "sampler": sampler }))
    }

    /// Appends to a list; returns the number of the new member.
    pub(super) fn push(&mut self, list: &str, value: Value) -> usize {
        if self.json[list].is_null() {
            self.json[list] = json!([]);
        }
        let list = self.json[list].as_array_mut().expect("a list");
        list.push(value);
        list.len() - 1
    }

    /// The file as it is stored.
    pub(super) fn bytes(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        let uri = format!("data:application/octet-stream;base64,{}", base64(&self.bytes));
        json["buffers"] = json!([{ "byteLength": self.bytes.len(), "uri": uri }]);
        json.to_string().into_bytes()
    }

    /// The file as a `.glb`.
    pub(super) fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"] = json!([{ "byteLength": self.bytes.len() }]);
        let mut json = json.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut glb = b"glTF\x02\0\0\0".to_vec();
        glb.extend(((28 + json.len() + self.bytes.len()) as u32).to_le_bytes());
        for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &self.bytes)] {
            glb.extend((chunk.len() as u32).to_le_bytes());
            glb.extend(kind);
            glb.extend(chunk);
        }
        glb
    }

    pub(super) fn try_read(&self) -> Result<Read, Error> {
        read(&self.bytes(), None, "window", None, LIMITS)
    }

    #[track_caller]
    pub(super) fn read(&self) -> Read {
        self.try_read().expect("a scene")
    }

    /// Why the file is refused.
    #[track_caller]
    pub(super) fn error(&self) -> String {
        let error = self.try_read().map(|_| ()).expect_err("no scene").to_string();
        assert!(!error.contains('\n') && error.len() < 400, "{error}");
        error
    }

    /// The brightness of the floor in front, in that of the plain lamp's.
    #[track_caller]
    pub(super) fn brightness(&self) -> f64 {
        brightness(&self.read().model) / brightness(&Self::lamp().read().model)
    }
}

impl Read {
    /// Whether a note holds all of some words.
    #[track_caller]
    pub(super) fn assert_note(&self, words: &[&str]) {
        let is_there = self.notes.iter().any(|note| words.iter().all(|word| note.contains(word)));
        assert!(is_there, "none of {:#?} holds {words:?}", self.notes);
    }

    /// Triangles of a mesh of the model.
    pub(super) fn corners(&self, mesh: usize) -> Vec<[Vec3; 3]> {
        let mesh = &self.model.meshes[mesh];
        mesh.indices.iter().map(|corners| corners.map(|i| mesh.positions[i as usize])).collect()
    }

    /// Area of a mesh of the model.
    pub(super) fn area(&self, mesh: usize) -> f32 {
        self.corners(mesh).iter().map(|[a, b, c]| 0.5 * (*b - *a).cross(*c - *a).length()).sum()
    }
}

/// Mean of the lower third of a picture.
pub(super) fn brightness(model: &Model) -> f64 {
    brightness_by(model, &Techniques::plain(model).expect("lights"))
}

/// Mean of the lower third of a picture by some techniques.
pub(super) fn brightness_by(model: &Model, techniques: &Techniques) -> f64 {
    let world = World::new(model);
    let tracer = PathTracer::new(&world, techniques, 2);
    let camera = model.camera.sized(SIZE);
    let image = Progressive { tracer, camera, seed: 1 }.render(Budget::Samples(128), drop).0.image();
    let lower = &image.pixels[image.pixels.len() * 2 / 3..];
    lower.iter().map(|pixel| f64::from(pixel.element_sum())).sum::<f64>() / lower.len() as f64
}

pub(super) fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for chunk in bytes.chunks(3) {
        let bits = (0..3).fold(0_u32, |bits, i| bits << 8 | u32::from(chunk.get(i).copied().unwrap_or(0)));
        for i in 0..4 {
            let letter = LETTERS[(bits >> (18 - 6 * i)) as usize & 63];
            text.push(if i <= chunk.len() { char::from(letter) } else { '=' });
        }
    }
    text
}

#[track_caller]
pub(super) fn assert_near(found: f64, expected: f64, share: f64) {
    assert!((found / expected - 1.0).abs() < share, "{found} instead of {expected}");
}

#[test]
fn plain() {
    let file = File::lamp();
    let plain = file.read();
    assert!(plain.notes.is_empty(), "{:?}", plain.notes);
    assert_eq!(plain.area(0), 1.0);
    let glb = read(&file.glb(), None, "window", None, LIMITS).expect("a scene");
    assert_eq!(glb.model.meshes[0].positions, plain.model.meshes[0].positions);
    assert!(plain.contents.iter().any(|line| line.starts_with("material 0 `lamp`: a light")), "{:?}", plain.contents);
}
