//! A plain path tracer that compares `fanlight` with what a renderer has without it.
//!
//! `docs/HOST.md` explains the scenes, the methods and the figures.

mod args;
mod bsdf;
mod camera;
mod clock;
mod cost;
mod error;
mod figure;
mod file;
mod film;
mod geometry;
mod integrator;
mod measure;
mod methods;
mod random;
mod reference;
mod report;
mod scene;
mod sky;
mod statistics;
mod validate;
mod world;

use std::path::Path;

use args::Args;
use report::Report;
use scene::{Data, ENTRIES, Entry};
use world::World;

type Error = Box<dyn core::error::Error + Send + Sync>;

/// Runs what the command line asks for. Returns whether all is well.
///
/// # Errors
///
/// If the command line is not understood, a file cannot be read or written, or a scene is refused by the crate.
pub fn run() -> Result<bool, Error> {
    // Paths on the command line are relative to the root of the repository, wherever cargo starts a benchmark.
    std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))?;
    let Some(args) = Args::parse()? else { return Ok(true) };
    if let Some(unknown) = args.scenes.iter().find(|name| ENTRIES.iter().all(|entry| entry.name != **name)) {
        let names: Vec<_> = ENTRIES.iter().map(|entry| entry.name).collect();
        return Err(format!("there is no scene {unknown}; there are {}", names.join(", ")).into());
    }
    let data = Data::new(args.data.clone());
    let mut report = Report::new(&args);
    let mut all_is_well = true;
    let is_wanted = |entry: &&Entry| match args.scenes.as_slice() {
        [] => args.files.is_empty() && (!args.quick || entry.quick),
        names => names.iter().any(|name| name == entry.name),
    };
    for entry in ENTRIES.iter().filter(is_wanted) {
        if let Some(file) = entry.needs.map(|file| data.path(file)).filter(|path| !path.exists()) {
            report.skip(entry.name, &file);
            continue;
        }
        all_is_well &= compare(entry.name, &World::new((entry.build)(&data)?), &data, &args, &mut report)?;
    }
    for path in &args.files {
        let name = name_of(path);
        let scene = scene::read(path, args.panes.as_deref(), args.surroundings())?;
        all_is_well &= compare(&name, &World::new(scene), &data, &args, &mut report)?;
    }
    report.finish()?;
    Ok(all_is_well)
}

/// Returns what a file is called in the figures: many are called `scene`, and their folders say more.
fn name_of(path: &Path) -> String {
    let parent = || path.parent().and_then(Path::file_name);
    let name = path.file_stem().filter(|name| *name != "scene").or_else(parent);
    name.map_or_else(|| "scene".to_owned(), |name| name.to_string_lossy().into_owned())
}

/// Measures a scene, or compares it with the references of another renderer. Returns whether all is well.
fn compare(name: &str, world: &World, data: &Data, args: &Args, report: &mut Report) -> Result<bool, Error> {
    let mut all_is_well = true;
    for &bounces in &args.bounces {
        if args.validate {
            if let Some(reference) = data.reference(name, bounces)? {
                all_is_well &= validate::validate(name, world, bounces, &reference, args)?;
            }
        } else {
            let reference = match data.reference(name, bounces)? {
                Some(reference) => reference,
                None => reference::compute(name, world, bounces, args)?,
            };
            if reference.noise().is_nan() {
                return Err(format!("{name}: what the camera sees reflects no light").into());
            }
            report.add(measure::measure(name, world, bounces, &reference, args)?);
        }
    }
    Ok(all_is_well)
}
