//! Views that meshoptimizer compressed. The bytes are those of its own encoder (version 1.3).

use serde_json::json;

use super::File;
use crate::gltf::{base64, meshopt};

/// 300 elements of three floats, by both versions of the codec; see [`elements`].
const ATTRIBUTES: [&str; 2] = [
    "\
     oAAAAAAAAAAAr6pVVQD//4CAQEBAQCAgICAgICAgEBAQEBAQEBAQEBAQEBAQ+IiIiIiIiIgQiIiIiIiIiIiERERERERERERERERE\
     REREREREREREREREREREREREROqqqqoEqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqhEAAQA4AIAAfIAAAACAAAAAAAAAAAAA\
     AABV13V1M/PPP//f4P/gP0Df/9/gPPzzz///3+D/4D9A3//fzz888+D//9/g/+A/QN//88/PPN/g///f4P/gP0Df/9/gAP//AN/g\
     /wDgPwBA3z88/PP/3+D//9/g/+A/QM/PPzzf/9/g///f4P/gP0DfAP/f4AD//wDf4P8A4D88/PPzQN//3+D//9/g/+DPPzz8P0Df\
     /9/g///f4P/gPwBA3wD/3+AA//8A3+D/PPPzz+A/QN//3+D//9/gzzz88//gP0Df/9/g///f888/POD/4D9A3//f4P//3+D/AOA/\
     AEDfAP/f4AD//z888/Pf4P/gP0Df/9/g/1VVVVU6BgGBfn6BgGB9fl+gYBh9fhfoGAZ9fgX6BgF9foF+gYB9fmBfoGB9fhgX6Bh9\
     fgYF+gZ9fgGBfoF9foBgX6B9fmAYF+h9fhgGBfp9fgYBgX59foGAYF99fqBgGBd9AAAAAAAAAACvqlVVAP//gIBAQEBAICAgICAg\
     ICAQEBAQEBAQEBAQEBAQEBD4iIiIiIiIiBCIiIiIiIiIiIRERERERERERERERERERERERERERERERERERERERERE6qqqqgSqqqqq\
     qqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqEQABADgAgAB+gAAAAIAAAAAAPwD/////////////////////////////////////////\
     ////////////////AAAAABWIiIiIiIiIiIiIiAAAAAAdz888/P/f4P/gP0Df/9/g//8A3+D/AOA/AEDfAP/f4Dz88wD//9/g/+A/\
     QBXoGAYFfvoGAYF9fn6BgAB9fgA/AP////////////////////////////////////////////////////////8AAAAAFYiIiIiI\
     iIiIiIiIAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAgA==",
    "\
     oRpaGqyqVVX4/4CAQEBAQCAgICAgICAgEBAQEBAQEBAQEBAQEBAQ+IiIiIiIiIgQiIiIiIiIiIiERERERERERERERERERERERERE\
     REREREREREREREREROqqqqoEqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqgEAAAAGAH0BAAAAALrt/9/g/+A/QN//3+B22///\
     3+D/4D9A3//f7bbg///f4P/gP0Df/9tt3+D//9/g/+A/QN+32//f4P//3+D/4D9A3263/9/g///f4P/gP0Ddbt//3+D//9/g/+A/\
     u91A3//f4P//3+D/4D92u0Df/9/g///f4P/g7XY/QN//3+D//9/g/9vt4D9A3//f4P//3+D/ttvgP0Df/9/g///f4G23/+A/QN//\
     3+D//9/bbuD/4D9A3//f4P//t93f4P/gP0Df/9/g//9uu9/g/+A/QN//3+D/VVVVVToGAYF+foGAYH1+X6BgGH1+F+gYBn1+BfoG\
     AX1+gX6BgH1+YF+gYH1+GBfoGH1+BgX6Bn1+AYF+gX1+gGBfoH1+YBgX6H1+GAYF+n1+BgGBfn1+gYBgX31+oGAYF32sqlVV+P+A\
     gEBAQEAgICAgICAgIBAQEBAQEBAQEBAQEBAQEPiIiIiIiIiIEIiIiIiIiIiIhERERERERERERERERERERERERERERERERERERERE\
     RETqqqqqBKqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqoBAAAABgB/AZ9anwD/////////////////////////////////////\
     ////////////////////AP////////////////////////////////////////////////////////8ViIiIiIiIiIiIiIgAAN12\
     /9/g/+A/QN//3+C77f//3+D/4D9A3//f4HYL///f4P/gP0AV6BgGBX76BgGBfX5+gYAAfX4A////////////////////////////\
     /////////////////////////////wD/////////////////////////////////////////////////////////FYiIiIiIiIiI\
     iIiIAAAAAAAAAAAAAAAAAAAAAAAAAAAAgAEAAQ==",
];
const TRIANGLES: &str = "4fAQ/v9ur//v///wDP8CAgIE8QHABLsE79oDgwL/0wECAgB2h1ZneKmGZYlomAFpAAA=";
const INDICES: &str = "0RQEBKEfBQ4CAp3sEAAAAAA=";
const QUATERNIONS: &str = "\
     oAE8AAAAsbIBPAAAAAoJATwAAACxRAE4AAAACgE8AAAAsbIBPAAAAAoJATwAAAAFBAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA\
     AAAAAAD/Bw==";
const FLOATS: &str = "\
     oAEwAAAA/wEwAAAAXAABMAAAABABMAAAAAQBMAAAAE8AATAAAAAQATAAAADgATAAAABgASAAAAABMAAAABAAAAAAAAAAAAAAAAAA\
     AAAAAAAAAAAQAPQAKAD0AND/9A==";
const COLORS: &str = "of8AHgDCANwAfQAAAAAAAAAAAAAAAAAAAAAAAACQX/H/AA==";

fn decode(text: &str, count: usize, stride: usize, mode: &str, filter: &str) -> Vec<u8> {
    let source = base64::decode(text).expect("base64");
    meshopt::decode(&source, count, stride, mode, filter).expect("a compressed view")
}

fn elements() -> Vec<f32> {
    (0..300_u16).flat_map(|i| [0.25 * f32::from(i), (u32::from(i).pow(2) % 17) as f32, -f32::from(i)]).collect()
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.as_chunks::<4>().0.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect()
}

#[test]
fn attributes() {
    for text in ATTRIBUTES {
        assert_eq!(floats(&decode(text, 300, 12, "ATTRIBUTES", "NONE")), elements());
    }
}

#[test]
fn indices() {
    let triangles =
        [0, 1, 2, 2, 1, 3, 4, 6, 5, 7, 8, 9, 2, 3, 10, 0, 2, 12, 11, 299, 12, 3, 1, 13, 250, 1, 120, 14, 15, 16_u32];
    let bytes = |indices: &[u32]| indices.iter().flat_map(|index| index.to_le_bytes()).collect::<Vec<_>>();
    assert_eq!(decode(TRIANGLES, 30, 4, "TRIANGLES", "NONE"), bytes(&triangles));
    assert_eq!(decode(INDICES, 9, 4, "INDICES", "NONE"), bytes(&[5, 6, 7, 1000, 1001, 3, 2, 1, 70000]));
    assert_eq!(decode(INDICES, 9, 2, "INDICES", "NONE")[..8], [5, 0, 6, 0, 7, 0, 0xe8, 3]);
}

#[test]
fn filters() {
    let bytes = decode(QUATERNIONS, 3, 8, "ATTRIBUTES", "QUATERNION");
    let quaternions: Vec<i16> = bytes.as_chunks::<2>().0.iter().map(|&bytes| i16::from_le_bytes(bytes)).collect();
    assert_eq!(quaternions, [0, 0, 0, 32767, 16399, 16378, 16378, 16378, 19661, 0, 26213, 0]);
    let values = floats(&decode(FLOATS, 2, 12, "ATTRIBUTES", "EXPONENTIAL"));
    assert_eq!(values, [1.0, 2.5, -3.0, 1000.0, 0.125, 7.0]);
    assert_eq!(decode(COLORS, 2, 4, "ATTRIBUTES", "COLOR"), [254, 129, 64, 255, 0, 254, 128, 128]);
}

#[test]
fn a_compressed_view_of_a_file() {
    let mut file = File::lamp();
    let places = file.floats("VEC3", &[]);
    let source = base64::decode(ATTRIBUTES[0]).expect("base64");
    let bytes = file.array(5126, "VEC3", 0, &source);
    let view = |file: &File, accessor: usize| file.json["accessors"][accessor]["bufferView"].as_u64().unwrap_or(0);
    let start = file.json["bufferViews"][view(&file, bytes) as usize]["byteOffset"].clone();
    let compressed = view(&file, places) as usize;
    file.json["accessors"][places]["count"] = json!(300);
    file.json["bufferViews"][compressed] = json!({
        "buffer": 0, "byteLength": 3600,
        "extensions": { "EXT_meshopt_compression": {
            "buffer": 0, "byteOffset": start, "byteLength": source.len(), "byteStride": 12, "count": 300,
            "mode": "ATTRIBUTES",
        } },
    });
    file.json["extensionsRequired"] = json!(["EXT_meshopt_compression"]);
    file.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"] = json!({ "attributes": { "TRANSLATION": places } });
    assert_eq!(file.read().area(0), 300.0);
    file.json["bufferViews"][compressed]["extensions"]["EXT_meshopt_compression"]["count"] = json!(400);
    assert!(file.error().contains("EXT_meshopt_compression"), "{}", file.error());
    file.json["bufferViews"][compressed]["extensions"]["EXT_meshopt_compression"]["count"] = json!(1_000_000);
    assert!(file.error().contains("more than can be unpacked"), "{}", file.error());
}

#[test]
fn any_bytes() {
    for text in [ATTRIBUTES[0], ATTRIBUTES[1], TRIANGLES, INDICES] {
        let source = base64::decode(text).expect("base64");
        for end in 0..source.len() {
            for mode in ["ATTRIBUTES", "TRIANGLES", "INDICES"] {
                drop(meshopt::decode(&source[..end], 300, 12, mode, "NONE"));
                drop(meshopt::decode(&source[..end], 30, 4, mode, "COLOR"));
            }
        }
    }
}
