//! Lights without a surface, and portals.

use glam::Vec3;
use serde_json::{Value, json};

use super::{File, LIMITS, assert_near, brightness};
use crate::gltf::read;
use crate::render::{Lobe, World};

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
    let camera = model.camera.sized([64, 48]);
    let mut sum = 0.0;
    for y in 32..48 {
        for x in 0..64 {
            let (origin, direction) = camera.ray(glam::vec2(x as f32 + 0.5, y as f32 + 0.5));
            let Some(point) = world.trace(origin, direction).1 else { continue };
            sum += irradiance(Vec3::new(0.0, 2.0, 0.0) - point.position);
        }
    }
    // Three channels, of a floor that reflects so much.
    sum / f64::from(16 * 64) * 3.0 * 0.8 / core::f64::consts::PI
}

/// Irradiance of the floor by an intensity.
fn of_intensity(intensity: f64, step: Vec3) -> f64 {
    intensity * f64::from(step.normalize().y / step.length_squared())
}

#[test]
fn points() {
    let read = with_light(&json!({ "type": "point", "intensity": 100, "name": "bulb" })).read();
    read.assert_note(&["light 0 `bulb`", "small sphere"]);
    assert_near(brightness(&read.model), expected(|step| of_intensity(100.0, step)), 0.03);
}

#[test]
fn spots() {
    let angles = json!({ "innerConeAngle": 1.0, "outerConeAngle": 1.0 });
    let read = with_light(&json!({ "type": "spot", "intensity": 100, "spot": angles })).read();
    read.assert_note(&["light 0", "shade"]);
    assert_near(
        brightness(&read.model),
        expected(|step| {
            let is_inside = step.normalize().y > f32::cos(1.0);
            if is_inside { of_intensity(100.0, step) } else { 0.0 }
        }),
        0.1,
    );
}

#[test]
fn directional_lights() {
    let read = with_light(&json!({ "type": "directional", "intensity": 2.0, "color": [0.5, 0.5, 0.5] })).read();
    read.assert_note(&["light 0", "environment"]);
    assert_near(brightness(&read.model), expected(|_| 1.0), 0.04);
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
