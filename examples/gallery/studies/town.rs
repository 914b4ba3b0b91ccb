//! A town of copies: what they take, and what they would take as triangles of their own.

use super::without_and_with;
use crate::render::{Error, Illumination, Lights, Model};
use crate::report::{Comparison, Effort};
use crate::scenes::flattened;

pub(super) fn study(model: &Model, bounces: &[u32], effort: Effort) -> Result<Comparison, Error> {
    let flat = flattened(model);
    for (name, model) in [("town", model), ("town, flattened", &flat)] {
        println!("{name}: {}", Lights::new(model, Illumination::default())?.described());
    }
    without_and_with("town, flattened", &flat, &bounces[..1], effort)?;
    without_and_with("town", model, bounces, effort)
}
