//! Renders a room that daylight enters through a window, without and with portal sampling, in the same time.
//!
//! `cargo run --release --example room -- --help` lists what can be asked for. The renderer is in [`render`]; what it
//! takes to give it `fanlight`'s samplers is in `render/lighting.rs`.

mod arguments;
mod picture;
mod render;
mod table;

use std::process::ExitCode;

use arguments::Arguments;
use indicatif::{ProgressBar, ProgressStyle};
use render::{
    Budget, Camera, Daylight, Error, Film, Lighting, PathTracer, Progressive, Reference, Room, Scene, Sky, Strategy,
    read_rgb, write_rgb,
};
use table::Row;

/// How many times as long as an image its reference is rendered.
const REFERENCE_FACTOR: u32 = 4;

fn main() -> ExitCode {
    let result = match Arguments::parse() {
        Ok(Some(arguments)) => run(&arguments),
        Ok(None) => {
            print!("{}", arguments::HELP);
            Ok(())
        }
        Err(error) => Err(format!("{error} (--help lists the options)").into()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), Error> {
    let given = arguments.reference.as_deref().map(read_rgb).transpose()?;
    let camera = Camera::scaled(match &given {
        Some(image) => scale_of(image, arguments.scale)?,
        None => arguments.scale.unwrap_or(3),
    });
    let sky = match &arguments.environment {
        Some(path) => Sky::read(path)?,
        None => Daylight::new().draw(),
    };
    let room = Room::new(arguments.window, arguments.opening);
    let lighting = Lighting::new(&room, &sky)?;
    let scene = Scene::new(room);

    let render = |name: &str, strategy: Strategy, seed: u32, budget: Budget| {
        let tracer = PathTracer { scene: &scene, sky: &sky, lighting: &lighting, strategy, bounces: arguments.bounces };
        with_progress_bar(name, &Progressive { tracer, camera, seed }, budget)
    };
    let seed = arguments.seed;
    let (without, without_seconds) = render("without portals", Strategy::Environment, seed, arguments.budget);
    let (with, with_seconds) = render("with portals", Strategy::EnvironmentAndPortals, seed, arguments.budget);
    let reference = match given {
        Some(image) => Reference::exact(image),
        None => {
            let budget = arguments.budget.times(REFERENCE_FACTOR);
            Reference::from_film(&render("reference", Strategy::EnvironmentAndPortals, !seed, budget).0)
        }
    };

    let rows = [
        Row { name: "a  cosine + environment", film: &without, seconds: without_seconds },
        Row { name: "b  cosine + environment + portals", film: &with, seconds: with_seconds },
    ];
    table::print(&rows, &reference);
    picture::write(&arguments.output, &[&without.image(), &with.image()], reference.image())?;
    println!("{} shows a on the left and b on the right.", arguments.output.display());
    match &arguments.exr {
        Some(path) => write_rgb(path, &with.image()),
        None => Ok(()),
    }
}

/// The camera's scale that gives images of a reference's size, unless another one was asked for.
fn scale_of(reference: &render::Image, asked: Option<u32>) -> Result<u32, Error> {
    let (width, height) = (reference.width, reference.height);
    let scale = Camera::scale_of(width, height)
        .ok_or_else(|| format!("the reference has {width} x {height} pixels, not a multiple of 96 x 72"))?;
    match asked {
        Some(asked) if asked != scale => Err(format!("the reference is of scale {scale}, not {asked}").into()),
        _ => Ok(scale),
    }
}

/// Renders, with a bar that moves where standard error is a terminal.
fn with_progress_bar(name: &str, progressive: &Progressive<'_>, budget: Budget) -> (Film, f64) {
    const STEPS: f64 = 1000.0;
    let bar = ProgressBar::new(STEPS as u64).with_message(name.to_owned());
    if let Ok(style) = ProgressStyle::with_template("{msg:16} {wide_bar} {elapsed:>4}") {
        bar.set_style(style);
    }
    let result = progressive.render(budget, |spent| bar.set_position((STEPS * spent) as u64));
    bar.finish_and_clear();
    result
}
