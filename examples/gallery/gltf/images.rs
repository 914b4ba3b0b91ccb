//! Images, decoded when a surface that is in the scene needs them.

use std::collections::HashMap;
use std::io::Cursor;

use image::{ImageFormat, ImageReader};
use serde::Deserialize;

use super::data::Data;
use super::document::{Texture, called, extension, member};
use crate::render::Error;

/// Longest side of an image in pixels. Larger ones are not decoded; what decodes 16 bits or less needs no more.
const LONGEST: u32 = 16_384;

/// Extensions that give a texture another image; the first of them is read.
const SOURCES: [&str; 4] = ["EXT_texture_webp", "KHR_texture_basisu", "EXT_texture_avif", "MSFT_texture_dds"];

/// First bytes of images that are not read, and what they are called. *Format.*
const UNREAD: [(&[u8], &str); 6] = [
    (&[0xab, b'K', b'T', b'X', b' ', b'2', b'0', 0xbb], "KTX2"),
    (b"DDS ", "DDS"),
    (b"GIF8", "GIF"),
    (b"BM", "BMP"),
    (b"<svg", "SVG"),
    (b"\x00\x00\x00", "AVIF or HEIF"),
];

/// An image as it is stored.
pub(super) struct Picture {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) texels: Vec<[u8; 4]>,
}

/// The images that were needed so far, or why they cannot be read.
#[derive(Default)]
pub(super) struct Images {
    known: HashMap<usize, Result<Picture, String>>,
}

#[derive(Deserialize)]
struct Source {
    source: usize,
}

impl Images {
    /// The image of a texture: the first one that can be read.
    pub(super) fn of_texture(&mut self, data: &Data<'_>, texture: usize) -> Result<&Picture, Error> {
        let index = texture;
        let texture = member(&data.document.textures, "texture", index)?;
        let sources = sources(texture)?;
        let Some(&first) = sources.first() else { return Err(no_image(index, texture)) };
        let readable = sources.iter().copied().find(|&source| self.get(data, source).is_ok());
        self.get(data, readable.unwrap_or(first)).map_err(|error| Error::from(error.as_str()))
    }

    fn get(&mut self, data: &Data<'_>, index: usize) -> Result<&Picture, &String> {
        let decoded = self.known.entry(index).or_insert_with(|| {
            decode(data, index).map_err(|error| format!("{} cannot be read: {error}", data.document.image(index)))
        });
        decoded.as_ref()
    }

    /// Whether an image was read.
    pub(super) fn state(&self, index: usize) -> &'static str {
        match self.known.get(&index) {
            Some(Ok(_)) => "read",
            Some(Err(_)) => "cannot be read",
            None => "not needed",
        }
    }
}

fn no_image(index: usize, texture: &Texture) -> Error {
    format!("{} has no image", called("texture", index, texture.name.as_deref())).into()
}

/// Images of a texture, the better ones first.
fn sources(texture: &Texture) -> Result<Vec<usize>, Error> {
    let mut sources = Vec::new();
    for name in SOURCES {
        sources.extend(extension::<Source>(&texture.extensions, name)?.map(|source| source.source));
    }
    // A WebP before the image that takes its place for those who cannot read it, others after it.
    let place = usize::from(texture.extensions.contains_key(SOURCES[0]));
    if let Some(source) = texture.source {
        sources.insert(place, source);
    }
    Ok(sources)
}

fn decode(data: &Data<'_>, index: usize) -> Result<Picture, Error> {
    let image = member(&data.document.images, "image", index)?;
    let loaded;
    let bytes = match (image.buffer_view, &image.uri) {
        (Some(view), _) => data.view(view)?,
        (None, Some(uri)) => {
            loaded = data.resource(uri)?;
            &loaded
        }
        (None, None) => return Err("it has neither a URI nor a buffer view".into()),
    };
    let format = match image::guess_format(bytes) {
        Ok(format @ (ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::WebP)) => format,
        _ => return Err(unread(bytes)),
    };
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(LONGEST);
    limits.max_image_height = Some(LONGEST);
    limits.max_alloc = Some(data.limits.bytes as u64);
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    reader.limits(limits);
    let image = reader.decode()?.into_rgba8();
    let (width, height) = (image.width() as usize, image.height() as usize);
    if width * height == 0 {
        return Err("it has no pixels".into());
    }
    Ok(Picture { width, height, texels: image.into_raw().as_chunks::<4>().0.to_vec() })
}

fn unread(bytes: &[u8]) -> Error {
    let kind = UNREAD.iter().find(|(start, _)| bytes.starts_with(start)).map_or("of an unknown kind", |kind| kind.1);
    let tool = if kind == "KTX2" { "ktxdecompress" } else { "png" };
    format!(
        "it is {kind}, but PNG, JPEG and WebP alone are read; \
         `gltf-transform {tool} in.glb out.glb` converts a file's images"
    )
    .into()
}
