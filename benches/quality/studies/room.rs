//! Error against time of images: the example's room, without and with portal sampling.

#[expect(dead_code, unused_imports, reason = "the example uses the rest")]
#[path = "../../../examples/room/render/mod.rs"]
mod render;

use render::{Budget, Camera, Daylight, Film, Opening, PathTracer, Progressive, Reference, Strategy, Window, World};

use crate::Failure;
use crate::args::{Args, Effort};
use crate::plot::panels::{Panel, Panels, Series, Style};
use crate::report::short;

/// Walls that light touches.
const BOUNCES: [u32; 2] = [1, 5];
const WINDOWS: [(&str, Window); 2] = [("rectangle", Window::Rect), ("star", Window::Star)];
const STRATEGIES: [(&str, Strategy); 2] = [
    ("cosine + environment", Strategy::Environment),
    ("cosine + environment + portals", Strategy::EnvironmentAndPortals),
];
/// How many times as long as the last image the reference is rendered.
const REFERENCE: f64 = 4.0;

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    println!("\nImages: relative mean squared error, and its product with the seconds");
    println!(
        "{:10} {:>7} {:32} {:>8} {:>6} {:>9} {:>9}",
        "window", "bounces", "sampling", "seconds", "spp", "relMSE", "x s"
    );
    let mut panels = vec![];
    for bounces in BOUNCES {
        for (name, window) in WINDOWS {
            let world = World::new(window, Opening::Hole, Daylight::new().draw()).map_err(|e| e.to_string())?;
            let title = format!("{name}, {}", if bounces == 1 { "direct light" } else { "five bounces" });
            panels.push(Panel { title, series: curves(&world, name, bounces, &args.effort) });
        }
    }
    if let Some(directory) = &args.plots {
        let names = STRATEGIES.map(|(name, _)| name.to_owned()).to_vec();
        let labels = ["seconds", "relative mean squared error"];
        let panels = Panels { panels, columns: 2, labels, style: Style::Lines, names, open: "" };
        panels.draw(&directory.join("room.svg"))?;
    }
    Ok(())
}

/// One curve for each strategy.
fn curves(world: &World, window: &str, bounces: u32, effort: &Effort) -> Vec<Series> {
    let render = |strategy: Strategy, seed: u32, seconds: f64| -> (Film, f64) {
        let tracer = PathTracer::new(world, strategy, bounces);
        Progressive { tracer, camera: Camera::scaled(1), seed }.render(Budget::Seconds(seconds), |_| ())
    };
    let reference = render(Strategy::EnvironmentAndPortals, u32::MAX, REFERENCE * effort.seconds).0;
    let reference = Reference::from_film(&reference);
    let empty = |name: &str| Series { name: name.to_owned(), open: false, marks: vec![] };
    let mut series = STRATEGIES.map(|(name, _)| empty(name));
    // Alternately, so that both have the machine to themselves as much.
    for i in (0..effort.images).rev() {
        for ((name, strategy), series) in STRATEGIES.into_iter().zip(&mut series) {
            let (film, seconds) = render(strategy, i + 1, effort.seconds * 0.5_f64.powi(i as i32));
            let error = reference.rel_mse(&film.image());
            let [at, spp, cost] = [seconds, f64::from(film.samples()), error * seconds].map(short);
            println!("{window:10} {bounces:>7} {name:32} {at:>8} {spp:>6} {:>9} {cost:>9}", short(error));
            series.marks.push((seconds, error));
        }
    }
    series.into()
}
