//! A pinhole camera, or one that looks along parallel rays.

use glam::{Mat3, Vec2, Vec3, vec3};

/// Where the picture is taken from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Camera {
    width: u32,
    height: u32,
    pub(crate) position: Vec3,
    /// Camera to world; the columns are the image's right, its top, and backwards.
    pub(crate) axes: Mat3,
    /// Vertical field of view in radians.
    pub(crate) field_of_view: f32,
    /// Height of what is seen if all rays are parallel.
    pub(crate) parallel: Option<f32>,
}

impl Camera {
    /// A camera that looks at a point, of this vertical field of view in degrees.
    pub(crate) fn looking(position: Vec3, target: Vec3, degrees: f32) -> Self {
        let backward = (position - target).normalize();
        let right = Vec3::Y.cross(backward).normalize_or(Vec3::X);
        Self::new(position, Mat3::from_cols(right, backward.cross(right), backward), degrees.to_radians())
    }

    /// A camera with these axes and this vertical field of view in radians.
    pub(crate) const fn new(position: Vec3, axes: Mat3, field_of_view: f32) -> Self {
        Self { width: 208, height: 156, position, axes, field_of_view, parallel: None }
    }

    /// Returns the camera with parallel rays, which see this height.
    pub(crate) const fn parallel(self, height: f32) -> Self {
        Self { parallel: Some(height), ..self }
    }

    /// Returns the camera with another number of pixels.
    pub(crate) const fn sized(self, [width, height]: [u32; 2]) -> Self {
        Self { width, height, ..self }
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
        let height = self.parallel.unwrap_or_else(|| 2.0 * (0.5 * self.field_of_view).tan());
        let pixel = height / self.height as f32;
        let x = (point.x - 0.5 * self.width as f32) * pixel;
        let y = (0.5 * self.height as f32 - point.y) * pixel;
        match self.parallel {
            Some(_) => (self.position + self.axes * vec3(x, y, 0.0), self.axes * vec3(0.0, 0.0, -1.0)),
            None => (self.position, self.axes * vec3(x, y, -1.0).normalize()),
        }
    }
}
