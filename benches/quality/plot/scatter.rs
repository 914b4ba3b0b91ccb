//! Variance against time, of all methods on each workload.

use std::path::Path;

use super::panels::{Panel, Panels, Series, Style};
use crate::Failure;
use crate::report::Row;
use crate::scenes::workload_and_variant;

const LABELS: [&str; 2] = ["ns a call at a lit point", "relative variance (EW)"];

/// Draws the emitters' workloads into one picture of a directory, those with portals into another.
pub(crate) fn draw(directory: &Path, rows: &[Row]) -> Result<(), Failure> {
    let has_classes = |row: &Row| rows.iter().any(|r| r.workload == row.workload && r.class != "all");
    let (portals, emitters): (Vec<&Row>, Vec<&Row>) = rows.iter().partition(|row| has_classes(row));
    let portals: Vec<&Row> = portals.into_iter().filter(|row| row.class != "all").collect();
    let mut names: Vec<String> = vec![];
    for row in rows {
        let (method, _) = workload_and_variant(&row.method);
        if !names.iter().any(|name| name == method) {
            names.push(method.to_owned());
        }
    }
    for (name, rows) in [("emitters.svg", emitters), ("portals.svg", portals)] {
        let panels = panels(&rows);
        if !panels.is_empty() {
            let (names, open) = (names.clone(), "open: @clip-map, @nearest");
            let panels = Panels { panels, columns: 3, labels: LABELS, style: Style::Marks, names, open };
            panels.draw(&directory.join(name))?;
        }
    }
    Ok(())
}

/// One panel for each workload and class.
fn panels(rows: &[&Row]) -> Vec<Panel> {
    let mut panels: Vec<Panel> = vec![];
    for row in rows {
        let Some(relvar) = row.relvar else { continue };
        let title = if row.class == "all" { row.workload.clone() } else { format!("{}, {}", row.workload, row.class) };
        let at = panels.iter().position(|panel| panel.title == title).unwrap_or_else(|| {
            panels.push(Panel { title, series: vec![] });
            panels.len() - 1
        });
        let marks = vec![(row.nanoseconds.lit, relvar.energy_weighted)];
        let (method, variant) = workload_and_variant(&row.method);
        panels[at].series.push(Series { name: method.to_owned(), open: variant.is_some(), marks });
    }
    panels
}
