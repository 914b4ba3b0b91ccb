//! A room full of fog: the light that fog scatters by itself, and with that of the surfaces.

use glam::Vec3;

use super::without_and_with;
use crate::render::{Error, Model};
use crate::report::{Comparison, Effort};

pub(super) fn study(model: &Model, bounces: &[u32], effort: Effort) -> Result<Comparison, Error> {
    let mut black = model.clone();
    for material in &mut black.materials {
        material.color = Vec3::ZERO;
    }
    without_and_with("fog among black walls", &black, &[1], effort)?;
    without_and_with("fog", model, bounces, effort)
}
