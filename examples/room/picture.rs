//! The images as a picture that can be looked at.

use std::path::Path;

use glam::Vec3;
use image::{Rgb, RgbImage};

use crate::render::{Error, Image};

/// How bright the mean of the reference becomes, before the shoulder.
const KEY: f32 = 0.35;
/// Columns between two images.
const GAP: usize = 2;

/// Writes images side by side, exposed by the mean of a reference.
pub(crate) fn write(path: &Path, images: &[&Image], reference: &Image) -> Result<(), Error> {
    let exposure = KEY / reference.mean().as_vec3().max_element().max(f32::MIN_POSITIVE);
    let width: usize = images.iter().map(|image| image.width + GAP).sum::<usize>() - GAP;
    let mut picture = RgbImage::from_pixel(width as u32, reference.height as u32, Rgb([255; 3]));
    let mut left = 0;
    for image in images {
        for (i, &pixel) in image.pixels.iter().enumerate() {
            let (x, y) = (left + i % image.width, i / image.width);
            picture.put_pixel(x as u32, y as u32, Rgb(display(exposure * pixel)));
        }
        left += image.width + GAP;
    }
    picture.save(path).map_err(|error| format!("cannot write {}: {error}", path.display()).into())
}

/// Linear RGB to sRGB, with a shoulder that never clips.
fn display(radiance: Vec3) -> [u8; 3] {
    let encode = |linear: f32| {
        let encoded = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
        (255.0 * encoded + 0.5) as u8
    };
    radiance.to_array().map(|channel| encode(1.0 - (-channel).exp()))
}
