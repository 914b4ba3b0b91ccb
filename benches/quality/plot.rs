//! Variance against time as pictures, one a workload.

use std::path::Path;

use plotters::prelude::*;

use crate::report::Row;

type Failure = Box<dyn core::error::Error>;

/// Draws one picture of every workload into a directory.
pub(crate) fn draw(directory: &Path, rows: &[Row]) -> Result<(), Failure> {
    std::fs::create_dir_all(directory)?;
    let mut workloads: Vec<&str> = rows.iter().map(|row| row.workload.as_str()).collect();
    workloads.dedup();
    for workload in workloads {
        let of_workload: Vec<&Row> = rows.iter().filter(|row| row.workload == workload).collect();
        draw_workload(&directory.join(format!("{workload}.svg")), workload, &of_workload)?;
    }
    Ok(())
}

/// A mark: nanoseconds, energy-weighted relative variance, label, colour.
type Mark = (f64, f64, String, RGBColor);

fn marks(rows: &[&Row]) -> Vec<Mark> {
    let color = |class: &str| match class {
        "no-sun" => BLUE,
        "sun" => RGBColor(220, 140, 0),
        "below" => RGBColor(150, 60, 150),
        _ => BLACK,
    };
    let with_classes = rows.iter().any(|row| row.class != "all");
    let is_shown = |row: &&&Row| !with_classes || row.class != "all";
    let mark = |row: &&Row| {
        let label = if with_classes { format!("{} ({})", row.method, row.class) } else { row.method.clone() };
        let relvar = row.relvar?.energy_weighted;
        (relvar > 0.0).then(|| (row.nanoseconds.sample, relvar, label, color(row.class)))
    };
    rows.iter().filter(is_shown).filter_map(mark).collect()
}

/// An interval around values, with room for labels.
fn span(values: impl Iterator<Item = f64>, below: f64, above: f64) -> core::ops::Range<f64> {
    let (low, high) = values.fold((f64::INFINITY, 0.0_f64), |(low, high), v| (low.min(v), high.max(v)));
    low / below..high * above
}

fn draw_workload(path: &Path, workload: &str, rows: &[&Row]) -> Result<(), Failure> {
    let marks = marks(rows);
    if marks.is_empty() {
        return Ok(());
    }
    let area = SVGBackend::new(path, (760, 520)).into_drawing_area();
    area.fill(&WHITE)?;
    let x = span(marks.iter().map(|mark| mark.0), 1.5, 4.0).log_scale();
    let y = span(marks.iter().map(|mark| mark.1), 2.0, 2.0).log_scale();
    let mut chart = ChartBuilder::on(&area)
        .caption(workload, ("sans-serif", 20))
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(60)
        .build_cartesian_2d(x, y)?;
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .x_desc("ns per sample")
        .y_desc("relative variance, energy weighted")
        .draw()?;
    chart.draw_series(marks.iter().map(|(x, y, label, color)| {
        EmptyElement::at((*x, *y))
            + Circle::new((0, 0), 4, color.filled())
            + Text::new(label.clone(), (7, -6), ("sans-serif", 13))
    }))?;
    area.present()?;
    Ok(())
}
