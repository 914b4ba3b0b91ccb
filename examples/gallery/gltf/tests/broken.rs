//! Files that cannot be read: each gives an error of one line that names the place, and none a panic.

use serde_json::{Value, json};

use super::{File, LIMITS, base64};
use crate::gltf::{Limits, read};
use crate::render::{Budget, PathTracer, Progressive, Random, Techniques, World};

/// Files that are made from each good one.
const MUTANTS: u32 = 1500;
/// One in this many of them is rendered if it can be.
const RENDERED: u32 = 8;

#[test]
fn extensions() {
    let mut file = File::lamp();
    file.json["extensionsRequired"] = json!(["ACME_lights"]);
    let error = file.error();
    assert!(error.contains("ACME_lights") && error.contains("not supported"), "{error}");
    file.json["extensionsRequired"] = json!([]);
    file.json["extensionsUsed"] = json!(["ACME_lights"]);
    file.read().assert_note(&["ACME_lights", "ignored"]);
}

#[test]
fn draco() {
    let mut file = File::lamp();
    file.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    file.json["accessors"][0].as_object_mut().expect("an accessor").remove("bufferView");
    file.json["meshes"][0]["primitives"][0]["extensions"] =
        json!({ "KHR_draco_mesh_compression": { "bufferView": 0 } });
    file.json["meshes"][0]["name"] = json!("bulb");
    let error = file.error();
    assert!(error.contains("mesh 0 `bulb`") && error.contains("gltf-transform"), "{error}");
}

#[test]
fn places_are_named() {
    let changed = |path: &str, value: Value| {
        let mut file = File::lamp();
        *file.json.pointer_mut(path).expect("a place") = value;
        file.error()
    };
    for (path, value, words) in [
        ("/nodes/0/mesh", json!(7), "there is no mesh 7"),
        ("/meshes/0/primitives/0/material", json!(7), "there is no material 7"),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(7), "mesh 0, primitive 0: there is no accessor 7"),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(2), "accessor 2 holds 2 numbers"),
        ("/accessors/0/count", json!(5), "accessor 0: 5 elements do not fit into 48 bytes"),
        ("/accessors/0/count", json!(3), "mesh 0, primitive 0: it uses vertex 3, but has 3"),
        ("/accessors/0/bufferView", json!(9), "there is no buffer view 9"),
        ("/bufferViews/0/byteLength", json!(4_000_000_000_u32), "buffer view 0 reaches beyond"),
        ("/asset/version", json!("1.0"), "glTF 1.0"),
        ("/nodes/0/translation", json!([0, 1e39, 0]), "node 0 `lamp`: mesh 0, primitive 0: a vertex is at"),
        ("/nodes/1/scale", json!([1e9, 1, 1]), "was it exported in other units?"),
    ] {
        let error = changed(path, value);
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn other_bytes() {
    let fails = |bytes: &[u8]| read(bytes, None, "window", None, LIMITS).map(|_| ()).expect_err("no scene").to_string();
    assert!(fails(b"").contains("no glTF file"));
    assert!(fails(b"<html>").contains("no glTF file"));
    assert!(fails(b"{}").contains("no version"));
    assert!(fails(b"glTF\x01\0\0\0").contains("version 1"));
    let glb = File::lamp().glb();
    assert!(fails(&glb[..100]).contains("cut short"));
    assert!(fails(b"{\"asset\":{\"version\":\"2.0\"},\"nodes\":5}").contains("line 1 column"));
    let marked = [b"\xef\xbb\xbf", &File::lamp().bytes()[..]].concat();
    assert!(read(&marked, None, "window", None, LIMITS).is_ok());
    assert!(fails("[".repeat(100_000).as_bytes()).contains("no glTF file"));
}

#[test]
fn room_is_limited() {
    let mut file = File::lamp();
    let accessor = file.push("accessors", json!({ "componentType": 5126, "count": 60_000, "type": "VEC3" }));
    file.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"] =
        json!({ "attributes": { "TRANSLATION": accessor } });
    assert!(file.error().contains("10000 triangles"), "{}", file.error());
    file.json["accessors"][accessor]["count"] = json!(u64::MAX);
    assert!(file.error().contains("too many"), "{}", file.error());
}

/// Everything that a file may have in one.
fn rich() -> File {
    let mut file = File::lamp();
    let places = file.floats("VEC3", &[0.0, 0.0, 0.0, 4.0, 0.0, 0.0, -4.0, 0.0, 0.0]);
    let colors = file.floats("VEC3", &[0.5; 12]);
    let joints = file.array(5121, "VEC4", 4, &[0; 16]);
    let weights = file.floats("VEC4", &[1.0, 0.0, 0.0, 0.0].repeat(4));
    let texture = file.texture(|x, y| [(40 * x) as u8, (40 * y) as u8, 255, 200]);
    let joint = file.push("nodes", json!({ "translation": [0, 2, 0], "children": [4] }));
    file.push("nodes", json!({ "extensions": { "KHR_lights_punctual": { "light": 0 } }, "translation": [1, 1, 1] }));
    file.push("nodes", json!({ "mesh": 1, "skin": 0 }));
    file.push("skins", json!({ "joints": [joint] }));
    file.json["scenes"][0]["nodes"] = json!([0, 1, 2, 3, 5]);
    file.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "spot", "intensity": 10, "spot": { "innerConeAngle": 0.3, "outerConeAngle": 0.8 } },
    ] } });
    file.json["nodes"][0]["extensions"] =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": places } } });
    let lamp = &mut file.json["meshes"][0]["primitives"][0];
    lamp["targets"] = json!([{ "POSITION": 0 }]);
    lamp["mode"] = json!(5);
    let floor = &mut file.json["meshes"][1]["primitives"][0]["attributes"];
    floor["COLOR_0"] = json!(colors);
    floor["JOINTS_0"] = json!(joints);
    floor["WEIGHTS_0"] = json!(weights);
    file.json["meshes"][0]["weights"] = json!([0.5]);
    let info = json!({ "index": texture, "extensions": { "KHR_texture_transform": { "scale": [2, 2] } } });
    file.json["materials"][0]["emissiveTexture"] = info.clone();
    file.json["materials"][1]["pbrMetallicRoughness"]["baseColorTexture"] = info;
    file.json["materials"][1]["alphaMode"] = json!("MASK");
    file
}

/// Changes some bytes of a file, or moves, repeats or drops some, or writes an odd number.
fn mutate(bytes: &mut Vec<u8>, random: &mut Random) {
    const ODD: [&str; 14] = [
        "-1",
        "0",
        "1",
        "2",
        "3",
        "4",
        "7",
        "1e9",
        "1e38",
        "1e-38",
        "4294967296",
        "18446744073709551615",
        "0.5",
        "null",
    ];
    for _ in 0..1 + (random.one() * 3.0) as usize {
        let below = |random: &mut Random, count: usize| ((random.one() * count as f32) as usize).min(count - 1);
        let at = below(random, bytes.len());
        match below(random, 5) {
            0 => bytes[at] = (random.one() * 256.0) as u8,
            1 => bytes[at] ^= 1 << below(random, 8),
            2 => {
                let end = (at + 1 + below(random, 40)).min(bytes.len());
                bytes.drain(at..end);
            }
            3 => {
                let copy = bytes[at..(at + 1 + below(random, 40)).min(bytes.len())].to_vec();
                bytes.splice(at..at, copy);
            }
            _ => {
                // Instead of the next number.
                let is_digit = |byte: &u8| byte.is_ascii_digit() || *byte == b'.' || *byte == b'-';
                let start = (at..bytes.len()).find(|&i| is_digit(&bytes[i])).unwrap_or(at);
                let end = (start..bytes.len()).find(|&i| !is_digit(&bytes[i])).unwrap_or(bytes.len());
                bytes.splice(start..end, ODD[below(random, ODD.len())].bytes());
            }
        }
        if bytes.is_empty() {
            bytes.push(0);
        }
    }
}

/// Writes odd values to some places of a file's JSON, and to some of its numbers' bytes.
fn mutate_values(file: &mut File, random: &mut Random) {
    let below = |random: &mut Random, count: usize| ((random.one() * count as f32) as usize).min(count - 1);
    for _ in 0..1 + below(random, 2) {
        let mut places = vec![];
        let mut open = vec![(String::new(), &file.json)];
        while let Some((place, value)) = open.pop() {
            match value {
                Value::Array(list) => open.extend(list.iter().enumerate().map(|(i, v)| (format!("{place}/{i}"), v))),
                Value::Object(members) => open.extend(members.iter().map(|(k, v)| (format!("{place}/{k}"), v))),
                _ => {}
            }
            if !place.is_empty() {
                places.push(place);
            }
        }
        let place = &places[below(random, places.len())];
        let odd = [
            json!(0),
            json!(1),
            json!(2),
            json!(3),
            json!(5),
            json!(-1),
            json!(0.5),
            json!(1e9),
            json!(1e-30),
            json!(1e38),
            json!(u64::MAX),
            json!(5121),
            json!(5123),
            json!("VEC2"),
            json!("SCALAR"),
            json!("BLEND"),
            json!([]),
            json!({}),
            json!(null),
            json!([0.0, 0.0, 0.0]),
            json!(true),
        ];
        if let Some(value) = file.json.pointer_mut(place) {
            *value = odd[below(random, odd.len())].clone();
        }
    }
    for _ in 0..below(random, 4) {
        let at = below(random, file.bytes.len());
        file.bytes[at] = (random.one() * 256.0) as u8;
    }
}

#[test]
fn mutants() {
    let rich = rich();
    let notes = rich.read().notes;
    assert!(!notes.is_empty());
    let mut counts = [0; 2];
    for (stream, good) in [rich.bytes(), rich.glb(), File::lamp().bytes(), File::lamp().glb()].iter().enumerate() {
        let mut random = Random::new(7, stream as u64);
        for i in 0..MUTANTS {
            let mut bytes = good.clone();
            mutate(&mut bytes, &mut random);
            counts[usize::from(survives(&bytes, i % RENDERED == 0))] += 1;
        }
    }
    let mut random = Random::new(7, 4);
    for i in 0..4 * MUTANTS {
        let mut file = if i % 2 == 0 { self::rich() } else { File::lamp() };
        mutate_values(&mut file, &mut random);
        counts[usize::from(survives(&file.bytes(), i % RENDERED == 0))] += 1;
    }
    let [refused, read] = counts;
    assert!(refused > 1000 && read > 1000, "{refused} refused, {read} read");
}

/// Reads any bytes. Returns whether they are a scene.
fn survives(bytes: &[u8], renders: bool) -> bool {
    let limits = Limits { triangles: 5_000, bytes: 1 << 18 };
    match read(bytes, None, "window", None, limits) {
        Err(error) => {
            let error = error.to_string();
            assert!(!error.is_empty() && !error.contains('\n'), "{error}");
            false
        }
        Ok(read) => {
            assert!(read.notes.iter().all(|note| !note.contains('\n')), "{:?}", read.notes);
            if renders {
                let model = read.model;
                let world = World::new(&model);
                let Ok(techniques) = Techniques::plain(&model) else { return false };
                let tracer = PathTracer::new(&world, &techniques, 1);
                Progressive { tracer, camera: model.camera.sized([4, 3]), seed: 1 }.render(Budget::Samples(1), drop);
            }
            true
        }
    }
}

#[test]
fn data_uris() {
    let mut file = File::lamp();
    file.json["images"] = json!([{ "uri": format!("data:image/png;base64,{}", base64(b"no image")) }]);
    file.json["textures"] = json!([{ "source": 0 }]);
    file.json["materials"][0]["emissiveTexture"] = json!({ "index": 0 });
    assert!(file.error().contains("image 0 cannot be read: it is of an unknown kind"), "{}", file.error());
    file.json["images"][0]["uri"] = json!("glow.png");
    assert!(file.error().contains("image 0 `glow.png`"), "{}", file.error());
    file.json["images"][0]["uri"] = json!("data:image/png;base64,***");
    assert!(file.error().contains("base64"), "{}", file.error());
}
