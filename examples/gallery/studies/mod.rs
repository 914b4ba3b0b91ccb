//! What is measured in each scene.

use crate::render::{Error, Model, Techniques, World};
use crate::report::{Comparison, Contestant, Effort, compare};
use crate::scenes::Scene;

/// Renders a scene without and with `fanlight`, and whatever else is to be found out in it.
pub(crate) fn study(scene: &Scene, model: &Model, effort: Effort) -> Result<Comparison, Error> {
    without_and_with(scene.name, model, scene.bounces, effort)
}

/// Renders a model without and with `fanlight`, for each number of bounces. Returns the last comparison.
pub(crate) fn without_and_with(
    name: &str,
    model: &Model,
    bounces: &[u32],
    effort: Effort,
) -> Result<Comparison, Error> {
    let world = World::new(model);
    let contestants = [
        Contestant { name: "without".to_owned(), techniques: Techniques::without(model)? },
        Contestant { name: "with fanlight".to_owned(), techniques: Techniques::with(model)? },
    ];
    let mut last = Err("no number of bounces was asked for".into());
    for &bounces in bounces {
        let title = format!("{name}, {bounces} bounce{}", if bounces == 1 { "" } else { "s" });
        last = Ok(compare(&title, &world, model.camera, bounces, &contestants, effort)?);
    }
    last
}
