//! A pinhole camera.

use glam::{Mat3, Vec2, Vec3, vec3};

use crate::film::RESOLUTION;

/// A camera without a lens.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Camera {
    position: Vec3,
    /// Camera to world; the columns are the image's right, its top, and backwards.
    axes: Mat3,
    /// Tangent of half the horizontal field of view.
    half_width: f32,
}

impl Camera {
    /// Returns a camera at a position, with a point in the middle of its image and a horizontal field of view in
    /// degrees.
    pub(crate) fn new(position: Vec3, target: Vec3, up: Vec3, field_of_view: f32) -> Self {
        let backward = (position - target).normalize();
        let right = up.cross(backward).normalize();
        let axes = Mat3::from_cols(right, backward.cross(right), backward);
        Self { position, axes, half_width: (0.5 * field_of_view.to_radians()).tan() }
    }

    /// Returns a camera with these axes, which see as far up and down as this vertical field of view in radians.
    pub(crate) fn with_axes(position: Vec3, axes: Mat3, field_of_view: f32) -> Self {
        let [width, height] = RESOLUTION.map(|n| n as f32);
        Self { position, axes, half_width: (0.5 * field_of_view).tan() * width / height }
    }

    /// Returns the start and the unit direction of the ray through a point of the image, in pixels from the upper left
    /// corner.
    pub(crate) fn ray(&self, point: Vec2) -> (Vec3, Vec3) {
        let [width, height] = RESOLUTION.map(|n| n as f32);
        let pixel = 2.0 * self.half_width / width;
        let x = (point.x - 0.5 * width) * pixel;
        let y = (0.5 * height - point.y) * pixel;
        (self.position, self.axes * vec3(x, y, -1.0).normalize())
    }
}
