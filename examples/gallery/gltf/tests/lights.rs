//! Lights without a surface, and portals.

use glam::Vec3;
use serde_json::{Value, json};

use super::{File, LIMITS, assert_near, brightness, brightness_by};
use crate::gltf::{Prefixes, Read, read};
use crate::render::{Lobe, Techniques, World};

/// How much two means may differ that are of different points of the same pixels.
const EXACT: f64 = 0.005;

/// The floor alone, and a light of a kind at the place of the lamp.
fn with_light(light: &Value) -> File {
    let mut file = File::lamp();
    file.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [light] } });
    let node = file.json["nodes"][0].as_object_mut().expect("a node");
    node.remove("mesh");
    file.json["nodes"][0]["extensions"] = json!({ "KHR_lights_punctual": { "light": 0 } });
    file.json["nodes"][0]["scale"] = json!([1, 1, 1]);
    // Along -z, which becomes -y.
    let half = core::f32::consts::FRAC_1_SQRT_2;
    file.json["nodes"][0]["rotation"] = json!([-half, 0, 0, half]);
    file
}

/// Brightness of the floor that the camera sees in front, of an irradiance by the step to the light's place.
fn expected(irradiance: impl Fn(Vec3) -> f64) -> f64 {
    let model = File::lamp().read().model;
    let world = World::new(&model);
    let camera = model.camera.sized([256, 192]);
    let mut sum = 0.0;
    for y in 128..192 {
        for x in 0..256 {
            let (origin, direction) = camera.ray(glam::vec2(x as f32 + 0.5, y as f32 + 0.5));
            let Some(point) = world.trace(origin, direction).1 else { continue };
            sum += irradiance(Vec3::new(0.0, 2.0, 0.0) - point.position);
        }
    }
    // Three channels, of a floor that reflects this share.
    sum / f64::from(64 * 256) * 3.0 * 0.8 / core::f64::consts::PI
}

/// Irradiance of the floor by an intensity.
fn of_intensity(intensity: f64, step: Vec3) -> f64 {
    intensity * f64::from(step.normalize().y / step.length_squared())
}

/// The sample of the reader, turned to look down, of 100 candelas straight down.
#[test]
fn measured_profiles() {
    let text = include_str!("../../ies/sample.ies");
    let uri = format!("data:application/x-ies-lm-63,{}", text.replace('%', "%25").replace('\n', "%0A"));
    let mut file = with_light(&json!({ "type": "point" }));
    file.json["extensions"] = json!({ "EXT_lights_ies": { "lights": [{ "uri": uri }] } });
    file.json["nodes"][0]["extensions"] =
        json!({ "EXT_lights_ies": { "light": 0, "multiplier": 2.0, "color": [1.0, 1.0, 1.0] } });
    let read = file.read();
    assert!(read.notes.is_empty(), "{:?}", read.notes);
    assert!(read.contents.iter().any(|line| line.contains("light profile 0")), "{:?}", read.contents);
    let table = crate::ies::read(text).expect("a valid file");
    let profile =
        fanlight::Profile { vertical: &table.vertical, horizontal: &table.horizontal, intensities: &table.intensities };
    let intensity = |step: Vec3| {
        let down = -step.normalize();
        let angles = [(-down.y).clamp(-1.0, 1.0).acos(), down.z.atan2(down.x)].map(f64::from);
        2.0 * f64::from(profile.intensity(angles))
    };
    assert_near(brightness(&read.model), expected(|step| of_intensity(intensity(step), step)), EXACT);
    // A type that there is not is refused.
    let uri = uri.replace("2.0 5 3 1 2", "2.0 5 3 4 2");
    file.json["extensions"] = json!({ "EXT_lights_ies": { "lights": [{ "uri": uri }] } });
    let error = file.error();
    assert!(error.contains("type 4") && error.contains("node 0"), "{error}");
}

/// Lamps of types A and B are aimed along -z as well: such ones light the whole half of the room in front of them.
#[test]
fn profiles_of_other_types() {
    for code in [2, 3] {
        let header = format!("IESNA:LM-63-2002%0ATILT=NONE%0A1 -1 1 2 2 {code} 2 0 0 0%0A1 1 20%0A");
        let uri = format!("data:application/x-ies-lm-63,{header}-90 90%0A-90 90%0A100 100 100 100%0A");
        let mut file = with_light(&json!({ "type": "point" }));
        file.json["extensions"] = json!({ "EXT_lights_ies": { "lights": [{ "uri": uri }] } });
        file.json["nodes"][0]["extensions"] = json!({ "EXT_lights_ies": { "light": 0 } });
        assert_near(brightness(&file.read().model), expected(|step| of_intensity(100.0, step)), EXACT);
    }
}

#[test]
fn points() {
    let read = with_light(&json!({ "type": "point", "intensity": 100, "name": "bulb" })).read();
    assert!(read.notes.is_empty(), "{:?}", read.notes);
    assert!(
        read.contents.iter().any(|line| line.contains("light 0 `bulb`") && line.contains("100")),
        "{:?}",
        read.contents
    );
    assert_near(brightness(&read.model), expected(|step| of_intensity(100.0, step)), EXACT);
}

#[test]
fn spots() {
    for [inner, outer] in [[0.3, 1.0], [0.0, 1.5], [1.0, 1.0]] {
        let angles = json!({ "innerConeAngle": inner, "outerConeAngle": outer });
        let read = with_light(&json!({ "type": "spot", "intensity": 100, "spot": angles })).read();
        assert!(read.notes.is_empty(), "{:?}", read.notes);
        // The falloff of the extension's specification.
        let falloff = |step: Vec3| {
            let height = (step.normalize().y - f32::cos(outer)) / (f32::cos(inner) - f32::cos(outer)).max(0.001);
            f64::from(height.clamp(0.0, 1.0).powi(2))
        };
        // A sharp edge crosses pixels.
        let share = if inner == outer { 0.03 } else { EXACT };
        assert_near(brightness(&read.model), expected(|step| falloff(step) * of_intensity(100.0, step)), share);
    }
}

#[test]
fn directional_lights() {
    let read = with_light(&json!({ "type": "directional", "intensity": 2.0, "color": [0.5, 0.5, 0.5] })).read();
    assert!(read.model.sky.is_none() && read.notes.is_empty(), "{:?}", read.notes);
    assert_near(brightness(&read.model), expected(|_| 1.0), EXACT);
}

#[test]
fn ranges_are_noted() {
    let read = with_light(&json!({ "type": "point", "intensity": 100, "range": 1 })).read();
    read.assert_note(&["light 0", "range is ignored"]);
    assert_near(brightness(&read.model), expected(|step| of_intensity(100.0, step)), EXACT);
}

/// A light below an emitting mesh: both sets of techniques find the sum.
#[test]
fn lights_among_meshes() {
    let mut file = File::lamp();
    file.json["nodes"][0]["translation"] = json!([0, 2.5, 0]);
    // Black, so that it does not light the floor with the light's light.
    file.json["materials"][0]["pbrMetallicRoughness"] = json!({ "baseColorFactor": [0, 0, 0, 1] });
    let mesh = brightness(&file.read().model);
    file.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{ "type": "point", "intensity": 0.3 }] } });
    let light = json!({ "KHR_lights_punctual": { "light": 0 } });
    file.push("nodes", json!({ "translation": [0, 2, 0], "extensions": light }));
    file.json["scenes"][0]["nodes"] = json!([0, 1, 2, 3]);
    let model = file.read().model;
    let sum = mesh + expected(|step| of_intensity(0.3, step));
    assert_near(brightness(&model), sum, 0.01);
    assert_near(brightness_by(&model, &Techniques::without(&model).expect("lights")), sum, 0.02);
}

/// A wall between light and floor.
#[test]
fn hidden_lights() {
    let mut file = with_light(&json!({ "type": "point", "intensity": 100 }));
    file.push("nodes", json!({ "mesh": 1, "translation": [0, 1.9, 0], "scale": [9, 1, 9] }));
    file.json["scenes"][0]["nodes"] = json!([0, 1, 2, 3]);
    assert_eq!(brightness(&file.read().model), 0.0);
}

#[test]
fn impossible_lights() {
    let error = with_light(&json!({ "type": "tube" })).error();
    assert!(error.contains("light 0") && error.contains("tube") && error.contains("node 0 `lamp`"), "{error}");
    let error = with_light(&json!({ "type": "point", "intensity": -1 })).error();
    assert!(error.contains("strength"), "{error}");
}

#[test]
fn portals_in_capitals() {
    let mut file = File::lamp();
    file.json["materials"][0] = json!({ "name": "Window.001", "alphaMode": "BLEND",
        "pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, 0.1] } });
    let read = file.read();
    assert!(read.model.is_portal(&read.model.meshes[0]));
    assert!(read.contents.iter().any(|line| line.contains("`Window.001`: a portal")), "{:?}", read.contents);
}

#[test]
fn opaque_portals_are_noted() {
    let mut file = File::lamp();
    file.json["materials"][0]["name"] = json!("Window.001");
    let read = file.read();
    read.assert_note(&["material 0 `Window.001`", "opaque", "stays a light"]);
    assert_near(file.brightness(), 1.0, 0.04);
}

#[test]
fn near_misses_are_noted() {
    let mut file = File::lamp();
    file.json["materials"][0]["name"] = json!("Big Window");
    file.read().assert_note(&["material 0 `Big Window`", "does not start"]);
    file.json["materials"][0]["name"] = json!("glass");
    file.json["nodes"][0]["name"] = json!("Window_left");
    file.read().assert_note(&["node 0 `Window_left`", "material"]);
    let read = read(&file.bytes(), None, "gl", None, LIMITS).expect("a scene");
    read.assert_note(&["material 0 `glass`", "opaque"]);
}

#[test]
fn paper_is_a_portal() {
    let mut file = File::lamp();
    file.json["materials"][0] = json!({ "name": "window", "extensions": {
        "KHR_materials_transmission": { "transmissionFactor": 0.5 } } });
    let read = file.read();
    assert_eq!(read.model.materials[read.model.meshes[0].material].lobe, Lobe::Translucent(0.5));
    assert!(read.contents[1].contains("portal meshes: 1"), "{:?}", read.contents);
}

/// What a file calls opaque is a pane if one says so, flagged or not.
#[test]
fn panes_by_name() {
    let mut file = File::lamp();
    file.json["materials"][0] = json!({ "name": "Glass.001" });
    for (portals, count) in [("glass", 1), ("window", 0)] {
        let prefixes = Prefixes { portals, panes: Some("glass") };
        let Read { model, contents, .. } = read(&file.bytes(), None, prefixes, None, LIMITS).expect("a scene");
        let material = &model.materials[model.meshes[0].material];
        assert_eq!((material.lobe, material.two_sided), (Lobe::Clear, true));
        assert!(contents[1].contains(&format!("portal meshes: {count}")), "{contents:?}");
    }
}
