//! All scenes from all points.

use core::fmt::Write;

use fanlight::{Hit, LightSample, PointSampler, TriangleId};
use glam::Vec3;

use super::columns;
use super::measure::{Effort, Found, describe, measure};
use super::rows::{self, Sizes};
use crate::common::lights::{ARITIES, Point, build};
use crate::common::parallel;

/// Bars of the errors.
const NORMALIZATION: f64 = 1e-4;
const AGREEMENT: f64 = 1e-5;
const IRRADIANCE: f64 = 1e-3;

/// Every arity, with lights of one and of two sides.
const VARIANTS: usize = 2 * ARITIES.len();
const RECEIVERS: usize = 3;
/// A combination that misses a bar is done again with this many times the samples and cells.
const AGAIN: usize = 16;

/// The worst of all receivers and variants.
#[derive(Clone, Default)]
struct Cell {
    found: Vec<Found>,
    agreement: f64,
    samples: usize,
    combinations: usize,
    /// What is above a bar.
    missed: Vec<String>,
}

struct Plan {
    sizes: Sizes,
    /// Effort for the variant whose turn it is.
    whole: Effort,
    /// Effort for all other variants: samples and directions alone.
    others: Option<Effort>,
    /// One receiver a cell, in rotation.
    thin: bool,
    /// Whether the receivers have lobes.
    lobes: bool,
    /// One row in this many.
    step: usize,
}

/// All columns of one row.
fn run(number: usize, plan: &Plan) -> (&'static str, Vec<Cell>) {
    let mut row = rows::row(number, plan.sizes);
    let mut cells = vec![Cell::default(); columns::NAMES.len()];
    let mut repeated = 0;
    for variant in 0..VARIANTS {
        let turn = |column: usize, receiver: usize| match (row.large, &plan.others) {
            (true, _) => {
                (column % 2 == variant && receiver == (column / 2 + variant) % RECEIVERS).then_some(plan.whole)
            }
            _ if plan.thin && receiver != (number + column) % RECEIVERS => None,
            _ if (number + column + 3 * receiver) % VARIANTS == variant => Some(plan.whole),
            (false, others) => *others,
        };
        let all = || (0..cells.len()).flat_map(|column| (0..RECEIVERS).map(move |receiver| (column, receiver)));
        if all().all(|(column, receiver)| turn(column, receiver).is_none()) {
            continue;
        }
        row.scene.meshes.iter_mut().for_each(|mesh| mesh.two_sided = variant % 2 == 1);
        let lights = row.build(ARITIES[variant / 2]);
        for (column, receiver) in all().collect::<Vec<_>>() {
            let Some(effort) = turn(column, receiver) else { continue };
            let x = row.now(columns::point(&row.scene, column, receiver));
            let guide = if plan.lobes { columns::with_lobe(x, number + 3 * column + receiver) } else { x };
            let at = lights.at(&guide);
            let seed = (number * cells.len() + column) as u64;
            let mut found = measure((&row, &lights), &at, [&x, &guide], effort, seed);
            if !found.misses().is_empty() {
                // More samples and cells tell an error from chance.
                let more = Effort { points: AGAIN * effort.points, cells: AGAIN * effort.cells, ..effort };
                found = measure((&row, &lights), &at, [&x, &guide], more, 1000 + seed);
                repeated += 1;
            }
            let context = format!("{} {:?} {variant}", describe(&row, column, &x), ARITIES[variant / 2]);
            cells[column].add(found, effort.points > 0, &context);
        }
    }
    if repeated > 0 {
        println!("{}: {repeated} combinations repeated", row.name);
    }
    (row.name, cells)
}

impl Found {
    /// What is above its bar by more than chance.
    fn misses(&self) -> Vec<&'static str> {
        let allowed = |bar: f64, resolution: f64| bar.max(self.rounding) + resolution;
        let normalization = !self.beyond && self.normalization > allowed(NORMALIZATION, self.normalization_resolution);
        let agreement = self.agreement > AGREEMENT;
        let is_off = |[error, resolution]: [f64; 2]| error > allowed(IRRADIANCE, resolution);
        let irradiance = !self.beyond && self.irradiance.is_some_and(is_off);
        let all = [(normalization, "normalization"), (agreement, "agreement"), (irradiance, "irradiance")];
        all.into_iter().filter(|(misses, _)| *misses).map(|(_, name)| name).collect()
    }
}

impl Cell {
    fn add(&mut self, found: Found, is_whole: bool, context: &str) {
        self.missed.extend(found.misses().iter().map(|what| format!("{context}: {what} {found:?}")));
        // The others tell of their agreement alone.
        self.agreement = self.agreement.max(found.agreement);
        self.samples += found.samples;
        self.combinations += 1;
        if is_whole {
            self.found.push(found);
        }
    }
}

fn run_all(plan: &Plan) -> Vec<(&'static str, Vec<Cell>)> {
    parallel::map(rows::COUNT.div_ceil(plan.step), |number| run(number * plan.step, plan))
}

fn missed(table: &[(&'static str, Vec<Cell>)]) -> Vec<String> {
    table.iter().flat_map(|(_, cells)| cells).flat_map(|cell| cell.missed.clone()).collect()
}

/// A number with one digit.
fn short(value: f64) -> String {
    if value == 0.0 { "0".into() } else { format!("{value:.0e}") }
}

fn worst(cell: &Cell, value: impl Fn(&Found) -> f64) -> f64 {
    cell.found.iter().map(value).fold(0.0, f64::max)
}

/// Marks what is smaller than barycentric coordinates can tell apart, or not much larger.
fn mark(cell: &Cell) -> &'static str {
    let any = |is: &dyn Fn(&Found) -> bool| cell.found.iter().any(is);
    if any(&|found| found.beyond) {
        " †"
    } else if any(&|found| found.rounding > IRRADIANCE) {
        " ‡"
    } else {
        ""
    }
}

fn print(title: &str, table: &[(&'static str, Vec<Cell>)], entry: impl Fn(&Cell) -> String) {
    let mut text = format!("\n**{title}**\n\n| |");
    columns::NAMES.iter().for_each(|name| write!(text, " {name} |").expect("a string can grow"));
    text.push_str("\n| --- |");
    columns::NAMES.iter().for_each(|_| text.push_str(" ---: |"));
    for (name, cells) in table {
        write!(text, "\n| {name} |").expect("a string can grow");
        cells.iter().for_each(|cell| write!(text, " {} |", entry(cell)).expect("a string can grow"));
    }
    println!("{text}");
}

fn print_all(table: &[(&'static str, Vec<Cell>)]) {
    let is_dark = |cell: &Cell| cell.found.iter().all(|found| found.dark);
    print("Normalization", table, |cell| {
        if is_dark(cell) {
            return "dark".into();
        }
        let none = worst(cell, |found| if found.dark { 0.0 } else { found.none });
        let unresolved = worst(cell, |found| found.normalization_resolution);
        let mut entry = short(worst(cell, |found| found.normalization));
        if unresolved > NORMALIZATION {
            write!(entry, " ± {}", short(unresolved)).expect("a string can grow");
        }
        entry.push_str(mark(cell));
        if none > 0.0 {
            write!(entry, " ({none:.2} `None`)").expect("a string can grow");
        }
        entry
    });
    print("Agreement", table, |cell| if is_dark(cell) { "dark".into() } else { short(cell.agreement) });
    print("Irradiance", table, |cell| {
        let worst = cell.found.iter().filter_map(|found| found.irradiance).max_by(|a, b| a[0].total_cmp(&b[0]));
        let resolution = cell.found.iter().filter_map(|found| found.irradiance).map(|i| i[1]).fold(0.0, f64::max);
        let both = if cell.found.iter().any(|found| found.both) { " *" } else { "" };
        worst
            .map_or("dark".into(), |[error, _]| format!("{} ± {}{both}{}", short(error), short(resolution), mark(cell)))
    });
    let cells = || table.iter().flat_map(|(_, cells)| cells);
    let samples: usize = cells().map(|cell| cell.samples).sum();
    let runs: usize = cells().map(|cell| cell.combinations).sum();
    println!("\n{samples} samples, {runs} combinations");
}

#[test]
fn a_small_matrix_holds() {
    let whole = Effort { points: 20, samples: 100, directions: 10, cells: 200 };
    // Five has no factor in common with the numbers of receivers and of variants, so that all of them have turns.
    let plan =
        Plan { sizes: Sizes { triangles: 2000, sky: 64 }, whole, others: None, thin: true, lobes: false, step: 5 };
    check(&run_all(&plan));
}

/// Lobes as further receivers, with roughnesses down to mirrors.
#[test]
fn a_small_matrix_with_lobes_holds() {
    let whole = Effort { points: 16, samples: 100, directions: 10, cells: 50 };
    let plan =
        Plan { sizes: Sizes { triangles: 2000, sky: 64 }, whole, others: None, thin: true, lobes: true, step: 8 };
    check(&run_all(&plan));
}

#[test]
#[ignore = "by hand: many minutes; cargo test --release --test suite -- --ignored --nocapture table_with_lobes"]
fn table_with_lobes() {
    let whole = Effort { points: 128, samples: 500, directions: 50, cells: 300 };
    let plan =
        Plan { sizes: Sizes { triangles: 2000, sky: 256 }, whole, others: None, thin: false, lobes: true, step: 2 };
    check(&run_all(&plan));
}

/// No cell misses a bar, and enough of them are lit.
fn check(table: &[(&'static str, Vec<Cell>)]) {
    print_all(table);
    let missed = missed(table);
    assert!(missed.is_empty(), "{} of the cells miss a bar:\n{}", missed.len(), missed.join("\n"));
    let found = || table.iter().flat_map(|(_, cells)| cells).flat_map(|cell| &cell.found);
    let (lit, all) = (found().filter(|found| found.irradiance.is_some()).count(), found().count());
    assert!(2 * lit > all, "only {lit} of {all} are lit");
}

#[test]
#[ignore = "release tier: a minute; cargo test --release --test suite -- --ignored --nocapture table"]
fn table() {
    // Several times the work takes as many times as long, and resolves more.
    let times = std::env::var("STRESS").map_or(1, |times| times.parse().expect("a whole number"));
    let whole = Effort { points: 128 * times, samples: 500, directions: 50, cells: 300 * times };
    let others = Some(Effort { points: 0, samples: 100, directions: 10, cells: 0 });
    let plan =
        Plan { sizes: Sizes { triangles: 1_000_000, sky: 4096 }, whole, others, thin: false, lobes: false, step: 1 };
    check(&run_all(&plan));
}

/// A density that is too large by a tenth on a part of each triangle, of samples, too.
struct Wrong<'a>(PointSampler<'a>);

impl Wrong<'_> {
    fn factor(barycentrics: [f32; 2]) -> f32 {
        if barycentrics[0] > 0.5 { 1.1 } else { 1.0 }
    }
}

impl Point for Wrong<'_> {
    fn sample(&self, u: [f32; 3]) -> Option<LightSample> {
        let mut sample = self.0.sample(u)?;
        sample.pdf *= Self::factor(sample.hit().expect("a triangle").barycentrics);
        Some(sample)
    }

    fn pdf(&self, hit: &Hit) -> f32 {
        Self::factor(hit.barycentrics) * self.0.pdf(hit)
    }

    fn pmf(&self, triangle: TriangleId) -> f32 {
        self.0.pmf(triangle)
    }

    fn pdf_direction(&self, direction: Vec3) -> f32 {
        self.0.pdf_direction(direction)
    }

    fn pdf_sample_direction(&self, sample: &LightSample) -> f32 {
        self.0.pdf_sample_direction(sample).max(sample.pdf)
    }
}

#[test]
fn a_wrong_density_misses_all_bars() {
    let row = rows::row(8, Sizes { triangles: 100, sky: 16 });
    let lights = build(&row.scene, ARITIES[0]);
    let x = columns::point(&row.scene, columns::NAMES.len() - 1, 2);
    let effort = Effort { points: 1024, samples: 300, directions: 100, cells: 300 };
    assert!(measure((&row, &lights), &lights.at(&x), [&x, &x], effort, 1).misses().is_empty());
    let found = measure((&row, &lights), &Wrong(lights.at(&x)), [&x, &x], effort, 1);
    assert_eq!(found.misses(), ["normalization", "agreement", "irradiance"], "{found:?}");
}
