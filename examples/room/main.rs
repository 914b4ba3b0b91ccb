//! Renders a room that daylight enters through a window, without and with portal sampling, in the same time.
//!
//! `cargo run --release --example room -- --help` lists the options. The renderer is in [`render`]; what it
//! takes to give it `fanlight`'s samplers is in `render/lighting.rs`.

mod arguments;
mod picture;
mod render;
mod start;
mod table;

use std::process::ExitCode;

use arguments::Arguments;
use indicatif::{ProgressBar, ProgressStyle};
use render::{
    Budget, Camera, Daylight, Error, Film, Image, PathTracer, Progressive, Reference, Sky, Strategy, World, read_rgb,
    write_rgb,
};
use table::Row;

/// How many times as long as an image its reference is rendered.
const REFERENCE_FACTOR: u32 = 4;
/// Scale of an image that is not compared with a given reference.
const DEFAULT_SCALE: u32 = 3;

fn main() -> ExitCode {
    start::start(Arguments::parse(), arguments::HELP, run)
}

fn run(arguments: &Arguments) -> Result<(), Error> {
    let given = arguments.reference.as_deref().map(read_rgb).transpose()?;
    let scale = given.as_ref().map(|image| scale_of(image, arguments.scale)).transpose()?;
    let camera = Camera::scaled(scale.or(arguments.scale).unwrap_or(DEFAULT_SCALE));
    let world = World::new(arguments.window, arguments.opening, sky(arguments)?)?;

    let render = |name: &str, strategy: Strategy, seed: u32, budget: Budget| {
        let tracer = PathTracer::new(&world, strategy, arguments.bounces);
        with_progress_bar(name, &Progressive { tracer, camera, seed }, budget)
    };
    let (seed, budget) = (arguments.seed, arguments.budget);
    let (without, without_seconds) = render("without portals", Strategy::Environment, seed, budget);
    let (with, with_seconds) = render("with portals", Strategy::EnvironmentAndPortals, seed, budget);
    let reference = given.map_or_else(
        || {
            let budget = budget.times(REFERENCE_FACTOR);
            Reference::from_film(&render("reference", Strategy::EnvironmentAndPortals, !seed, budget).0)
        },
        Reference::exact,
    );

    let rows = [
        Row { name: "a  cosine + environment", film: &without, seconds: without_seconds },
        Row { name: "b  cosine + environment + portals", film: &with, seconds: with_seconds },
    ];
    let written = write_images(arguments, &without.image(), &with.image(), &reference);
    table::print(&rows, &reference)?;
    written
}

/// The sky that the command line names.
fn sky(arguments: &Arguments) -> Result<Sky, Error> {
    match &arguments.environment {
        Some(path) => Ok(Sky::new(read_rgb(path)?)),
        None => Ok(Daylight::new().draw()),
    }
}

/// Writes both images next to each other and, if requested, the second one in full range.
fn write_images(arguments: &Arguments, a: &Image, b: &Image, reference: &Reference) -> Result<(), Error> {
    picture::write(&arguments.output, &[a, b], reference.image())?;
    match &arguments.exr {
        Some(path) => write_rgb(path, b),
        None => Ok(()),
    }
}

/// The camera's scale that gives images of a reference's size, unless another one was given.
fn scale_of(reference: &Image, asked: Option<u32>) -> Result<u32, Error> {
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
