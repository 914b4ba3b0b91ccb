//! A street at night, with and without fog.

use super::without_and_with;
use crate::render::{Error, Model};
use crate::report::{Comparison, Effort};
use crate::scenes::foggy_street;

pub(crate) fn study(model: &Model, bounces: &[u32], effort: Effort) -> Result<Comparison, Error> {
    let mut foggy = foggy_street();
    foggy.camera = model.camera;
    without_and_with("street in fog", &foggy, &[1], effort)?;
    without_and_with("street", model, bounces, effort)
}
