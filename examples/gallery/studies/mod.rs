//! What is measured in each scene.

mod emission;
mod facade;
mod fog;
mod letters;
mod neon;
mod nested;
mod street;
mod town;

use crate::render::{Error, Model, Techniques, World};
use crate::report::{Comparison, Contestant, Effort, Role, compare};
use crate::scenes::Scene;

/// Renders a scene without and with `fanlight`, and finds out what else there is to be found out in it.
pub(crate) fn study(scene: &Scene, model: &Model, effort: Effort) -> Result<Comparison, Error> {
    match scene.name {
        "letters" => letters::study(model, effort),
        "facade" => facade::study(model, effort),
        "fog" => fog::study(model, scene.bounces, effort),
        "nested" => nested::study(model, effort),
        "neon" => neon::study(model, effort),
        "street" => street::study(model, scene.bounces, effort),
        "town" => town::study(model, scene.bounces, effort),
        name => without_and_with(name, model, scene.bounces, effort),
    }
}

/// Renders a model without and with `fanlight` by the same plain path tracer, and by all that this renderer has, for
/// each number of bounces. Returns the last comparison.
pub(crate) fn without_and_with(
    name: &str,
    model: &Model,
    bounces: &[u32],
    effort: Effort,
) -> Result<Comparison, Error> {
    let world = World::new(model);
    let lights = if model.sky.is_some() { "sky and lights by power" } else { "lights by power" };
    let mut contestants = vec![
        contestant("surfaces alone", Role::Competitor, Techniques::surfaces(model)?),
        contestant(lights, Role::Competitor, Techniques::without(model)?),
        contestant("fanlight", Role::Fanlight, Techniques::plain(model)?),
        contestant("fanlight, sky and rays of light", Role::Extra, Techniques::with_light_rays(model)?),
    ];
    if model.has_rough() {
        let blind = Techniques::plain(model)?.without_lobes();
        contestants.insert(2, contestant("fanlight without lobes", Role::Fanlight, blind));
    }
    // No ray finds these.
    if !model.lamps.is_empty() {
        contestants.remove(0);
    }
    let mut last = Err("no number of bounces was given".into());
    for &bounces in bounces {
        let title = format!("{name}, {bounces} bounce{}", if bounces == 1 { "" } else { "s" });
        last = Ok(compare(&title, &world, model.camera, bounces, &contestants, effort)?);
    }
    last
}

fn contestant(name: &str, role: Role, techniques: Techniques) -> Contestant {
    Contestant { name: name.to_owned(), role, techniques, seconds: 0.0 }
}
