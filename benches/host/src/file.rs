//! Images on disk.

use std::path::Path;

use exr::meta::attribute::Chromaticities;
use glam::{DMat3, Vec3, dvec3};
use image::{Rgb, RgbImage};

use crate::Error;
use crate::film::Image;

/// Brightness of the reference's mean in a picture, before the shoulder. *Format*: a matter of taste.
const KEY: f32 = 0.35;

/// Red, green, blue and white of linear sRGB, in CIE xy; *format*, from Rec. ITU-R BT.709.
const SRGB: [[f64; 2]; 4] = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], [0.3127, 0.3290]];

/// Reads an `OpenEXR` file. Colors of other primaries are converted to those of linear sRGB, without adaptation of the
/// white.
pub(crate) fn read_exr(path: &Path) -> Result<Image, Error> {
    let read = exr::prelude::read_first_rgba_layer_from_file(
        path,
        |size, _| Image::black(size.x(), size.y()),
        |image, at, (r, g, b, _): (f32, f32, f32, f32)| {
            image.pixels[at.y() * image.width + at.x()] = Vec3::new(r, g, b);
        },
    );
    let read = read.map_err(|error| format!("cannot read {}: {error}", path.display()))?;
    let mut image = read.layer_data.channel_data.pixels;
    if let Some(Chromaticities { red, green, blue, white }) = read.attributes.chromaticities {
        let file = [red, green, blue, white].map(|place| [f64::from(place.x()), f64::from(place.y())]);
        let to_srgb = to_xyz(SRGB).inverse() * to_xyz(file);
        for pixel in &mut image.pixels {
            *pixel = (to_srgb * pixel.as_dvec3()).as_vec3();
        }
    }
    match image.pixels.iter().position(|pixel| !pixel.is_finite()) {
        Some(i) => Err(format!("pixel {i} of {} is {}", path.display(), image.pixels[i]).into()),
        None => Ok(image),
    }
}

/// Returns the matrix from colors of these primaries to CIE XYZ; white has a luminance of 1.
fn to_xyz(chromaticities: [[f64; 2]; 4]) -> DMat3 {
    let [red, green, blue, white] = chromaticities.map(|[x, y]| dvec3(x / y, 1.0, (1.0 - x - y) / y));
    let primaries = DMat3::from_cols(red, green, blue);
    primaries * DMat3::from_diagonal(primaries.inverse() * white)
}

/// Writes an `OpenEXR` file.
pub(crate) fn write_exr(path: &Path, image: &Image) -> Result<(), Error> {
    let pixel = |x: usize, y: usize| image.pixels[y * image.width + x].into();
    exr::prelude::write_rgb_file(path, image.width, image.height, pixel)
        .map_err(|error| format!("cannot write {}: {error}", path.display()).into())
}

/// Writes a picture that can be looked at, exposed by the mean of the reference.
pub(crate) fn write_png(path: &Path, image: &Image, reference: &Image) -> Result<(), Error> {
    let exposure = KEY / reference.mean().as_vec3().max_element().max(f32::MIN_POSITIVE);
    let picture = RgbImage::from_fn(image.width as u32, image.height as u32, |x, y| {
        Rgb(display(exposure * image.pixels[y as usize * image.width + x as usize]))
    });
    picture.save(path).map_err(|error| format!("cannot write {}: {error}", path.display()).into())
}

/// Converts linear RGB to sRGB, with a shoulder that never clips.
fn display(radiance: Vec3) -> [u8; 3] {
    let encode = |linear: f32| {
        let encoded = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
        (255.0 * encoded + 0.5) as u8
    };
    radiance.to_array().map(|channel| encode(1.0 - (-channel).exp()))
}

#[cfg(test)]
mod tests {
    use glam::dvec3;

    use super::{SRGB, to_xyz};

    #[test]
    fn luminance_of_srgb_has_the_usual_weights() {
        let luminance = to_xyz(SRGB).row(1);
        assert!(luminance.distance(dvec3(0.2126, 0.7152, 0.0722)) < 1e-4, "{luminance}");
    }
}
