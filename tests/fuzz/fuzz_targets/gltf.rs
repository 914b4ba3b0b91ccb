//! Reading of glTF files: a good one with some of it changed, or any bytes at all. Each is a scene, of which a few rays
//! are traced, or an error of one line.
#![no_main]

#[expect(dead_code, unused_imports, reason = "the gallery writes files, too")]
#[path = "../../../examples/gallery/gltf/mod.rs"]
mod gltf;
#[path = "../../../examples/gallery/ies.rs"]
mod ies;
#[path = "../checks/reader.rs"]
#[expect(dead_code, reason = "the other targets use the rest")]
mod reader;
#[expect(dead_code, unused_imports, reason = "the gallery uses the rest")]
#[path = "../../../examples/gallery/render/mod.rs"]
mod render;

use gltf::{Limits, Read, read};
use reader::Reader;
use render::{Budget, PathTracer, Progressive, Techniques, World};

/// A file that has most of what is read.
const RICH: &[u8] = include_bytes!("../files/rich.gltf");
/// What a file may hold, so that each takes but a moment.
const LIMITS: Limits = Limits { triangles: 2_000, bytes: 1 << 18 };
/// What takes the place of numbers.
const ODD: [&str; 16] = [
    "-1",
    "0",
    "1",
    "2",
    "3",
    "4",
    "5",
    "6",
    "7",
    "0.5",
    "1e9",
    "1e38",
    "1e-38",
    "4294967296",
    "18446744073709551615",
    "null",
];

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let mut reader = Reader::new(data);
    let bytes = match reader.byte() {
        0..=63 => data[data.len().min(1)..].to_vec(),
        _ => changed(&mut reader),
    };
    match read(&bytes, None, "window", None, LIMITS) {
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
        Ok(Read { model, notes, .. }) => {
            assert!(notes.iter().all(|note| !note.contains('\n')), "{notes:?}");
            // How long a sampler takes to build over an image with odd coordinates is not this target's subject.
            if model.materials.iter().any(|material| material.emission_map.is_some()) {
                return;
            }
            let world = World::new(&model);
            let Ok(techniques) = Techniques::plain(&model) else { return };
            let tracer = PathTracer::new(&world, &techniques, 1);
            let camera = model.camera.sized([3, 2]);
            Progressive { tracer, camera, seed: 1 }.render(Budget::Samples(1), drop);
        }
    }
});

/// The good file with a few changes.
fn changed(reader: &mut Reader<'_>) -> Vec<u8> {
    let mut bytes = RICH.to_vec();
    for _ in 0..1 + reader.below(6) {
        let at = reader.bits() as usize % bytes.len();
        let end = (at + 1 + reader.below(32)).min(bytes.len());
        match reader.below(4) {
            0 => bytes[at] = reader.byte(),
            1 if end - at < bytes.len() => drop(bytes.drain(at..end)),
            2 => {
                let copy = bytes[at..end].to_vec();
                let to = reader.bits() as usize % bytes.len();
                drop(bytes.splice(to..to, copy));
            }
            _ => {
                let is_digit = |byte: &u8| byte.is_ascii_digit() || matches!(byte, b'.' | b'-');
                let start = (at..bytes.len()).find(|&i| is_digit(&bytes[i])).unwrap_or(at);
                let end = (start..bytes.len()).find(|&i| !is_digit(&bytes[i])).unwrap_or(bytes.len());
                drop(bytes.splice(start..end, ODD[reader.below(ODD.len())].bytes()));
            }
        }
    }
    bytes
}
