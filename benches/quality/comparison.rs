//! All methods on one workload: built, timed, measured.

use std::time::Instant;

use fanlight::ShadingPoint;

use crate::args::{Args, Effort};
use crate::methods::{self, Method};
use crate::metrics::{self, Selection};
use crate::oracle::{Class, Oracle, Truth};
use crate::parallel::parallel;
use crate::report::{self, Row};
use crate::scenes::{self, Scene};
use crate::timing;
use crate::variance::{Estimator, Measured};

/// Runs all selected methods on a workload, and prints their rows.
pub(crate) fn run(name: &str, args: &Args) -> Vec<Row> {
    let (workload, variant) = scenes::workload_and_variant(name);
    if !args.wants(workload) {
        return vec![];
    }
    let is_wanted = |method: &&str| args.wants_method(method, variant) && !(args.quick && *method == "tessellated");
    let on_request = methods::ON_REQUEST.iter().filter(|method| args.methods.iter().any(|name| name == *method));
    let names: Vec<&str> = methods::names(name).iter().chain(on_request).copied().filter(is_wanted).collect();
    if names.is_empty() {
        return vec![];
    }
    let scene = scenes::scene(name);
    let points = truths(&scene, args.effort.points);
    let (built, build_ms): (Vec<_>, Vec<_>) = names.iter().map(|name| build(name, &scene)).unzip();
    let times = timing::time(&scene, &built, &args.effort);
    let classes: &[&str] = if scene.sky.is_some() { &["all", "no-sun", "sun", "below"] } else { &["all"] };
    let mut rows = vec![];
    for (i, method) in built.iter().enumerate() {
        let results = Results::new(&scene, method.as_ref(), &points, &args.effort);
        let named = |row| Row {
            workload: workload.to_owned(),
            method: variant.map_or_else(|| names[i].to_owned(), |variant| format!("{}@{variant}", names[i])),
            nanoseconds: times[i],
            bytes: method.bytes(),
            build_ms: build_ms[i],
            ..row
        };
        let of_method: Vec<Row> = classes.iter().filter_map(|class| results.row(class).map(named)).collect();
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
pub(crate) fn truths(scene: &Scene, count: usize) -> Vec<(ShadingPoint, Truth)> {
    let oracle = Oracle::new(scene);
    let points = scene.points.quality(count);
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
        let relvar = metrics::summarize(&self.measured, wanted);
        let selection = metrics::summarize_selection(&self.selections, wanted);
        if relvar.is_none() && selection.is_none() {
            return None;
        }
        Some(Row {
            workload: String::new(),
            method: String::new(),
            class,
            points: if self.measured.is_empty() {
                self.selections.iter().filter(|point| wanted(point.class)).count()
            } else {
                self.measured.iter().filter(|point| wanted(point.class)).count()
            },
            relvar: relvar.map(|(summary, ..)| summary),
            selection: selection.map(|(summary, _)| summary),
            lost: [relvar.map(|(.., lost)| lost), selection.map(|(_, lost)| lost)]
                .into_iter()
                .flatten()
                .reduce(f64::max),
            zero_rate: relvar.map(|(_, zeros, _)| zeros),
            nanoseconds: timing::Nanoseconds { lit: 0.0, all: 0.0, pdf: 0.0 },
            bytes: 0,
            build_ms: 0.0,
            reach: None,
            rays_learned: None,
        })
    }
}
