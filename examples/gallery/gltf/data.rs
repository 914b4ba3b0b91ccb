//! Bytes that a file refers to: buffers, and views into them.

use core::cell::OnceCell;
use std::path::Path;

use serde::Deserialize;

use super::document::{BufferView, Document, extension, member};
use super::{base64, meshopt};
use crate::render::Error;

/// Extensions that compress a view, both in the same way.
const COMPRESSIONS: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// What may be read of a file, so that a small one does not fill the memory.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    /// Triangles and vertices, each, of all meshes and instances.
    pub(crate) triangles: usize,
    /// Bytes of a compressed view, of a sparse accessor, and of an image once they are unpacked.
    pub(crate) bytes: usize,
}

impl Limits {
    /// What a computer can render.
    pub(crate) const RENDERABLE: Self = Self { triangles: 50_000_000, bytes: 1 << 30 };
}

/// The bytes of a file, read when they are first needed.
pub(super) struct Data<'a> {
    pub(super) document: &'a Document,
    /// Where the file lies; without it nothing outside of the file is read.
    folder: Option<&'a Path>,
    blob: Option<&'a [u8]>,
    pub(super) limits: Limits,
    buffers: Vec<OnceCell<Vec<u8>>>,
    unpacked: Vec<OnceCell<Vec<u8>>>,
}

/// A compressed view.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Compressed {
    buffer: usize,
    #[serde(default)]
    byte_offset: usize,
    byte_length: usize,
    byte_stride: usize,
    count: usize,
    mode: String,
    #[serde(default)]
    filter: Option<String>,
}

impl<'a> Data<'a> {
    pub(super) fn new(
        document: &'a Document,
        folder: Option<&'a Path>,
        blob: Option<&'a [u8]>,
        limits: Limits,
    ) -> Self {
        let cells = |count| core::iter::repeat_with(OnceCell::new).take(count).collect();
        let (buffers, unpacked) = (cells(document.buffers.len()), cells(document.buffer_views.len()));
        Self { document, folder, blob, limits, buffers, unpacked }
    }

    /// The bytes of a view.
    pub(super) fn view(&self, index: usize) -> Result<&[u8], Error> {
        let view = member(&self.document.buffer_views, "buffer view", index)?;
        for name in COMPRESSIONS {
            let compressed = extension::<Compressed>(&view.extensions, name);
            if let Some(compressed) = compressed.map_err(|error| format!("buffer view {index}: {error}"))? {
                return cached(&self.unpacked[index], || {
                    self.unpack(&compressed).map_err(|error| format!("buffer view {index} ({name}): {error}").into())
                });
            }
        }
        let BufferView { buffer, byte_offset, byte_length, .. } = *view;
        let bytes = self.buffer(buffer)?;
        part(bytes, byte_offset, byte_length).ok_or_else(|| {
            format!("buffer view {index} reaches beyond the {} bytes of buffer {buffer}", bytes.len()).into()
        })
    }

    fn unpack(&self, compressed: &Compressed) -> Result<Vec<u8>, Error> {
        let Compressed { buffer, byte_offset, byte_length, byte_stride, count, ref mode, ref filter } = *compressed;
        let bytes = self.buffer(buffer)?;
        let source = part(bytes, byte_offset, byte_length);
        let source = source.ok_or_else(|| format!("it reaches beyond the {} bytes of buffer {buffer}", bytes.len()))?;
        if count.checked_mul(byte_stride).is_none_or(|bytes| bytes > self.limits.bytes) {
            return Err(format!("{count} elements of {byte_stride} bytes are more than can be unpacked").into());
        }
        meshopt::decode(source, count, byte_stride, mode, filter.as_deref().unwrap_or("NONE"))
    }

    fn buffer(&self, index: usize) -> Result<&[u8], Error> {
        let buffer = member(&self.document.buffers, "buffer", index)?;
        let Some(uri) = &buffer.uri else {
            // The bytes of a `.glb` are those of its first buffer.
            return self.blob.filter(|_| index == 0).ok_or_else(|| format!("buffer {index} has no bytes").into());
        };
        let bytes = cached(&self.buffers[index], || {
            self.resource(uri).map_err(|error| format!("buffer {index} cannot be read ({error})").into())
        })?;
        if bytes.len() < buffer.byte_length {
            let (found, length) = (bytes.len(), buffer.byte_length);
            return Err(format!("buffer {index} holds {found} bytes instead of {length}").into());
        }
        Ok(bytes)
    }

    /// What a URI refers to.
    pub(super) fn resource(&self, uri: &str) -> Result<Vec<u8>, Error> {
        if let Some(data) = uri.strip_prefix("data:") {
            let (head, body) = data.split_once(',').ok_or("its data URI has no data")?;
            return if head.ends_with(";base64") { base64::decode(body) } else { Ok(unescaped(body)) };
        }
        let name = String::from_utf8(unescaped(uri)).map_err(|_| "its URI is not UTF-8")?;
        let shown = name.escape_debug();
        if name.contains("://") {
            return Err(format!("`{shown}` is not in the file's folder").into());
        }
        let folder = self.folder.ok_or_else(|| format!("`{shown}` is outside of the file"))?;
        let path = folder.join(&name);
        let is_file = std::fs::metadata(&path).map_err(|error| format!("`{shown}`: {error}"))?.is_file();
        if !is_file {
            return Err(format!("`{shown}` is not a file").into());
        }
        std::fs::read(path).map_err(|error| format!("`{shown}`: {error}").into())
    }
}

/// Some bytes of others.
pub(super) fn part(bytes: &[u8], start: usize, length: usize) -> Option<&[u8]> {
    bytes.get(start..start.checked_add(length)?)
}

fn cached<T>(cell: &OnceCell<Vec<T>>, read: impl FnOnce() -> Result<Vec<T>, Error>) -> Result<&[T], Error> {
    if let Some(known) = cell.get() {
        return Ok(known);
    }
    let new = read()?;
    Ok(cell.get_or_init(|| new))
}

/// Takes the percent signs out of a URI.
fn unescaped(uri: &str) -> Vec<u8> {
    let bytes = uri.as_bytes();
    let (mut out, mut at) = (Vec::with_capacity(bytes.len()), 0);
    while let Some(&byte) = bytes.get(at) {
        let code = uri.get(at + 1..at + 3).filter(|_| byte == b'%').and_then(|hex| u8::from_str_radix(hex, 16).ok());
        out.push(code.unwrap_or(byte));
        at += if code.is_some() { 3 } else { 1 };
    }
    out
}
