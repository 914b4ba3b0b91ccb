//! The sky: a latitude-longitude image in RGB.

use core::f32::consts::{PI, TAU};

use glam::{Mat3, Vec2, Vec3, vec2, vec3};

use crate::film::Image;

/// Weights of the luminance of linear sRGB.
pub(crate) const LUMINANCE: Vec3 = vec3(0.2126, 0.7152, 0.0722);

/// Radiance by direction.
///
/// In the sky's own frame, point `(u, v)` of the image, with `v = 0` at the top, looks along
/// (cos φ sin θ, −sin φ sin θ, cos θ) with φ = 2π u and θ = π v. Texel centers are at half integers.
#[derive(Clone, Debug)]
pub(crate) struct Sky {
    image: Image,
    /// From the sky's frame to the world.
    rotation: Mat3,
}

impl Sky {
    /// Returns a sky given by its texels, and by the rotation that places it in the world.
    pub(crate) fn new(mut image: Image, rotation: Mat3) -> Self {
        // Real captures hold slightly negative texels.
        for texel in &mut image.pixels {
            *texel = texel.max(Vec3::ZERO);
        }
        Self { image, rotation }
    }

    /// The texels.
    pub(crate) const fn image(&self) -> &Image {
        &self.image
    }

    /// Rotation from the sky's frame to the world.
    pub(crate) const fn rotation(&self) -> Mat3 {
        self.rotation
    }

    /// Returns the luminance of every texel.
    pub(crate) fn luminance(&self) -> Vec<f32> {
        self.image.pixels.iter().map(|texel| texel.dot(LUMINANCE)).collect()
    }

    /// Returns the point of the image, both coordinates from 0 to 1, that a unit world direction looks at.
    #[inline]
    pub(crate) fn place(&self, direction: Vec3) -> Vec2 {
        latitude_longitude(self.rotation.transpose_mul_vec3(direction))
    }

    /// Returns the unit world direction of a point of the image, given the cosine of its latitude's θ.
    #[inline]
    pub(crate) fn direction(&self, u: f32, cosine: f32) -> Vec3 {
        let (sin, cos) = (TAU * u).sin_cos();
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        self.rotation * vec3(cos * sine, -sin * sine, cosine)
    }

    /// Returns the radiance along a unit direction, interpolated between the four nearest texel centers. Columns
    /// repeat, rows end at the poles.
    #[inline]
    pub(crate) fn radiance(&self, direction: Vec3) -> Vec3 {
        let size = vec2(self.image.width as f32, self.image.height as f32);
        let point = self.place(direction) * size - 0.5;
        let low = point.floor();
        let weight = point - low;
        let row = |y: f32| self.texel(low.x, y).lerp(self.texel(low.x + 1.0, y), weight.x);
        row(low.y).lerp(row(low.y + 1.0), weight.y)
    }

    /// Returns a texel; its column may lie one beyond the image's edges, which meet, and its row one beyond the poles.
    #[inline]
    fn texel(&self, x: f32, y: f32) -> Vec3 {
        let (width, height) = (self.image.width, self.image.height);
        let column = if x < 0.0 { width - 1 } else { x as usize };
        let column = if column >= width { column - width } else { column };
        let row = (y.max(0.0) as usize).min(height - 1);
        self.image.pixels[row * width + column]
    }
}

/// Returns the point of a latitude-longitude image that a unit direction of the sky's frame looks at.
#[inline]
pub(crate) fn latitude_longitude(direction: Vec3) -> Vec2 {
    let turns = (-direction.y).atan2(direction.x) / TAU;
    let theta = direction.z.clamp(-1.0, 1.0).acos();
    vec2(if turns < 0.0 { turns + 1.0 } else { turns }, theta / PI)
}

/// Returns the unit direction, in the sky's frame, of a texel's center.
pub(crate) fn texel_direction([x, y]: [usize; 2], [width, height]: [usize; 2]) -> Vec3 {
    let (sin_phi, cos_phi) = (TAU * (x as f32 + 0.5) / width as f32).sin_cos();
    let (sin_theta, cos_theta) = (PI * (y as f32 + 0.5) / height as f32).sin_cos();
    vec3(cos_phi * sin_theta, -sin_phi * sin_theta, cos_theta)
}

/// Returns the texel whose center is nearest to a unit direction of the sky's frame.
pub(crate) fn texel_of(direction: Vec3, [width, height]: [usize; 2]) -> [usize; 2] {
    let point = latitude_longitude(direction);
    let index = |x: f32, size: usize| ((x * size as f32) as usize).min(size - 1);
    [index(point.x, width), index(point.y, height)]
}
