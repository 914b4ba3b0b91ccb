//! A portal in front of a portal: what each way to handle it costs.
//!
//! Nearly all samples on the large outer portal end on the wall around the small inner one. A host that knows its house
//! flags the inner one alone. One that does not can find out: the share of a portal's samples that reaches the sky,
//! counted once for the whole picture, times its weight.

use super::contestant;
use crate::render::{Error, Illumination, LightChoice, Lights, Model, Random, Techniques, World};
use crate::report::{Comparison, Effort, Role, compare};

/// Points, along each side of the image, from which it is counted what gets through.
const PROBES: u16 = 64;
/// Least share of a portal: where it was not seen to send anything it may still.
const LEAST: f32 = 1e-3;

pub(super) fn study(model: &Model, effort: Effort) -> Result<Comparison, Error> {
    let flagged = |prefix: &str| -> Result<Techniques, Error> {
        Techniques::plain(&Model { portal_prefix: prefix.to_owned(), ..model.clone() })
    };
    let world = World::new(model);
    let shares = reaching(model, &world)?;
    println!("\nShare of the samples on the inner and on the outer portal that reach the sky: {shares:.4?}");
    let learned = Lights::weighted(model, Illumination::default(), |portal| shares[portal].max(LEAST))?;
    let contestants = [
        contestant("sky", Role::Competitor, Techniques::without(model)?),
        contestant(
            "both, single-hit density (wrong)",
            Role::Fanlight,
            Techniques::plain(model)?.choosing(LightChoice::Single),
        ),
        contestant("outer portal alone", Role::Fanlight, flagged("window outer")?),
        contestant("both, density of the direction", Role::Fanlight, Techniques::plain(model)?),
        contestant(
            "both, weighted by what gets through",
            Role::Fanlight,
            Techniques::plain(model)?.with_lights(learned),
        ),
        contestant("inner portal alone", Role::Fanlight, flagged("window inner")?),
    ];
    let comparison = compare("nested, 1 bounce", &world, model.camera, 1, &contestants, effort)?;
    let mean = |image: &crate::render::Image| image.mean().element_sum();
    let ratio = mean(&comparison.images[1]) / mean(comparison.reference.image());
    println!("With the single-hit density the image is {ratio:.2} times as bright as it should be.");
    Ok(comparison)
}

/// Which share of each portal's samples reaches the sky from what the camera sees.
fn reaching(model: &Model, world: &World) -> Result<Vec<f32>, Error> {
    let lights = Lights::new(model, Illumination::default())?;
    let portals = model.meshes.iter().filter(|mesh| model.is_portal(mesh)).count();
    let mut counts = vec![[0.0_f32; 2]; portals];
    let mut random = Random::new(0, 1);
    let camera = &model.camera;
    for i in 0..PROBES * PROBES {
        let pixel = glam::vec2(f32::from(i % PROBES), f32::from(i / PROBES)) / f32::from(PROBES);
        let (origin, direction) = camera.ray(pixel * glam::vec2(camera.width() as f32, camera.height() as f32));
        let Some(point) = world.trace(origin, direction).1 else { continue };
        if let Some((portal, direction)) = lights.sample_portal(point.position, point.normal, random.take()) {
            let reaches = world.arriving(point.position, direction).radiance != glam::Vec3::ZERO;
            counts[portal][0] += f32::from(u8::from(reaches));
            counts[portal][1] += 1.0;
        }
    }
    Ok(counts.into_iter().map(|[reached, all]| if all > 0.0 { reached / all } else { 1.0 }).collect())
}
