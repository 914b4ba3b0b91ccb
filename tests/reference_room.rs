//! Renders the reference room with the example's renderer, and compares it with images by another renderer.

#[expect(dead_code, reason = "the example uses the rest")]
#[path = "../examples/room/render/mod.rs"]
mod render;

use std::path::{Path, PathBuf};

use render::{
    Budget, Camera, Film, Lighting, Opening, PathTracer, Progressive, Reference, Room, Scene, Sky, Strategy, Window,
    read_rgb,
};

/// A file of the reference data. `None`, with a printed line, where it is absent.
fn data(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/room").join(name);
    let exists = path.exists();
    if !exists {
        println!("skipped: no {}", path.display());
    }
    exists.then_some(path)
}

fn check(window: Window, opening: Opening, bounces: u32, reference: &str) {
    let (Some(sky), Some(reference)) = (data("sky.exr"), data(reference)) else { return };
    let sky = Sky::read(&sky).unwrap();
    let reference = Reference::exact(read_rgb(&reference).unwrap());
    let camera = Camera::scaled(1);
    let room = Room::new(window, opening);
    let lighting = Lighting::new(&room, &sky).unwrap();
    let scene = Scene::new(room);
    let spp: u32 = std::env::var("SPP").map_or(64, |s| s.parse().unwrap());
    let mean = reference.image().mean();
    println!("{window:?} {opening:?} bounces {bounces}: reference mean {mean}");
    for strategy in [Strategy::Environment, Strategy::EnvironmentAndPortals] {
        for spp in [spp / 16, spp / 4, spp] {
            let tracer = PathTracer { scene: &scene, sky: &sky, lighting: &lighting, strategy, bounces };
            let (film, seconds) = Progressive { tracer, camera, seed: 7 + spp }.render(Budget::Samples(spp), |_| ());
            let image = film.image();
            let own = Reference::from_film(&film);
            println!(
                "  {strategy:?} spp {spp} {seconds:.2} s: mean/ref-1 {:.5}, relMSE {:.3e}, x spp {:.3}; by own variance {:.3e}",
                image.mean() / mean - 1.0,
                reference.rel_mse(&image),
                reference.rel_mse(&image) * f64::from(spp),
                own.noise(),
            );
        }
    }
}

#[test]
fn all() {
    check(Window::Rect, Opening::Hole, 1, "reference_a_2.exr");
    check(Window::Rect, Opening::Hole, 5, "reference_a_6.exr");
    check(Window::Star, Opening::Hole, 1, "reference_b_2.exr");
    check(Window::Rect, Opening::Clip, 1, "reference_a_2.exr");
    check(Window::Star, Opening::Clip, 1, "reference_b_2.exr");
}
