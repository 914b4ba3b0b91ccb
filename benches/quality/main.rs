//! How noisy, how fast and how large the crate's sampling is, next to other methods on the same workloads.
//!
//! `cargo bench --bench quality` prints one row for each workload, method and class of shading points;
//! `-- --quick` takes less than a minute.

mod args;
mod methods;
mod metrics;
mod oracle;
mod plot;
mod report;
mod scenes;
mod terms;
mod timing;
mod variance;

use core::num::NonZero;
use std::process::ExitCode;
use std::time::Instant;

use fanlight::ShadingPoint;

use args::{Args, Effort};
use methods::Method;
use metrics::Selection;
use oracle::{Class, Oracle, Truth};
use report::Row;
use scenes::Scene;
use variance::{Estimator, Measured};

fn main() -> ExitCode {
    if std::env::args().any(|word| word == "--terms") {
        return terms::run();
    }
    let args = match Args::parse() {
        Ok(args) => args,
        Err(message) => {
            eprintln!("{message}");
            return ExitCode::FAILURE;
        }
    };
    report::print_head();
    let workloads = scenes::NAMES.iter().filter(|workload| args.wants(workload));
    let rows: Vec<Row> = workloads.flat_map(|workload| run(workload, &args)).collect();
    if rows.is_empty() {
        eprintln!("no workload and method of these names; workloads are {}", scenes::NAMES.join(", "));
        return ExitCode::FAILURE;
    }
    match write(&args, &rows) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

/// Writes the files that were asked for.
fn write(args: &Args, rows: &[Row]) -> Result<(), Box<dyn core::error::Error>> {
    if let Some(path) = &args.json {
        std::fs::write(path, report::json(rows))?;
    }
    if let Some(directory) = &args.plots {
        plot::draw(directory, rows)?;
    }
    Ok(())
}

/// Runs all methods of a workload, and prints their rows.
fn run(workload: &str, args: &Args) -> Vec<Row> {
    let names = args.methods(methods::names(workload));
    if names.is_empty() {
        return vec![];
    }
    let scene = scenes::scene(workload);
    let points = truths(&scene, &args.effort);
    let (built, build_ms): (Vec<_>, Vec<_>) = names.iter().map(|name| build(name, &scene)).unzip();
    let times = timing::time(&scene, &built, &args.effort);
    let mut rows = vec![];
    for (i, method) in built.iter().enumerate() {
        let results = Results::new(&scene, method.as_ref(), &points, &args.effort);
        let row = |class| {
            results.row(class).map(|row| Row {
                workload: workload.to_owned(),
                method: names[i].to_owned(),
                nanoseconds: times[i],
                bytes: method.bytes(),
                build_ms: build_ms[i],
                ..row
            })
        };
        let classes: &[&str] = if scene.sky.is_some() { &["all", "no-sun", "sun", "below"] } else { &["all"] };
        let of_method: Vec<Row> = classes.iter().filter_map(|class| row(class)).collect();
        of_method.iter().for_each(report::print);
        rows.extend(of_method);
    }
    rows
}

/// A method, and the milliseconds that it took to build.
fn build<'a>(name: &str, scene: &'a Scene) -> (Box<dyn Method + 'a>, f64) {
    let start = Instant::now();
    let method = methods::build(name, scene);
    (method, start.elapsed().as_secs_f64() * 1e3)
}

/// The points of a workload that light arrives at.
fn truths(scene: &Scene, effort: &Effort) -> Vec<(ShadingPoint, Truth)> {
    let oracle = Oracle::new(scene);
    let points = scene.points.quality(effort.points);
    let truths = parallel(&points, |_, x| (*x, oracle.truth(x)));
    truths.into_iter().filter(|(_, truth)| truth.total > 0.0).collect()
}

/// What was found at all points.
struct Results {
    measured: Vec<Measured>,
    selections: Vec<Selection>,
}

impl Results {
    fn new(scene: &Scene, method: &dyn Method, points: &[(ShadingPoint, Truth)], effort: &Effort) -> Self {
        let openings = scene.sky.as_ref().map(|_| methods::build("uniform-solid-angle", scene));
        let estimator = Estimator { scene, method, openings: openings.as_deref() };
        let measure =
            |i: usize, (x, truth): &(ShadingPoint, Truth)| estimator.measure(x, truth, effort.samples, i as u64);
        let measured = if method.is_slow() { vec![] } else { parallel(points, measure) };
        // The points do not depend on the method, so that methods are compared at the same ones.
        let lights = points.first().map_or(1, |(_, truth)| truth.by_light.len());
        let count = points.len().min(effort.choices / lights + 1);
        let is_chosen = lights == scene.lights.len() && lights > 2;
        let selections = if is_chosen {
            parallel(&points[..count], |_, (x, truth)| metrics::select(method, x, truth))
                .into_iter()
                .flatten()
                .collect()
        } else {
            vec![]
        };
        Self { measured, selections }
    }

    /// The row of a class, if there are any points of it.
    fn row(&self, class: &'static str) -> Option<Row> {
        let wanted = |of: Class| match class {
            "no-sun" => of == Class::NoSun,
            "sun" => of == Class::Sun,
            "below" => of == Class::Below,
            _ => true,
        };
        let relvar = metrics::summarise(&self.measured, wanted);
        let selection = metrics::summarise_selection(&self.selections, wanted);
        if relvar.is_none() && selection.is_none() {
            return None;
        }
        Some(Row {
            workload: String::new(),
            method: String::new(),
            class,
            relvar: relvar.map(|(summary, _)| summary),
            selection: selection.map(|(summary, _)| summary),
            lost: selection.map(|(_, lost)| lost),
            zero_rate: relvar.map(|(_, zeros)| zeros),
            nanoseconds: timing::Nanoseconds { sample: 0.0, pdf: 0.0 },
            bytes: 0,
            build_ms: 0.0,
        })
    }
}

/// Maps items, each with its number, on all processors. The order stays.
fn parallel<T: Sync, R: Send>(items: &[T], map: impl Fn(usize, &T) -> R + Sync) -> Vec<R> {
    let threads = std::thread::available_parallelism().map_or(1, NonZero::get);
    // Small blocks by turns, as neighbouring items can be as costly.
    let share = |thread: usize| -> Vec<(usize, R)> {
        (thread..items.len()).step_by(threads).map(|i| (i, map(i, &items[i]))).collect()
    };
    let mut results: Vec<(usize, R)> = std::thread::scope(|scope| {
        let handles: Vec<_> = (0..threads)
            .map(|thread| {
                scope.spawn({
                    let share = &share;
                    move || share(thread)
                })
            })
            .collect();
        handles.into_iter().flat_map(|handle| handle.join().expect("no measurement panics")).collect()
    });
    results.sort_by_key(|(i, _)| *i);
    results.into_iter().map(|(_, result)| result).collect()
}
