//! What changes the triangles.

use glam::{Vec3, vec3};
use serde_json::json;

use super::{File, assert_near, brightness, brightness_by};
use crate::render::{Illumination, Image, Lights, Random, Sky, Techniques, World};

#[test]
fn instances() {
    for list in ["extensionsUsed", "extensionsRequired"] {
        let mut file = File::lamp();
        let places = file.floats("VEC3", &[0.0, 0.0, 0.0, 4.0, 0.0, 0.0, -4.0, 0.0, 0.0]);
        file.json[list] = json!(["EXT_mesh_gpu_instancing"]);
        let attributes = json!({ "attributes": { "TRANSLATION": places } });
        file.json["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": attributes });
        let read = file.read();
        assert_eq!(read.area(0), 3.0);
        // Middles of the longest side of the first triangle of each, the square's diagonal.
        let middles: Vec<Vec3> = read.corners(0).iter().step_by(2).map(|[a, _, c]| (*a + *c) / 2.0).collect();
        assert_eq!(middles, [vec3(0.0, 2.0, 0.0), vec3(2.0, 2.0, 0.0), vec3(-2.0, 2.0, 0.0)]);
    }
}

/// Lamps turned, stretched and mirrored by two nodes, of which one has copies: passed in once, or as all their
/// triangles.
#[test]
fn instances_of_emitters() {
    let mut file = File::lamp();
    let texture = file.texture(|x, y| [(30 * x) as u8, (30 * y) as u8, 255, 255]);
    file.json["materials"][0]["emissiveTexture"] = json!({ "index": texture });
    let places = file.floats("VEC3", &[0.0, 0.0, 0.0, 4.0, 0.0, 0.0, -3.0, -1.0, 1.0]);
    let turns = file.floats("VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.3, 0.954, 0.2, 0.0, 0.0, 0.98]);
    // The second one turns about, as it is mirrored.
    let scales = file.floats("VEC3", &[1.0, 1.0, 1.0, 1.5, -1.0, 0.7, 0.5, 1.0, 0.5]);
    let attributes = json!({ "TRANSLATION": places, "ROTATION": turns, "SCALE": scales });
    file.json["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
    file.push("nodes", json!({ "mesh": 0, "translation": [0, 1.5, 1], "scale": [-0.3, 1, 0.4] }));
    file.json["scenes"][0]["nodes"] = json!([0, 1, 2, 3]);

    let instanced = file.read().model;
    let mut flat = instanced.clone();
    flat.meshes.iter_mut().for_each(|mesh| mesh.copies = None);
    let lights = [&instanced, &flat].map(|model| Lights::new(model, Illumination::default()).expect("lights"));
    assert!(lights[0].described().contains("0 meshes, and 4 instances of 1 "), "{}", lights[0].described());
    assert!(lights[1].described().contains("2 meshes, and 0 instances of 0 "), "{}", lights[1].described());

    // Rays of light at the points where they end.
    let world = World::new(&instanced);
    let mut random = Random::new(1, 1);
    let mut found = 0;
    for _ in 0..2000 {
        let Some(ray) = lights[0].outgoing().sample(random.take()) else { continue };
        assert!(ray.emitted);
        let start = ray.origin + 0.5 * ray.direction;
        let Some(from) = world.trace(start, -ray.direction).1.filter(|from| from.distance < 0.51) else { continue };
        let densities = lights.each_ref().map(|lights| lights.outgoing().pdf(start, -ray.direction, Some(&from)));
        assert!(densities[1] > 0.0 && (densities[0] / densities[1] - 1.0).abs() < 0.01, "{densities:?}");
        found += 1;
    }
    assert!(found > 1500, "{found}");
    assert_near(brightness(&instanced), brightness(&flat), 0.01);
    let without = Techniques::without(&flat).expect("lights");
    assert_near(brightness_by(&flat, &without), brightness(&instanced), 0.03);
}

/// A place that flattens a mesh is none for an object.
#[test]
fn flattened_emitters() {
    let mut file = File::lamp();
    let scales = file.floats("VEC3", &[1.0, 1.0, 1.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    file.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"] = json!({ "attributes": { "SCALE": scales } });
    let lights = Lights::new(&file.read().model, Illumination::default()).expect("lights");
    assert!(lights.described().contains("2 meshes, and 1 instances of 1 "), "{}", lights.described());
}

/// Windows next to each other.
#[test]
fn instances_of_portals() {
    let mut file = File::lamp();
    file.json["materials"][0] = json!({ "name": "window", "alphaMode": "BLEND",
        "pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, 0.1] } });
    for x in [2, -2] {
        let node = file.push("nodes", json!({ "mesh": 0, "translation": [x, 2, 0], "scale": [0.3, 1, 0.5] }));
        file.json["scenes"][0]["nodes"].as_array_mut().expect("nodes").push(json!(node));
    }
    let mut instanced = file.read().model;
    instanced.sky = Some(Sky::new(Image { pixels: vec![Vec3::ONE; 32 * 16], ..Image::black(32, 16) }).into());
    let mut flat = instanced.clone();
    flat.meshes.iter_mut().for_each(|mesh| mesh.copies = None);
    let lights = Lights::new(&instanced, Illumination::default()).expect("lights");
    assert!(lights.described().contains("0 meshes, and 3 instances of 1 "), "{}", lights.described());
    assert_near(brightness(&instanced), brightness(&flat), 0.01);
}

#[test]
fn turned_and_scaled_instances() {
    let mut file = File::lamp();
    let turns = file.array(5122, "VEC4", 1, &[0, 0, 0, 0, 0x82, 0x5a, 0x82, 0x5a]);
    file.json["accessors"][turns]["normalized"] = json!(true);
    let scales = file.floats("VEC3", &[2.0, 1.0, 1.0]);
    file.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"] =
        json!({ "attributes": { "ROTATION": turns, "SCALE": scales } });
    let read = file.read();
    // A quarter turn about z: the lamp stands upright in x, and is stretched to twice its side before.
    let reach = read
        .corners(0)
        .into_iter()
        .flatten()
        .fold(Vec3::ZERO, |reach, corner| reach.max((corner - vec3(0.0, 2.0, 0.0)).abs()));
    assert!(reach.abs_diff_eq(vec3(0.0, 2.0, 0.5), 1e-3), "{reach}");
}

#[test]
fn strips_and_fans() {
    let plain = File::lamp().read().corners(0);
    for (mode, corners) in [(5, [0_u16, 1, 3, 2]), (6, [0, 1, 2, 3])] {
        let mut file = File::lamp();
        let indices = file.shorts(&corners);
        file.json["meshes"][0]["primitives"][0]["mode"] = json!(mode);
        file.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
        let read = file.read();
        assert_eq!(read.area(0), 1.0);
        let normal = |[a, b, c]: [Vec3; 3]| (b - a).cross(c - a).normalize();
        for triangle in read.corners(0) {
            assert_eq!(normal(triangle), normal(plain[0]));
        }
        assert_near(file.brightness(), 1.0, 0.04);
    }
}

#[test]
fn points_are_noted() {
    let mut file = File::lamp();
    file.push("nodes", json!({ "mesh": 2 }));
    file.json["scenes"][0]["nodes"] = json!([0, 1, 2, 3]);
    file.push("meshes", json!({ "name": "dust", "primitives": [{ "attributes": { "POSITION": 0 }, "mode": 0 }] }));
    file.read().assert_note(&["mesh 2 `dust`", "points", "ignored"]);
}

#[test]
fn smooth_normals_are_noted() {
    let mut file = File::lamp();
    file.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(0);
    assert!(file.read().notes.is_empty());
    let bent = file.floats("VEC3", &[-1.0, 0.0, -1.0, 1.0, 0.0, -1.0, 1.0, 0.0, 1.0, -1.0, 0.5, 1.0]);
    file.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(bent);
    file.read().assert_note(&["mesh 0", "normals are ignored"]);
}

#[test]
fn morph_targets() {
    let mut file = File::lamp();
    let square = [[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0], [1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]];
    let target = file.floats("VEC3", square.as_flattened());
    file.json["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": target }]);
    assert_eq!(file.read().area(0), 1.0);
    file.json["meshes"][0]["weights"] = json!([1.0]);
    assert_eq!(file.read().area(0), 4.0);
    // Those of the node come first.
    file.json["nodes"][0]["weights"] = json!([0.5]);
    assert_eq!(file.read().area(0), 2.25);
}

#[test]
fn skins() {
    let mut file = File::lamp();
    let joints = file.array(5121, "VEC4", 4, &[0; 16]);
    let weights = file.floats("VEC4", &[1.0, 0.0, 0.0, 0.0].repeat(4));
    let mut inverse = [0.0; 16];
    for i in [0, 5, 10, 15] {
        inverse[i] = 1.0;
    }
    inverse[13] = -1.0;
    let inverse = file.floats("MAT4", &inverse);
    let joint = file.push("nodes", json!({ "name": "bone", "translation": [0, 3, 0] }));
    file.push("skins", json!({ "joints": [joint], "inverseBindMatrices": inverse }));
    file.json["nodes"][0]["skin"] = json!(0);
    file.json["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] = json!(joints);
    file.json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] = json!(weights);
    let read = file.read();
    // The joint alone counts, not the node that holds the mesh.
    assert_eq!(read.area(0), 4.0);
    assert!(read.corners(0).iter().flatten().all(|corner| corner.y == 2.0));
    read.assert_note(&["mesh 0", "skin"]);
}

#[test]
fn quantized() {
    let mut file = File::lamp();
    let corners: [i16; 16] = [-1, 0, -1, 0, 1, 0, -1, 0, 1, 0, 1, 0, -1, 0, 1, 0];
    let bytes: Vec<u8> = corners.iter().flat_map(|corner| (corner * i16::MAX).to_le_bytes()).collect();
    let positions = file.array(5122, "VEC3", 4, &bytes);
    file.json["accessors"][positions]["normalized"] = json!(true);
    let view = file.json["accessors"][positions]["bufferView"].as_u64().expect("a view") as usize;
    file.json["bufferViews"][view]["byteStride"] = json!(8);
    file.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(positions);
    file.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    assert_eq!(file.read().area(0), 1.0);
}

#[test]
fn sparse() {
    let mut file = File::lamp();
    let places = file.shorts(&[1, 2]);
    let values = file.floats("VEC3", &[3.0, 0.0, -1.0, 3.0, 0.0, 1.0]);
    file.json["accessors"][0]["sparse"] = json!({
        "count": 2,
        "indices": { "bufferView": places, "componentType": 5123 },
        "values": { "bufferView": values },
    });
    assert_eq!(file.read().area(0), 2.0);
}

#[test]
fn mirrored_nodes_keep_their_front() {
    let mut file = File::lamp();
    file.json["nodes"][0]["scale"] = json!([-0.5, 1, 0.5]);
    assert_near(file.brightness(), 1.0, 0.04);
}
