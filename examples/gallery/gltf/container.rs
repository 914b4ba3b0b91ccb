//! Takes the JSON and the binary part out of a `.gltf` or a `.glb`.

use super::document::Document;
use crate::render::Error;

/// First bytes of a `.glb`. *Format.*
const MAGIC: &[u8] = b"glTF";
/// What some programs write before text. *Format.*
const BYTE_ORDER: &[u8] = b"\xef\xbb\xbf";
/// Kinds of a `.glb`'s chunks. *Format.*
const JSON: [u8; 4] = *b"JSON";
const BIN: [u8; 4] = *b"BIN\0";

/// Parses a file. Returns what it says, and the buffer that is inside of it.
pub(super) fn parse(bytes: &[u8]) -> Result<(Document, Option<&[u8]>), Error> {
    let (json, blob) = if bytes.starts_with(MAGIC) { chunks(bytes)? } else { (bytes, None) };
    let json = json.strip_prefix(BYTE_ORDER).unwrap_or(json);
    let value: serde_json::Value =
        serde_json::from_slice(json).map_err(|error| format!("this is no glTF file: its JSON is broken ({error})"))?;
    check_version(&value)?;
    let document =
        serde_json::from_slice(json).map_err(|error| format!("its JSON is not that of glTF 2.0 ({error})"))?;
    Ok((document, blob))
}

/// The JSON of a `.glb`, and its buffer.
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), Error> {
    let version = number(bytes, 4).ok_or("the .glb ends within its header")?;
    if version != 2 {
        return Err(format!("this is a .glb of version {version}, but only version 2 is read").into());
    }
    let (mut json, mut blob, mut at) = (None, None, 12);
    while let (Some(length), Some(kind)) = (number(bytes, at), bytes.get(at + 4..at + 8)) {
        let end = (at + 8).checked_add(length as usize).filter(|&end| end <= bytes.len());
        let end = end.ok_or_else(|| format!("the .glb is cut short: a chunk at byte {at} is {length} bytes long"))?;
        let chunk = &bytes[at + 8..end];
        if kind == JSON {
            json = json.or(Some(chunk));
        } else if kind == BIN {
            blob = blob.or(Some(chunk));
        }
        at = end;
    }
    Ok((json.ok_or("the .glb has no JSON")?, blob))
}

fn number(bytes: &[u8], at: usize) -> Option<u32> {
    let bytes = bytes.get(at..at.checked_add(4)?)?;
    bytes.try_into().ok().map(u32::from_le_bytes)
}

fn check_version(value: &serde_json::Value) -> Result<(), Error> {
    let version = |name: &str| value["asset"][name].as_str();
    let needed = version("minVersion").or(version("version"));
    match needed {
        Some(needed) if needed == "2" || needed.starts_with("2.0") => Ok(()),
        Some(needed) => Err(format!("this is glTF {}, but only glTF 2.0 is read", needed.escape_debug()).into()),
        None => Err("this is no glTF file: its `asset` has no version".into()),
    }
}
