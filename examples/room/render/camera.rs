//! A pinhole camera.

use glam::{Mat3, Vec2, Vec3, vec3};

/// Pixels of the reference camera at scale 1.
const RESOLUTION: (u32, u32) = (96, 72);
/// Where it stands.
const POSITION: Vec3 = vec3(0.3, 2.2, 3.7);
/// What it looks at.
const TARGET: Vec3 = vec3(2.6, 0.3, 1.2);
/// Horizontal field of view.
const FIELD_OF_VIEW: f32 = 75.0;

/// The camera of the reference images: it stands beside the window, which it does not see, and looks at the floor that
/// the sun falls on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Camera {
    width: u32,
    height: u32,
    /// Camera to world; the columns are the image's right, its top, and backwards.
    axes: Mat3,
}

impl Camera {
    /// The camera with the given multiple of the pixels along each side.
    pub(crate) fn scaled(scale: u32) -> Self {
        let backward = (POSITION - TARGET).normalize();
        let right = Vec3::Y.cross(backward).normalize();
        let axes = Mat3::from_cols(right, backward.cross(right), backward);
        Self { width: RESOLUTION.0 * scale, height: RESOLUTION.1 * scale, axes }
    }

    /// The scale that gives images of this size.
    pub(crate) fn scale_of(width: usize, height: usize) -> Option<u32> {
        let scale = width as u32 / RESOLUTION.0;
        let fits = scale > 0 && width as u32 == scale * RESOLUTION.0 && height as u32 == scale * RESOLUTION.1;
        fits.then_some(scale)
    }

    /// Pixels across.
    pub(crate) const fn width(&self) -> usize {
        self.width as usize
    }

    /// Pixels down.
    pub(crate) const fn height(&self) -> usize {
        self.height as usize
    }

    /// Start and unit direction of the ray through a point of the image, in pixels from its upper left corner.
    pub(crate) fn ray(&self, point: Vec2) -> (Vec3, Vec3) {
        let half_width = (0.5 * FIELD_OF_VIEW.to_radians()).tan();
        let pixel = 2.0 * half_width / self.width as f32;
        let x = (point.x - 0.5 * self.width as f32) * pixel;
        let y = (0.5 * self.height as f32 - point.y) * pixel;
        (POSITION, self.axes * vec3(x, y, -1.0).normalize())
    }
}
