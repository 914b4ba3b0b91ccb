//! Whether methods of others are re-implemented fairly: their figures next to those of the originals.

use crate::report::{Row, short};

/// What an original reaches: method, workload, class, column, figure.
type Published = (&'static str, &'static str, &'static str, &'static str, f64);

/// pbrt-v4 on the same workloads. Its light tree is that with the clamp of the distance repaired where both were
/// measured.
const PUBLISHED: [Published; 14] = [
    ("binary-tree", "cloud-10000", "all", "exact-sel median", 3.9),
    ("binary-tree", "cloud-10000", "all", "exact-sel EW", 34.0),
    ("binary-tree", "sphere-29", "all", "exact-sel median", 2.2),
    ("binary-tree", "sphere-29", "all", "exact-sel EW", 13.6),
    ("every-light", "cloud-10000", "all", "exact-sel median", 0.60),
    ("every-light", "cloud-10000", "all", "exact-sel EW", 1.9),
    ("every-light", "sphere-29", "all", "exact-sel median", 0.032),
    ("every-light", "sphere-29", "all", "exact-sel EW", 0.13),
    ("rectified", "window", "no-sun", "relvar median", 0.095),
    ("rectified", "window", "no-sun", "relvar EW", 0.061),
    ("rectified", "window", "sun", "relvar median", 0.003),
    ("rectified", "window", "sun", "relvar EW", 0.019),
    ("rectified", "window", "below", "relvar median", 41.0),
    ("rectified", "window", "below", "relvar EW", 16.0),
];

fn figure(row: &Row, column: &str) -> Option<f64> {
    match column {
        "exact-sel median" => row.selection.map(|s| s.median),
        "exact-sel EW" => row.selection.map(|s| s.energy_weighted),
        "relvar median" => row.relvar.map(|s| s.median),
        _ => row.relvar.map(|s| s.energy_weighted),
    }
}

/// Prints the figures of methods that the original's are known of.
pub(crate) fn print(rows: &[Row]) {
    let found = PUBLISHED.iter().filter_map(|(method, workload, class, column, original)| {
        let row = rows.iter().find(|r| r.method == *method && r.workload == *workload && r.class == *class)?;
        Some((row, column, figure(row, column)?, original))
    });
    let found: Vec<_> = found.collect();
    if found.is_empty() {
        return;
    }
    println!("\n{:12} {:12} {:6} {:16} {:>8} {:>8}", "fairness", "workload", "class", "column", "here", "pbrt-v4");
    for (row, column, here, original) in found {
        let (here, original) = (short(here), short(*original));
        println!("{:12} {:12} {:6} {column:16} {here:>8} {original:>8}", row.method, row.workload, row.class);
    }
}
