//! The command line.

use std::path::PathBuf;

use glam::Vec3;
use lexopt::prelude::*;

use crate::render::{Budget, Error};

/// What `--help` prints.
pub(crate) const HELP: &str = "\
Renders scenes without and with fanlight in the same time, and prints their errors against a long reference.

Usage: cargo run --release -p fanlight-gallery -- NAME | all | contact | FILE.gltf | FILE.glb | export DIR [OPTIONS]

  NAME             room, car, lantern, letters, pinhole, facade, nested, neon, fog, street, town or glossy
  all              all of them, and a contact sheet
  contact          the contact sheet alone, of the pictures that are in the folder
  FILE             a glTF scene; --bounces, --camera, --env and --size say what it does not
  export DIR       writes all built-in scenes as glTF

Options:
  --seconds S             processor time for each image; their reference takes four times that of all [5]
  --images N              images of each kind, with other random numbers; several give intervals of 95 % [1]
  --spp N                 samples a pixel instead of a time
  --size WxH              pixels of an image [208x156]
  --seed N                which random numbers are used [1]
  --output PATH           folder for the pictures [docs/gallery], or for a FILE the .png [FILE.png]
  --exr PATH              the last image that is rendered with fanlight in linear RGB, .exr

For a FILE:
  --list                  print what the file holds, and what became a light or a portal; render nothing
  --portal-prefix PREFIX  meshes whose material's name starts with it are portals, in capitals or not [window]
  --camera X,Y,Z,X,Y,Z    where to look from and what at, with 60 degrees from bottom to top [the file's own]
  --panes PREFIX          materials whose name starts with it are clear panes, whatever the file says
  --env FILE              latitude-longitude environment, .hdr or .exr, or `none` [a clear sky with a sun]
  --bounces N,...         surfaces that light may touch on its way; a table for each number [5]
";

/// What is to be done.
pub(crate) enum Task {
    Scene(String),
    All,
    Contact,
    File(PathBuf),
    Export(PathBuf),
}

/// What the command line requests.
pub(crate) struct Arguments {
    pub(crate) task: Task,
    pub(crate) budget: Budget,
    pub(crate) size: Option<[u32; 2]>,
    pub(crate) seed: u32,
    pub(crate) images: u32,
    pub(crate) output: Option<PathBuf>,
    pub(crate) exr: Option<PathBuf>,
    pub(crate) lists: bool,
    pub(crate) portal_prefix: String,
    pub(crate) panes: Option<String>,
    pub(crate) camera: Option<[Vec3; 2]>,
    pub(crate) environment: Option<PathBuf>,
    pub(crate) bounces: Vec<u32>,
}

impl Arguments {
    /// Reads the program's arguments. `None` if help was requested.
    pub(crate) fn parse() -> Result<Option<Self>, Error> {
        let mut arguments = Self {
            task: Task::All,
            budget: Budget::Seconds(5.0),
            size: None,
            seed: 1,
            images: 1,
            output: None,
            exr: None,
            lists: false,
            portal_prefix: "window".to_owned(),
            panes: None,
            camera: None,
            environment: None,
            bounces: vec![5],
        };
        let mut task = None;
        let mut parser = lexopt::Parser::from_env();
        while let Some(argument) = parser.next()? {
            match argument {
                Short('h') | Long("help") => return Ok(None),
                Value(word) if task.is_none() => {
                    task = Some(match word.to_str() {
                        Some("all") => Task::All,
                        Some("contact") => Task::Contact,
                        Some("export") => Task::Export(parser.value()?.into()),
                        Some(name) if !name.contains(['.', '/', '\\']) => Task::Scene(name.to_owned()),
                        _ => Task::File(word.into()),
                    });
                }
                Long("seconds") => arguments.budget = Budget::Seconds(parser.value()?.parse_with(duration)?),
                Long("spp") => arguments.budget = Budget::Samples(parser.value()?.parse_with(positive)?),
                Long("size") => arguments.size = Some(parser.value()?.parse_with(size)?),
                Long("images") => arguments.images = parser.value()?.parse_with(positive)?,
                Long("seed") => arguments.seed = parser.value()?.parse()?,
                Long("output") => arguments.output = Some(parser.value()?.into()),
                Long("exr") => arguments.exr = Some(parser.value()?.into()),
                Long("list") => arguments.lists = true,
                Long("portal-prefix") => arguments.portal_prefix = parser.value()?.string()?,
                Long("panes") => arguments.panes = Some(parser.value()?.string()?),
                Long("camera") => arguments.camera = Some(parser.value()?.parse_with(two_points)?),
                Long("env") => arguments.environment = Some(parser.value()?.into()),
                Long("bounces") => arguments.bounces = parser.value()?.parse_with(numbers)?,
                _ => return Err(argument.unexpected().into()),
            }
        }
        arguments.task = task.ok_or("say what to render: a scene's name, `all`, or a glTF file")?;
        Ok(Some(arguments))
    }
}

fn positive(number: &str) -> Result<u32, &'static str> {
    number.parse().ok().filter(|&number| number > 0).ok_or("not a whole number above zero")
}

fn two_points(list: &str) -> Result<[Vec3; 2], &'static str> {
    let numbers: Vec<f32> = list.split(',').map_while(|number| number.trim().parse().ok()).collect();
    match numbers[..] {
        [a, b, c, d, e, f] if numbers.iter().all(|number| number.is_finite()) => {
            Ok([Vec3::new(a, b, c), Vec3::new(d, e, f)])
        }
        _ => Err("not six numbers with commas between them"),
    }
}

fn numbers(list: &str) -> Result<Vec<u32>, &'static str> {
    list.split(',').map(positive).collect()
}

fn size(text: &str) -> Result<[u32; 2], &'static str> {
    let side = |side: &str| side.parse().ok().filter(|side| (48..=8192).contains(side));
    let sides = text.split_once('x').and_then(|(width, height)| Some([side(width)?, side(height)?]));
    sides.ok_or("not a size such as 640x480, with sides from 48 to 8192")
}

fn duration(number: &str) -> Result<f64, &'static str> {
    number.parse().ok().filter(|&seconds: &f64| seconds.is_finite() && seconds > 0.0).ok_or("not a time in seconds")
}
