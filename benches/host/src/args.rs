//! Command line.

use std::env;
use std::path::{Path, PathBuf};

use fanlight_gallery::plain::Outside;
use lexopt::prelude::*;

use crate::Error;
use crate::scene::Surroundings;

const USAGE: &str = "\
cargo bench -p fanlight-host --bench host -- [OPTIONS]

  --scene NAME    only this scene; may be repeated
  --file PATH     a glTF file in place of the scenes; may be repeated
  --env FILE      what lights files from outside: a .hdr or .exr image, `none`, or `night`, the sky of night-room
                  (a clear sky with a sun without it)
  --panes PREFIX  materials of files whose names start with this are openings, in place of those called `window`
  --bounces N     only this number of surfaces that light touches (1 and 5 without it); may be repeated
  --seeds N       images of each method (8; 4 with --quick)
  --seconds S     CPU time of each image (3; 0.1 with --quick)
  --reference S   CPU time of each reference that is rendered (64 times that of an image, and never less)
  --by-variance   errors by the variance of the images' own samples, for images with less noise than a reference
  --visibility    in all scenes fanlight also learns what walls hide, not only where there are walls
  --threads N     threads that compute references (all cores); the measurement runs on one
  --quick         a few scenes that need no data, in less than two minutes
  --validate      compares with the references of another renderer instead
  --data DIR      environments and references (FANLIGHT_DATA, or ../shared/data next to the repository)
  --json FILE     writes the figures
  --figure FILE   draws error against time of all scenes, .svg
  --picture DIR   writes one image of each method";

/// What the user asks for.
#[derive(Clone, Debug)]
pub(crate) struct Args {
    pub(crate) scenes: Vec<String>,
    pub(crate) files: Vec<PathBuf>,
    pub(crate) environment: Option<PathBuf>,
    pub(crate) panes: Option<String>,
    pub(crate) bounces: Vec<u32>,
    pub(crate) seeds: u32,
    /// CPU time of an image.
    pub(crate) seconds: f64,
    /// CPU time of a reference, if not the least.
    pub(crate) reference: f64,
    /// Whether errors are those that the variance of an image's own samples predicts.
    pub(crate) by_variance: bool,
    /// Whether what walls hide is learned in all scenes.
    pub(crate) visibility: bool,
    pub(crate) threads: usize,
    pub(crate) quick: bool,
    pub(crate) validate: bool,
    pub(crate) data: PathBuf,
    pub(crate) json: Option<PathBuf>,
    pub(crate) figure: Option<PathBuf>,
    pub(crate) picture: Option<PathBuf>,
}

impl Args {
    /// Reads the command line. `None` if only help is requested.
    pub(crate) fn parse() -> Result<Option<Self>, Error> {
        let (mut seeds, mut seconds) = (None, None);
        let repository = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let mut args = Self {
            scenes: Vec::new(),
            files: Vec::new(),
            environment: None,
            panes: None,
            bounces: Vec::new(),
            seeds: 0,
            seconds: 0.0,
            reference: 0.0,
            by_variance: false,
            visibility: false,
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            quick: false,
            validate: false,
            data: env::var_os("FANLIGHT_DATA").map_or_else(|| repository.join("../shared/data"), PathBuf::from),
            json: None,
            figure: None,
            picture: None,
        };
        let mut parser = lexopt::Parser::from_env();
        while let Some(word) = parser.next()? {
            match word {
                Long("scene") => args.scenes.push(parser.value()?.string()?),
                Long("file") => args.files.push(parser.value()?.into()),
                Long("env") => args.environment = Some(parser.value()?.into()),
                Long("panes") => args.panes = Some(parser.value()?.string()?),
                Long("bounces") => args.bounces.push(parser.value()?.parse()?),
                Long("seeds") => seeds = Some(parser.value()?.parse()?),
                Long("seconds") => seconds = Some(parser.value()?.parse()?),
                Long("reference") => args.reference = parser.value()?.parse()?,
                Long("by-variance") => args.by_variance = true,
                Long("visibility") => args.visibility = true,
                Long("threads") => args.threads = parser.value()?.parse()?,
                Long("quick") => args.quick = true,
                Long("validate") => args.validate = true,
                Long("data") => args.data = parser.value()?.into(),
                Long("json") => args.json = Some(parser.value()?.into()),
                Long("figure") => args.figure = Some(parser.value()?.into()),
                Long("picture") => args.picture = Some(parser.value()?.into()),
                // Cargo adds it.
                Long("bench") => {}
                Short('h') | Long("help") => {
                    println!("{USAGE}");
                    return Ok(None);
                }
                _ => return Err(format!("{}\n\n{USAGE}", word.unexpected()).into()),
            }
        }
        if args.bounces.is_empty() {
            args.bounces = vec![1, 5];
        }
        args.seeds = seeds.unwrap_or(if args.quick { 4 } else { 8 });
        args.seconds = seconds.unwrap_or(if args.quick { 0.1 } else { 3.0 });
        if args.seeds == 0
            || args.threads == 0
            || args.seconds.is_nan()
            || args.seconds <= 0.0
            || args.bounces.contains(&0)
        {
            return Err(format!("all numbers have to be positive\n\n{USAGE}").into());
        }
        Ok(Some(args))
    }

    /// Returns what lights files from outside.
    pub(crate) fn surroundings(&self) -> Surroundings<'_> {
        match &self.environment {
            None => Surroundings::Of(Outside::Daylight),
            Some(path) if path.as_os_str() == "none" => Surroundings::Of(Outside::Dark),
            Some(path) if path.as_os_str() == "night" => Surroundings::Night,
            Some(path) => Surroundings::Of(Outside::Image(path)),
        }
    }
}
