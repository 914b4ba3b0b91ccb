//! The command line.

use std::path::PathBuf;

use lexopt::prelude::*;

use crate::render::{Budget, Error, Opening, Window};

/// What `--help` prints.
pub(crate) const HELP: &str = "\
Renders a room that daylight enters through a window, twice in the same time: (a) with cosine and environment
sampling, and (b) with portal sampling as well. Prints the errors and writes both images side by side.

Usage: cargo run --release --example room -- [OPTIONS]

Scene:
  --window rect|star|lattice  shape of the window [rect]
  --opening hole|clip         a hole in the wall, or a card of two triangles with a clip map [hole]
  --env FILE                  latitude-longitude environment, .hdr or .exr [an analytic clear sky with a sun]
  --bounces N                 walls that light may touch on its way, 1 for direct light alone [1]

Rendering:
  --seconds S                 time for each of the two images; their reference takes four times that [7]
  --spp N                     samples a pixel instead of a time
  --scale N                   image of N x 96 by N x 72 pixels [3, or the reference's]
  --seed N                    which random numbers are used [1]
  --reference FILE            .exr to compare with, instead of rendering one

Output:
  --output FILE               a on the left and b on the right, .png [room.png]
  --exr FILE                  b alone in linear RGB, .exr
";

/// What the command line requests.
pub(crate) struct Arguments {
    pub(crate) window: Window,
    pub(crate) opening: Opening,
    pub(crate) environment: Option<PathBuf>,
    pub(crate) bounces: u32,
    pub(crate) budget: Budget,
    pub(crate) scale: Option<u32>,
    pub(crate) seed: u32,
    pub(crate) reference: Option<PathBuf>,
    pub(crate) output: PathBuf,
    pub(crate) exr: Option<PathBuf>,
}

impl Default for Arguments {
    fn default() -> Self {
        Self {
            window: Window::Rect,
            opening: Opening::Hole,
            environment: None,
            bounces: 1,
            budget: Budget::Seconds(7.0),
            scale: None,
            seed: 1,
            reference: None,
            output: PathBuf::from("room.png"),
            exr: None,
        }
    }
}

impl Arguments {
    /// Reads the program's arguments. `None` if help was requested.
    pub(crate) fn parse() -> Result<Option<Self>, Error> {
        let mut arguments = Self::default();
        let mut parser = lexopt::Parser::from_env();
        while let Some(argument) = parser.next()? {
            match argument {
                Short('h') | Long("help") => return Ok(None),
                Long("window") => arguments.window = parser.value()?.parse_with(window)?,
                Long("opening") => arguments.opening = parser.value()?.parse_with(opening)?,
                Long("env") => arguments.environment = Some(parser.value()?.into()),
                Long("bounces") => arguments.bounces = parser.value()?.parse_with(positive)?,
                Long("seconds") => arguments.budget = Budget::Seconds(parser.value()?.parse_with(duration)?),
                Long("spp") => arguments.budget = Budget::Samples(parser.value()?.parse_with(positive)?),
                Long("scale") => arguments.scale = Some(parser.value()?.parse_with(scale)?),
                Long("seed") => arguments.seed = parser.value()?.parse()?,
                Long("reference") => arguments.reference = Some(parser.value()?.into()),
                Long("output") => arguments.output = parser.value()?.into(),
                Long("exr") => arguments.exr = Some(parser.value()?.into()),
                _ => return Err(argument.unexpected().into()),
            }
        }
        Ok(Some(arguments))
    }
}

fn window(name: &str) -> Result<Window, &'static str> {
    match name {
        "rect" => Ok(Window::Rect),
        "star" => Ok(Window::Star),
        "lattice" => Ok(Window::Lattice),
        _ => Err("windows are rect, star and lattice"),
    }
}

fn opening(name: &str) -> Result<Opening, &'static str> {
    match name {
        "hole" => Ok(Opening::Hole),
        "clip" => Ok(Opening::Clip),
        _ => Err("openings are hole and clip"),
    }
}

fn positive(number: &str) -> Result<u32, &'static str> {
    number.parse().ok().filter(|&number| number > 0).ok_or("not a whole number above zero")
}

fn scale(number: &str) -> Result<u32, &'static str> {
    number.parse().ok().filter(|scale| (1..=100).contains(scale)).ok_or("not a whole number from 1 to 100")
}

fn duration(number: &str) -> Result<f64, &'static str> {
    number.parse().ok().filter(|&seconds: &f64| seconds.is_finite() && seconds > 0.0).ok_or("not a time in seconds")
}
