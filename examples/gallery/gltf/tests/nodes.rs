//! Nodes, cameras and scenes.

use glam::{Vec3, vec2, vec3};
use serde_json::json;

use super::File;

#[test]
fn cycles() {
    let mut file = File::lamp();
    file.json["nodes"][0]["children"] = json!([0]);
    let error = file.error();
    assert!(error.contains("node 0 `lamp`") && error.contains("its own child"), "{error}");

    file.json["nodes"][0]["children"] = json!([3]);
    file.push("nodes", json!({ "children": [4], "name": "arm" }));
    file.push("nodes", json!({ "children": [0] }));
    let error = file.error();
    assert!(error.contains("node ") && error.contains("its own ancestor"), "{error}");
}

#[test]
fn two_parents() {
    let mut file = File::lamp();
    file.json["nodes"][1]["children"] = json!([0]);
    file.json["nodes"][2]["children"] = json!([0]);
    let error = file.error();
    assert!(error.contains("node 0 `lamp`") && error.contains("node 1 `floor`"), "{error}");
    file.json["nodes"][2]["children"] = json!([99]);
    assert!(file.error().contains("99"));
}

/// A chain that any recursion would overflow the stack with.
#[test]
fn deep_chains() {
    const DEEP: usize = 200_000;
    let mut file = File::lamp();
    file.json["nodes"][1]["children"] = json!([3]);
    let nodes = file.json["nodes"].as_array_mut().expect("nodes");
    nodes.extend((0..DEEP).map(|i| json!({ "children": [i + 4] })));
    nodes.push(json!({ "mesh": 0, "name": "end", "translation": [0, 1, 0] }));
    let read = file.read();
    assert_eq!(read.model.meshes.len(), 3);
    assert!(read.contents[0].contains(&format!("{} are in the scene", DEEP + 4)));
}

#[test]
fn orthographic_cameras() {
    let mut file = File::lamp();
    file.json["cameras"][0] =
        json!({ "type": "orthographic", "orthographic": { "xmag": 3, "ymag": 2, "znear": 0.01, "zfar": 100 } });
    assert!(file.brightness() > 0.0);
    file.json["nodes"][2]["rotation"] = json!([0, 0, 0, 1]);
    let camera = file.read().model.camera.sized([40, 40]);
    let (origin, direction) = camera.ray(vec2(20.0, 0.0));
    assert_eq!(direction, Vec3::NEG_Z);
    assert!(origin.abs_diff_eq(vec3(0.0, 3.2, 5.0), 1e-5), "{origin}");
}

#[test]
fn cameras_that_see_nothing() {
    let mut file = File::lamp();
    file.json["cameras"][0]["perspective"]["yfov"] = json!(0);
    let error = file.error();
    assert!(error.contains("camera 0") && error.contains("node 2"), "{error}");
    file.json["nodes"][2]["camera"] = json!(1);
    assert!(file.error().contains("there is no camera 1"));
    file.json["nodes"][2] = json!({});
    file.read().assert_note(&["no camera"]);
}

#[test]
fn hidden_nodes() {
    let mut file = File::lamp();
    file.json["nodes"][0]["extensions"] = json!({ "KHR_node_visibility": { "visible": false } });
    assert_eq!(file.read().model.meshes.len(), 1);
}

#[test]
fn scenes() {
    let mut file = File::lamp();
    file.push("scenes", json!({ "name": "second", "nodes": [1] }));
    file.json["scene"] = json!(1);
    let read = file.read();
    assert_eq!(read.model.meshes.len(), 1);
    read.assert_note(&["2 scenes", "scene 1 `second`"]);
    file.json["scenes"] = json!([]);
    assert_eq!(file.read().model.meshes.len(), 2);
}
