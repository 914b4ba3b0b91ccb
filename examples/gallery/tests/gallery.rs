//! Renders the gallery's scenes without and with `fanlight`: whatever techniques are used, the mean is the same.

#[expect(dead_code, unused_imports, reason = "the example uses the rest")]
#[path = "../render/mod.rs"]
mod render;
#[expect(dead_code, unused_imports, reason = "the example uses the rest")]
#[path = "../scenes/mod.rs"]
mod scenes;

use render::{Budget, LightChoice, PathTracer, Progressive, Published, Techniques, World};

/// Pixels of the pictures.
const SIZE: [u32; 2] = [32, 24];
/// How many standard errors the means may differ by: one in fifteen thousand tests fails by chance.
const LIMIT: f64 = 4.0;

/// Mean of all channels of a rendering, and its variance.
fn mean(world: &World, model: &render::Model, techniques: &Techniques, bounces: u32, samples: u32) -> [f64; 2] {
    let tracer = PathTracer::new(world, techniques, bounces);
    let film = Progressive { tracer, camera: model.camera, seed: 7 }.render(Budget::Samples(samples), drop).0;
    let pixels = f64::from(SIZE[0] * SIZE[1]);
    let variance = film.variance().iter().map(|pixel| pixel.element_sum()).sum::<f64>();
    // Three times: channels are not independent of each other.
    [film.image().mean().element_sum(), 3.0 * variance / (pixels * pixels)]
}

/// Compares the means of a scene, of which each must be known to such a share.
fn check(name: &str, bounces: u32, samples: [u32; 2], share: f64) {
    compare(name, bounces, samples, share, |model| Techniques::without(model).expect("lights"));
}

/// Compares the means of a scene. The given techniques are those that all others are compared with.
fn compare(name: &str, bounces: u32, samples: [u32; 2], share: f64, techniques: impl Fn(&render::Model) -> Techniques) {
    let scene = scenes::ALL.iter().find(|scene| scene.name == name).expect("a scene");
    compare_models(name, (scene.model)(), bounces, samples, share, techniques);
}

/// Compares the means of a model that is not in the list.
fn compare_models(
    name: &str,
    mut model: render::Model,
    bounces: u32,
    samples: [u32; 2],
    share: f64,
    techniques: impl Fn(&render::Model) -> Techniques,
) {
    model.camera = model.camera.sized(SIZE);
    let world = World::new(&model);
    let without = techniques(&model);
    let [a, a_variance] = mean(&world, &model, &without, bounces, samples[0]);
    for with in [Techniques::plain(&model), Techniques::with_light_rays(&model)] {
        let [b, b_variance] = mean(&world, &model, &with.expect("lights"), bounces, samples[1]);
        let error = (a_variance + b_variance).sqrt();
        assert!(error < share * b, "{name}: {error} says nothing about {a} and {b}");
        assert!((a - b).abs() < LIMIT * error, "{name}: {a} without, {b} with, standard error {error}");
    }
}

#[test]
fn room() {
    check("room", 4, [400, 60], 0.03);
}

#[test]
fn car() {
    check("car", 4, [200, 40], 0.02);
}

#[test]
fn lantern() {
    check("lantern", 3, [1500, 60], 0.06);
}

#[test]
fn facade() {
    check("facade", 2, [400, 20], 0.05);
}

#[test]
fn neon() {
    check("neon", 2, [600, 60], 0.03);
}

#[test]
fn fog() {
    check("fog", 3, [400, 40], 0.03);
}

#[test]
fn street() {
    check("street", 2, [1500, 150], 0.03);
}

/// The lights are copies of a lamp and of three windows.
#[test]
fn town() {
    check("town", 1, [200, 40], 0.05);
}

#[test]
fn glossy() {
    check("glossy", 2, [600, 80], 0.03);
}

#[test]
fn street_in_fog() {
    let without = |model: &render::Model| Techniques::without(model).expect("lights");
    compare_models("fog", scenes::foggy_street(), 1, [600, 100], 0.05, without);
}

/// What the default is compared with is right, too.
#[test]
fn neon_as_published() {
    compare("neon", 1, [200, 100], 0.02, |model| {
        let techniques = Techniques::without(model).expect("lights");
        techniques.choosing(LightChoice::Published(Published::new(model)))
    });
}
