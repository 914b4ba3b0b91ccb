//! The sky that is seen through the window: a latitude-longitude image in RGB.

use core::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3, vec2, vec3};

use super::film::Image;

/// Weights of the luminance of linear sRGB.
pub(crate) const LUMINANCE: Vec3 = vec3(0.2126, 0.7152, 0.0722);

/// Radiance by direction.
///
/// Column `u` and row `v` of the image, both from 0 to 1, look along (sin φ sin θ, cos θ, −cos φ sin θ) with φ = 2π u
/// and θ = π v: y is up, the middle of the image looks to +z and its edges to −z.
pub(crate) struct Sky {
    image: Image,
}

impl Sky {
    /// A sky given by its texels.
    pub(crate) fn new(mut image: Image) -> Self {
        // Real captures hold slightly negative texels.
        for texel in &mut image.pixels {
            *texel = texel.max(Vec3::ZERO);
        }
        Self { image }
    }

    /// Columns of the image.
    pub(crate) fn width(&self) -> usize {
        self.image.width
    }

    /// Rows of the image.
    pub(crate) fn height(&self) -> usize {
        self.image.height
    }

    /// What guides the sampling: one number for each texel.
    pub(crate) fn luminance(&self) -> Vec<f32> {
        self.image.pixels.iter().map(|texel| texel.dot(LUMINANCE)).collect()
    }

    /// Radiance along a unit direction, interpolated between the middles of the four nearest texels.
    pub(crate) fn radiance(&self, direction: Vec3) -> Vec3 {
        let size = vec2(self.image.width as f32, self.image.height as f32);
        let point = latitude_longitude(direction) * size - 0.5;
        let low = point.floor();
        let weight = point - low;
        let row = |y: f32| self.texel(low.x, y).lerp(self.texel(low.x + 1.0, y), weight.x);
        row(low.y).lerp(row(low.y + 1.0), weight.y)
    }

    /// A texel; its column may lie one beyond the image's edges, which meet, and its row one beyond the poles.
    fn texel(&self, x: f32, y: f32) -> Vec3 {
        let (width, height) = (self.image.width, self.image.height);
        let column = (x + width as f32) as usize % width;
        let row = (y.max(0.0) as usize).min(height - 1);
        self.image.pixels[row * width + column]
    }
}

/// Column and row, both from 0 to 1, of a unit direction.
pub(crate) fn latitude_longitude(direction: Vec3) -> Vec2 {
    let turns = direction.x.atan2(-direction.z) / TAU;
    let theta = direction.y.clamp(-1.0, 1.0).acos();
    vec2(if turns < 0.0 { turns + 1.0 } else { turns }, theta / PI)
}

/// The unit direction of a column and a row, both from 0 to 1.
pub(crate) fn direction_of(point: Vec2) -> Vec3 {
    let (sin_phi, cos_phi) = (TAU * point.x).sin_cos();
    let (sin_theta, cos_theta) = (PI * point.y).sin_cos();
    vec3(sin_phi * sin_theta, cos_theta, -cos_phi * sin_theta)
}
