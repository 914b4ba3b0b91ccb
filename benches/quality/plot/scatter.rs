//! Variance against time, of all methods on each workload.

use std::path::Path;

use super::panels::{Panel, Panels, Series, Style};
use crate::Failure;
use crate::report::Row;

const LABELS: [&str; 2] = ["ns a sample", "relative variance"];

/// Draws the emitters' workloads into one picture of a directory, those with portals into another.
pub(crate) fn draw(directory: &Path, rows: &[Row]) -> Result<(), Failure> {
    let has_classes = |row: &Row| rows.iter().any(|r| r.workload == row.workload && r.class != "all");
    let (portals, emitters): (Vec<&Row>, Vec<&Row>) = rows.iter().partition(|row| has_classes(row));
    let portals: Vec<&Row> = portals.into_iter().filter(|row| row.class != "all").collect();
    for (name, rows) in [("emitters.svg", emitters), ("portals.svg", portals)] {
        let panels = panels(&rows);
        if !panels.is_empty() {
            Panels { panels, columns: 3, labels: LABELS, style: Style::Marks }.draw(&directory.join(name))?;
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
        let marks = vec![(row.nanoseconds.sample, relvar.energy_weighted)];
        panels[at].series.push(Series { name: row.method.clone(), marks });
    }
    panels
}
