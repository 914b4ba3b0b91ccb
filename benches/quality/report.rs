//! Rows as a table and as JSON.

use core::fmt::Write as _;

use crate::instruction_set;
use crate::metrics::Summary;
use crate::studies::lobes::LobeRow;
use crate::timing::Nanoseconds;

/// One workload, method and class.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    pub(crate) workload: String,
    pub(crate) method: String,
    pub(crate) class: &'static str,
    /// Points of the class: of few, a summary says little.
    pub(crate) points: usize,
    pub(crate) relvar: Option<Summary>,
    pub(crate) selection: Option<Summary>,
    /// Largest share of a point's light that has a probability of zero, by triangles or by samples of a reference.
    pub(crate) lost: Option<f64>,
    pub(crate) zero_rate: Option<f64>,
    pub(crate) nanoseconds: Nanoseconds,
    pub(crate) bytes: usize,
    pub(crate) build_ms: f64,
    /// Share of samples that get through to the point, where walls are in between.
    pub(crate) reach: Option<f64>,
    /// Rays that visibility was learned by.
    pub(crate) rays_learned: Option<f64>,
}

impl Row {
    /// Precision that a second of sampling buys: `1 / (relvar seconds)`.
    fn efficiency(&self, relvar: impl Fn(&Summary) -> f64) -> Option<f64> {
        self.relvar.map(|summary| 1e9 / (relvar(&summary) * self.nanoseconds.lit))
    }
}

/// Three figures, whatever the size.
pub(crate) fn short(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        a if !(1e-4..1e7).contains(&a) => format!("{value:.1e}"),
        a => {
            let digits = (2 - a.log10().floor() as i32).max(0) as usize;
            format!("{value:.digits$}")
        }
    }
}

/// Prints the head of the table. Times are those of whole calls, at lit points and at all.
pub(crate) fn print_head() {
    println!("times with the instructions {}", instruction_set::name());
    println!(
        "{:12} {:29} {:6} {:>6} {:>8} {:>8} {:>8} {:>8} {:>8} {:>7} {:>6} {:>7} {:>7} {:>7} {:>9} {:>8} {:>8}",
        "workload",
        "method",
        "class",
        "points",
        "relvar",
        "p90",
        "EW",
        "exactsel",
        "EW",
        "lost",
        "zero",
        "ns lit",
        "ns all",
        "ns pdf",
        "bytes",
        "build ms",
        "eff EW"
    );
}

/// Prints one row. Efficiency is that of the energy-weighted variance.
pub(crate) fn print(row: &Row) {
    let figure = |value: Option<f64>| value.map_or_else(|| "-".into(), short);
    let relvar = |get: fn(&Summary) -> f64| figure(row.relvar.as_ref().map(get));
    let selection = |get: fn(&Summary) -> f64| figure(row.selection.as_ref().map(get));
    println!(
        "{:12} {:29} {:6} {:>6} {:>8} {:>8} {:>8} {:>8} {:>8} {:>7} {:>6} {:>7} {:>7} {:>7} {:>9} {:>8} {:>8}",
        row.workload,
        row.method,
        row.class,
        row.points,
        relvar(|s| s.median),
        relvar(|s| s.p90),
        relvar(|s| s.energy_weighted),
        selection(|s| s.median),
        selection(|s| s.energy_weighted),
        figure(row.lost),
        figure(row.zero_rate),
        short(row.nanoseconds.lit),
        short(row.nanoseconds.all),
        short(row.nanoseconds.pdf),
        row.bytes,
        short(row.build_ms),
        figure(row.efficiency(|s| s.energy_weighted)),
    );
}

/// Fails if the crate gives anything that sends light a probability of zero.
pub(crate) fn check_nothing_is_lost(rows: &[Row]) -> Result<(), Box<dyn core::error::Error>> {
    let loses = |row: &&Row| row.method.starts_with("fanlight") && row.lost.is_some_and(|lost| lost > 0.0);
    match rows.iter().find(loses) {
        Some(row) => Err(format!("{} {} {}: energy is lost", row.workload, row.method, row.class).into()),
        None => Ok(()),
    }
}

/// The list of these objects.
pub(crate) fn json(objects: &[String]) -> String {
    format!("[\n{}\n]\n", objects.join(",\n"))
}

/// A row as an object.
pub(crate) fn object(row: &Row) -> String {
    let number = |value: Option<f64>| value.filter(|v| v.is_finite()).map_or_else(|| "null".into(), |v| v.to_string());
    let mut out =
        format!("  {{\"workload\": \"{}\", \"method\": \"{}\", \"class\": \"{}\"", row.workload, row.method, row.class);
    let figures = [
        ("points", Some(row.points as f64)),
        ("relvar_median", row.relvar.map(|s| s.median)),
        ("relvar_p90", row.relvar.map(|s| s.p90)),
        ("relvar_ew", row.relvar.map(|s| s.energy_weighted)),
        ("exact_sel_median", row.selection.map(|s| s.median)),
        ("exact_sel_ew", row.selection.map(|s| s.energy_weighted)),
        ("zero_rate", row.zero_rate),
        ("ns_lit", Some(row.nanoseconds.lit)),
        ("ns_all", Some(row.nanoseconds.all)),
        ("ns_pdf", Some(row.nanoseconds.pdf)),
        ("bytes", Some(row.bytes as f64)),
        ("build_ms", Some(row.build_ms)),
        ("reach", row.reach),
        ("rays_learned", row.rays_learned),
    ];
    for (key, value) in figures {
        write!(out, ", \"{key}\": {}", number(value)).expect("a string takes everything");
    }
    out + "}"
}

/// A row about glossy receivers as an object, with the same keys.
pub(crate) fn lobe_object(row: &LobeRow) -> String {
    let LobeRow { workload, method, points, relvar } = row;
    format!(
        "  {{\"workload\": \"{workload}\", \"method\": \"{method}\", \"class\": \"all\", \"points\": {points}, \
         \"relvar_median\": {}, \"relvar_p90\": {}, \"relvar_ew\": {}}}",
        relvar.median, relvar.p90, relvar.energy_weighted
    )
}
