//! Skies of images and of formulas.

use glam::{Mat3, Vec2, Vec3, vec3};

use super::data::Data;
use crate::Error;
use crate::film::Image;
use crate::sky::{LUMINANCE, Sky, texel_direction};

/// Columns and rows of the skies that are made of formulas.
pub(super) const SIZE: [usize; 2] = [1024, 512];

/// Reads a captured sky.
pub(super) fn captured(data: &Data, name: &str) -> Result<Sky, Error> {
    Ok(Sky::new(data.image(&format!("environments/{name}.exr"))?, Mat3::IDENTITY))
}

/// Reads a captured sky, turned about z so that its brightest texel has x = 0, y > 0.
pub(super) fn facing_window(data: &Data, name: &str) -> Result<Sky, Error> {
    let image = data.image(&format!("environments/{name}.exr"))?;
    let luminance = |i: &usize| image.pixels[*i].dot(LUMINANCE);
    let brightest = (0..image.pixels.len()).max_by(|i, j| luminance(i).total_cmp(&luminance(j))).unwrap_or(0);
    let texel = [brightest % image.width, brightest / image.width];
    let direction = texel_direction(texel, [image.width, image.height]);
    let angle = direction.truncate().angle_to(Vec2::Y);
    Ok(Sky::new(image, Mat3::from_rotation_z(angle)))
}

/// Returns a smooth sky with a sun of half a degree around (0.3, 0.8, 0.5).
pub(super) fn with_small_sun() -> Sky {
    let axis = vec3(0.3, 0.8, 0.5).as_dvec3().normalize();
    let nearest = 0.5_f64.to_radians().cos();
    formula(
        |direction| {
            if direction.as_dvec3().dot(axis) > nearest { 20_000.0 } else { 0.2 + 0.8 * direction.z.max(0.0) }
        },
    )
}

/// Returns the gray sky whose texels have these radiances at their centers.
pub(super) fn formula(radiance: impl Fn(Vec3) -> f32) -> Sky {
    let [width, height] = SIZE;
    let texel = |i: usize| Vec3::splat(radiance(texel_direction([i % width, i / width], SIZE)));
    Sky::new(Image { width, height, pixels: (0..width * height).map(texel).collect() }, Mat3::IDENTITY)
}
