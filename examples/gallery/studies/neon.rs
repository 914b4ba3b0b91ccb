//! Ways to choose points of a textured mesh light, in equal time and with equal samples.

use super::contestant;
use crate::render::{
    Budget, Error, Illumination, LightChoice, Lights, Model, Published, Techniques, TexelTable, World,
};
use crate::report::{Comparison, Effort, Role, compare};

/// Samples a pixel where these are the same for all.
const SAMPLES: Budget = Budget::Samples(16);

pub(super) fn study(model: &Model, effort: Effort) -> Result<Comparison, Error> {
    let with = |illumination| -> Result<Techniques, Error> {
        Ok(Techniques::plain(model)?.with_lights(Lights::new(model, illumination)?))
    };
    let contestants = [
        contestant("by area", Role::Competitor, Techniques::without(model)?),
        contestant(
            "by texel, one table",
            Role::Extra,
            Techniques::without(model)?.choosing(LightChoice::Table(TexelTable::texels(model))),
        ),
        contestant("boundary integration", Role::Fanlight, with(Illumination::Boundary)?),
        contestant(
            "published method",
            Role::Extra,
            Techniques::without(model)?.choosing(LightChoice::Published(Published::new(model))),
        ),
        contestant("conservative term alone", Role::Fanlight, with(Illumination::Conservative)?),
        contestant("clamped vertices (default)", Role::Fanlight, with(Illumination::default())?),
    ];
    let world = World::new(model);
    let samples = Effort { budget: SAMPLES, ..effort };
    compare("neon, 1 bounce, equal samples", &world, model.camera, 1, &contestants, samples)?;
    compare("neon, 1 bounce, equal time", &world, model.camera, 1, &contestants, effort)
}
