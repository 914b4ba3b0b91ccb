//! Images as pictures that can be looked at.

use std::path::Path;

use glam::{Vec2, Vec3, uvec2, vec2};
use image::{Rgb, RgbImage, imageops};

use crate::render::{Error, Image, encode_srgb};
use crate::scenes::is_ink;

/// How bright the mean of the reference becomes, before the shoulder.
const KEY: f32 = 0.35;
/// Pixels between two images.
const GAP: u32 = 4;
/// Size and enlargement of the details.
const DETAIL: (u32, u32) = (44, 33);
const ENLARGED: u32 = 3;
/// Size of one image on the contact sheet: less than half of what is rendered, for a sheet of less than 300 kB.
const TILE: (u32, u32) = (92, 69);

/// Images of one scene in the same exposure.
pub(crate) struct Picture {
    exposure: f32,
}

impl Picture {
    /// Exposes by the mean of a reference.
    pub(crate) fn exposed_by(reference: &Image) -> Self {
        Self { exposure: KEY / reference.mean().as_vec3().max_element().max(f32::MIN_POSITIVE) }
    }

    /// One image, ready to be looked at.
    pub(crate) fn develop(&self, image: &Image) -> RgbImage {
        RgbImage::from_fn(image.width as u32, image.height as u32, |x, y| {
            Rgb(display(self.exposure * image.pixels[y as usize * image.width + x as usize]))
        })
    }

    /// Two images side by side, and below them a detail of each and of their reference, enlarged.
    pub(crate) fn pair(&self, images: [&Image; 2], reference: &Image, detail: [f32; 2]) -> RgbImage {
        let [a, b] = images.map(|image| self.develop(image));
        let (width, height) = a.dimensions();
        let (detail_width, detail_height) = (ENLARGED * DETAIL.0, ENLARGED * DETAIL.1);
        let mut sheet = white(2 * width + GAP, height + GAP + detail_height);
        imageops::replace(&mut sheet, &a, 0, 0);
        imageops::replace(&mut sheet, &b, i64::from(width + GAP), 0);
        let at =
            |share: f32, size: u32, part: u32| ((share * size as f32) as u32).saturating_sub(part / 2).min(size - part);
        let (x, y) = (at(detail[0], width, DETAIL.0), at(detail[1], height, DETAIL.1));
        for (i, image) in (0..).zip([&a, &b, &self.develop(reference)]) {
            let part = imageops::crop_imm(image, x, y, DETAIL.0, DETAIL.1).to_image();
            let part = imageops::resize(&part, detail_width, detail_height, imageops::FilterType::Nearest);
            imageops::replace(&mut sheet, &part, i64::from(i * (detail_width + GAP)), i64::from(height + GAP));
        }
        sheet
    }
}

/// The two images of a picture that was saved before.
pub(crate) fn images_of(path: &Path) -> Result<[RgbImage; 2], Error> {
    let picture = image::open(path).map_err(|error| format!("cannot read {}: {error}", path.display()))?.into_rgb8();
    let (width, height) = (picture.width().saturating_sub(GAP) / 2, picture.height());
    let height = height.saturating_sub(GAP + ENLARGED * DETAIL.1);
    Ok([0, width + GAP].map(|left| imageops::crop_imm(&picture, left, 0, width, height).to_image()))
}

/// Pairs of pictures with their names, three to a row.
pub(crate) fn contact_sheet(pairs: &[(&str, [RgbImage; 2])]) -> RgbImage {
    const COLUMNS: u32 = 3;
    const LABEL: u32 = 14;
    let (width, height) = (2 * TILE.0 + GAP, TILE.1 + LABEL + GAP);
    let rows = (pairs.len() as u32).div_ceil(COLUMNS);
    let mut sheet = white(COLUMNS * (width + GAP) - GAP, rows * height);
    for (i, (name, images)) in (0..).zip(pairs) {
        let corner = uvec2(i % COLUMNS * (width + GAP), i / COLUMNS * height);
        write_text(&mut sheet, &name.to_uppercase(), [corner.x, corner.y]);
        for (j, image) in (0..).zip(images) {
            let small = imageops::resize(image, TILE.0, TILE.1, imageops::FilterType::Triangle);
            let (x, y) = (corner.x + j * (TILE.0 + GAP), corner.y + LABEL);
            imageops::replace(&mut sheet, &small, i64::from(x), i64::from(y));
        }
    }
    sheet
}

fn write_text(sheet: &mut RgbImage, text: &str, [left, top]: [u32; 2]) {
    let (width, height) = (6 * text.len() as u32 + 1, 9);
    for y in 0..height {
        for x in 0..width {
            let place: Vec2 = (vec2(x as f32, y as f32) + 0.5) / vec2(width as f32, height as f32);
            if is_ink(text, place) {
                sheet.put_pixel(left + x, top + y + 2, Rgb([40; 3]));
            }
        }
    }
}

fn white(width: u32, height: u32) -> RgbImage {
    RgbImage::from_pixel(width, height, Rgb([255; 3]))
}

/// Saves a picture.
pub(crate) fn save(picture: &RgbImage, path: &Path) -> Result<(), Error> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(|error| format!("cannot make {}: {error}", folder.display()))?;
    }
    picture.save(path).map_err(|error| format!("cannot write {}: {error}", path.display()).into())
}

/// Linear RGB to sRGB, with a shoulder that never clips.
fn display(radiance: Vec3) -> [u8; 3] {
    radiance.to_array().map(|channel| encode_srgb(1.0 - (-channel).exp()))
}
