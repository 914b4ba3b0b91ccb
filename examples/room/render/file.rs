//! Images in RGB on disk.

use std::path::Path;

use glam::Vec3;

use super::Error;
use super::film::Image;

/// Reads an `OpenEXR` file (any compression, alpha ignored) or a Radiance file.
pub(crate) fn read_rgb(path: &Path) -> Result<Image, Error> {
    let is_exr = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("exr"));
    let image = if is_exr { read_exr(path) } else { read_other(path) };
    image.and_then(check_finite).map_err(|error| format!("cannot read {}: {error}", path.display()).into())
}

/// Refuses an image with a pixel that would spoil all sums.
fn check_finite(image: Image) -> Result<Image, Error> {
    match image.pixels.iter().position(|pixel| !pixel.is_finite()) {
        Some(i) => Err(format!("pixel ({}, {}) is {}", i % image.width, i / image.width, image.pixels[i]).into()),
        None => Ok(image),
    }
}

fn read_exr(path: &Path) -> Result<Image, Error> {
    let read = exr::prelude::read_first_rgba_layer_from_file(
        path,
        |size, _| Image::black(size.x(), size.y()),
        |image, at, (r, g, b, _): (f32, f32, f32, f32)| {
            image.pixels[at.y() * image.width + at.x()] = Vec3::new(r, g, b);
        },
    )?;
    Ok(read.layer_data.channel_data.pixels)
}

fn read_other(path: &Path) -> Result<Image, Error> {
    let image = image::open(path)?.into_rgb32f();
    let pixels = image.pixels().map(|pixel| Vec3::from_array(pixel.0)).collect();
    Ok(Image { width: image.width() as usize, height: image.height() as usize, pixels })
}

/// Writes an `OpenEXR` file.
pub(crate) fn write_rgb(path: &Path, image: &Image) -> Result<(), Error> {
    let pixel = |x: usize, y: usize| image.pixels[y * image.width + x].into();
    exr::prelude::write_rgb_file(path, image.width, image.height, pixel)
        .map_err(|error| format!("cannot write {}: {error}", path.display()).into())
}
