//! A portal in front of a portal: what each way to handle it costs.
//!
//! Nearly all samples on the large outer portal end on the wall around the small inner one. A host that knows its house
//! flags the inner one alone. One that does not flags both, and has `fanlight` learn what gets through.

use super::contestant;
use crate::render::{Error, LightChoice, Model, Techniques, World};
use crate::report::{Comparison, Contestant, Effort, Role, compare, seconds};

/// Rays that what gets through is learned by. Their time is part of that of the image.
const RAYS: u64 = 1 << 14;

pub(super) fn study(model: &Model, effort: Effort) -> Result<Comparison, Error> {
    let flagged = |prefix: &str| -> Result<Techniques, Error> {
        Techniques::plain(&Model { portal_prefix: prefix.to_owned(), ..model.clone() })
    };
    let world = World::new(model);
    let start = seconds();
    let learned = Techniques::plain(model)?.learned(&world, &model.camera, RAYS)?;
    let learning = seconds() - start;
    println!("\nWhat gets through the portals was learned by {RAYS} rays in {learning:.2} s of processor time.");
    let learned = contestant("both, learned", Role::Fanlight, learned);
    let contestants = [
        contestant("sky", Role::Competitor, Techniques::without(model)?),
        contestant(
            "both, single-hit density (wrong)",
            Role::Fanlight,
            Techniques::plain(model)?.choosing(LightChoice::Single),
        ),
        contestant("outer portal alone", Role::Fanlight, flagged("window outer")?),
        contestant("both, density of the direction", Role::Fanlight, Techniques::plain(model)?),
        Contestant { seconds: learning, ..learned },
        contestant("inner portal alone", Role::Fanlight, flagged("window inner")?),
    ];
    let comparison = compare("nested, 1 bounce", &world, model.camera, 1, &contestants, effort)?;
    let mean = |image: &crate::render::Image| image.mean().element_sum();
    let ratio = mean(&comparison.images[1]) / mean(comparison.reference.image());
    println!("With the single-hit density the image is {ratio:.2} times as bright as it should be.");
    Ok(comparison)
}
