//! How noisy, how fast and how large the crate's sampling is, next to other methods on the same workloads.
//!
//! `cargo bench -p fanlight-benches --bench quality` prints one row for each workload, method and class of shading
//! points; `-- --quick` takes less than a minute. `-- --stratification`, `--splitting`, `--lobes`, `--terms`,
//! `--harmonics` and `--room` run a study instead, and `--everything` all of them after the table.
//!
//! Some workloads can be handed to a method in two ways: openings as holes or as a clip map, a clip map that is read
//! with one filter or another. The light is the same, so it is the same workload, and the second way is part of the
//! method's name: `fanlight` samples the holes of `grid-100`, `fanlight@clip-map` one quad with a clip map.

mod args;
mod building;
mod comparison;
mod fairness;
mod harmonics;
#[path = "../instruction_set.rs"]
mod instruction_set;
mod methods;
mod metrics;
mod mixed;
mod oracle;
mod parallel;
mod plot;
mod report;
mod scenes;
mod studies;
mod timing;
mod variance;

use std::process::ExitCode;

use args::{Args, Part};
use report::Row;

type Failure = Box<dyn core::error::Error>;

fn main() -> ExitCode {
    // Paths on the command line are relative to the root of the repository, wherever cargo starts a benchmark.
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
    let args = std::env::set_current_dir(root).map_err(|error| error.to_string()).and_then(|()| Args::parse());
    match args.map_err(Failure::from).and_then(|args| run(&args)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn run(args: &Args) -> Result<(), Failure> {
    let mut objects = vec![];
    let outcome = args.parts.iter().try_for_each(|part| run_part(args, part, &mut objects));
    if let (Some(path), false) = (&args.json, objects.is_empty()) {
        std::fs::write(path, report::json(&objects))?;
    }
    outcome
}

/// One part, which adds its rows to those for the file.
fn run_part(args: &Args, part: &Part, objects: &mut Vec<String>) -> Result<(), Failure> {
    match part {
        Part::Table => table(args, objects)?,
        Part::Stratification => studies::stratification::run(args)?,
        Part::Splitting => studies::splitting::run(args),
        Part::Lobes => objects.extend(studies::lobes::run(args).iter().map(report::lobe_object)),
        Part::Room => studies::room::run(args)?,
        Part::Terms => studies::terms::run(&args.effort),
        Part::Harmonics => studies::harmonics::run(&args.effort),
    }
    Ok(())
}

/// All selected workloads and methods.
fn table(args: &Args, objects: &mut Vec<String>) -> Result<(), Failure> {
    report::print_head();
    let mut rows: Vec<Row> = scenes::NAMES.iter().flat_map(|name| comparison::run(name, args)).collect();
    rows.extend(mixed::run(args));
    rows.extend(building::NAMES.iter().flat_map(|name| building::run(name, args)));
    if rows.is_empty() {
        return Err(format!("no workload and method of these names; workloads are {}", scenes::workloads()).into());
    }
    fairness::print(&rows);
    objects.extend(rows.iter().map(report::object));
    if let Some(directory) = &args.plots {
        let is_drawn = |row: &&Row| !building::NAMES.contains(&row.workload.as_str());
        plot::scatter::draw(directory, &rows.iter().filter(is_drawn).cloned().collect::<Vec<_>>())?;
    }
    report::check_nothing_is_lost(&rows)
}
