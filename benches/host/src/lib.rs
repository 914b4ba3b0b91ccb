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

use args::Args;
use report::{Report, Row};
use scene::{Data, ENTRIES, Entry};
use world::World;

type Error = Box<dyn core::error::Error + Send + Sync>;

/// Runs what the command line asks for. Returns whether all is well.
///
/// # Errors
///
/// If the command line is not understood, a file cannot be read or written, or a scene is refused by the crate.
pub fn run() -> Result<bool, Error> {
    let Some(args) = Args::parse()? else { return Ok(true) };
    if let Some(unknown) = args.scenes.iter().find(|name| ENTRIES.iter().all(|entry| entry.name != **name)) {
        let names: Vec<_> = ENTRIES.iter().map(|entry| entry.name).collect();
        return Err(format!("there is no scene {unknown}; there are {}", names.join(", ")).into());
    }
    let data = Data::new(args.data.clone());
    let mut report = Report::new(&args);
    let mut all_is_well = true;
    let is_wanted = |entry: &&Entry| match args.scenes.as_slice() {
        [] => !args.quick || entry.quick,
        names => names.iter().any(|name| name == entry.name),
    };
    for entry in ENTRIES.iter().filter(is_wanted) {
        if let Some(file) = entry.needs.map(|file| data.path(file)).filter(|path| !path.exists()) {
            report.skip(entry.name, &file);
            continue;
        }
        let world = World::new((entry.build)(&data)?);
        for &bounces in &args.bounces {
            if args.validate {
                if let Some(reference) = data.reference(entry.name, bounces)? {
                    all_is_well &= validate::validate(entry.name, &world, bounces, &reference, &args)?;
                }
            } else {
                let reference = match data.reference(entry.name, bounces)? {
                    Some(reference) => reference,
                    None => reference::compute(entry.name, &world, bounces, &args)?,
                };
                let rows: Vec<Row> = measure::measure(entry.name, &world, bounces, &reference, &args)?;
                report.add(rows);
            }
        }
    }
    report.finish()?;
    Ok(all_is_well)
}
