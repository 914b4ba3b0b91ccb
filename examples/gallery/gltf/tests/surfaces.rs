//! Materials and images.

use serde_json::json;

use super::{File, assert_near};
use crate::render::Lobe;

/// A lamp whose image is lit in its left quarter.
fn quarter() -> File {
    let mut file = File::lamp();
    let texture = file.texture(|x, _| if x < 2 { [255; 4] } else { [0, 0, 0, 255] });
    file.json["materials"][0]["emissiveTexture"] = json!({ "index": texture });
    file
}

/// Coordinates that read the lit quarter alone.
fn left(file: &mut File) -> usize {
    file.floats("VEC2", &[0.0, 0.0, 0.24, 0.0, 0.24, 1.0, 0.0, 1.0])
}

#[test]
fn texture_transforms() {
    let mut file = quarter();
    assert_near(file.brightness(), 0.25, 0.05);
    file.json["extensionsRequired"] = json!(["KHR_texture_transform"]);
    let mut transform = |transform: serde_json::Value| {
        file.json["materials"][0]["emissiveTexture"]["extensions"] = json!({ "KHR_texture_transform": transform });
        file.brightness()
    };
    assert_near(transform(json!({ "scale": [0.24, 1] })), 1.0, 0.04);
    assert_near(transform(json!({ "scale": [0.24, 1], "offset": [1.5, 0] })) + 1.0, 1.0, 0.01);
    // A quarter turn reads the image's columns along the square's rows, upwards.
    assert_near(transform(json!({ "rotation": core::f32::consts::FRAC_PI_2, "scale": [1, 0.24] })), 1.0, 0.04);
}

#[test]
fn turns_are_counter_clockwise() {
    let mut file = quarter();
    let turn = json!({ "KHR_texture_transform": { "rotation": core::f32::consts::FRAC_PI_2 } });
    file.json["materials"][0]["emissiveTexture"]["extensions"] = turn;
    let uv = file.read().model.meshes[0].uvs[1];
    assert!(uv.abs_diff_eq(glam::vec2(0.0, -1.0), 1e-6), "{uv}");
}

#[test]
fn a_set_of_coordinates_for_each_image() {
    let mut file = quarter();
    let set = left(&mut file);
    file.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = json!(set);
    file.json["materials"][0]["emissiveTexture"]["texCoord"] = json!(1);
    assert_near(file.brightness(), 1.0, 0.04);
    let gray = file.texture(|_, _| [128; 4]);
    file.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": gray });
    assert_near(file.brightness(), 1.0, 0.04);
    // The transform's set counts, not that of the texture.
    file.json["materials"][0]["emissiveTexture"] =
        json!({ "index": 0, "extensions": { "KHR_texture_transform": { "texCoord": 1 } } });
    assert_near(file.brightness(), 1.0, 0.04);
    file.json["materials"][0]["emissiveTexture"] = json!({ "index": 0, "texCoord": 2 });
    file.read().assert_note(&["mesh 0", "TEXCOORD_2"]);
}

#[test]
fn colors_of_vertices() {
    for (kind, bytes) in [("VEC3", vec![0_u8; 16]), ("VEC4", [0, 0, 0, 255].repeat(4))] {
        let mut file = File::lamp();
        let colors = file.array(5121, kind, 4, &bytes);
        file.json["accessors"][colors]["normalized"] = json!(true);
        file.json["meshes"][1]["primitives"][0]["attributes"]["COLOR_0"] = json!(colors);
        assert_eq!(file.brightness(), 0.0);
        // They do not change what is emitted.
        file.json["meshes"][1]["primitives"][0]["attributes"] = json!({ "POSITION": 0 });
        file.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(colors);
        assert_near(file.brightness(), 1.0, 0.04);
    }
}

#[test]
fn alpha_of_vertices() {
    let mut file = File::lamp();
    let colors = file.floats("VEC4", &[1.0, 1.0, 1.0, 0.5].repeat(4));
    file.json["meshes"][1]["primitives"][0]["attributes"]["COLOR_0"] = json!(colors);
    assert!(file.read().notes.is_empty());
    file.json["materials"][1]["alphaMode"] = json!("BLEND");
    file.read().assert_note(&["mesh 1", "alpha"]);
}

#[test]
fn gray_vertices() {
    let mut file = File::lamp();
    let colors = file.floats("VEC3", &[0.5; 12]);
    file.json["meshes"][1]["primitives"][0]["attributes"]["COLOR_0"] = json!(colors);
    assert_near(file.brightness(), 0.5, 0.05);
}

#[test]
fn unlit() {
    let mut file = File::lamp();
    file.json["materials"][0] = json!({
        "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.5, 0.5, 1] },
        "extensions": { "KHR_materials_unlit": {} },
    });
    file.json["extensionsRequired"] = json!(["KHR_materials_unlit"]);
    assert_near(file.brightness(), 0.5, 0.04);
    file.read().assert_note(&["material 0", "unlit"]);
    let colors = file.floats("VEC3", &[0.5; 12]);
    file.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(colors);
    assert_near(file.brightness(), 0.25, 0.04);
}

#[test]
fn variants_and_other_materials_are_noted() {
    let mut file = File::lamp();
    file.json["extensionsRequired"] = json!(["KHR_materials_variants", "KHR_materials_clearcoat"]);
    file.json["extensions"] = json!({ "KHR_materials_variants": { "variants": [{ "name": "red" }] } });
    file.json["materials"][1]["extensions"] = json!({ "KHR_materials_clearcoat": { "clearcoatFactor": 1 } });
    file.json["materials"][1]["normalTexture"] = json!({ "index": 0 });
    let read = file.read();
    read.assert_note(&["KHR_materials_variants", "default material"]);
    read.assert_note(&["material 1 `floor`", "KHR_materials_clearcoat"]);
    read.assert_note(&["material 1 `floor`", "normal map"]);
}

#[test]
fn metallic_and_roughness_of_an_image() {
    let mut file = File::lamp();
    let texture = file.texture(|_, _| [0, 255, 0, 255]);
    file.json["materials"][1]["pbrMetallicRoughness"] =
        json!({ "metallicRoughnessTexture": { "index": texture }, "baseColorFactor": [0.8, 0.8, 0.8, 1] });
    let read = file.read();
    assert_eq!(read.model.materials[read.model.meshes[1].material].lobe, Lobe::Diffuse);
    read.assert_note(&["material 1 `floor`", "means of their image"]);
}

#[test]
fn materials_share_images() {
    let mut file = quarter();
    file.json["materials"][1]["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": 0 });
    assert_eq!(file.read().model.bitmaps.len(), 1);
}

const KTX2: &[u8] = b"\xabKTX 20\xbb\r\n\x1a\n";

#[test]
fn images_that_nothing_needs() {
    let mut file = quarter();
    let other = file.texture_of("image/ktx2", KTX2);
    file.json["materials"][0]["normalTexture"] = json!({ "index": other });
    file.push("materials", json!({ "emissiveTexture": { "index": other }, "emissiveFactor": [1, 1, 1] }));
    file.json["materials"][1]["emissiveTexture"] = json!({ "index": other });
    let read = file.read();
    assert!(read.contents.contains(&"image 1: not needed".to_owned()), "{:?}", read.contents);
    file.json["materials"][0]["emissiveTexture"]["index"] = json!(other);
    file.json["images"][1]["name"] = json!("glow");
    let error = file.error();
    assert!(
        error.contains("image 1 `glow`") && error.contains("KTX2") && error.contains("material 0 `lamp`"),
        "{error}"
    );
}

#[test]
fn images_beside_others() {
    for name in ["KHR_texture_basisu", "EXT_texture_webp"] {
        let mut file = quarter();
        file.texture_of("image/ktx2", KTX2);
        file.json["textures"][0]["extensions"] = json!({ name: { "source": 1 } });
        assert_near(file.brightness(), 0.25, 0.05);
    }
}

#[test]
fn impossible_emission() {
    let mut file = File::lamp();
    file.json["materials"][0]["emissiveFactor"] = json!([-1, 0, 0]);
    let error = file.error();
    assert!(error.contains("material 0 `lamp`") && error.contains("emission"), "{error}");
}
