//! Reads a model from glTF.

use std::path::Path;

use crate::render::{Camera, Error, Model, Sky};

pub(crate) fn read(_path: &Path, _prefix: &str, sky: Sky) -> Result<Model, Error> {
    Ok(Model::new(Camera::looking(glam::Vec3::ONE, glam::Vec3::ZERO, 60.0), Some(sky)))
}
