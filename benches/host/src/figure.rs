//! Error against time of all scenes at a glance, as SVG.

use core::fmt::Write;

use crate::report::Row;

/// Colors of fanlight, of the best competitor, and of all others; the last ones are drawn first.
const COLORS: [&str; 3] = ["#bbbbbb", "#d98032", "#2a6fbb"];
/// Panels side by side.
const COLUMNS: usize = 6;
/// Extent of a panel, and the place that it takes with its labels.
const PANEL: [f64; 2] = [118.0, 84.0];
const CELL: [f64; 2] = [158.0, 130.0];
const LEFT: f64 = 34.0;
const TOP: f64 = 24.0;

/// Returns a panel for each scene and number of bounces, with a line for each method: logarithmic axes, the same
/// seconds and as many decades of relMSE in all of them, so that slopes and distances compare.
pub(crate) fn draw(rows: &[Row]) -> String {
    let panels: Vec<&[Row]> = rows.chunk_by(|a, b| a.scene == b.scene && a.bounces == b.bounces).collect();
    let seconds = bounds(rows.iter().flat_map(|row| &row.curve).map(|point| point[0]));
    let highest = |rows: &[Row]| bounds(rows.iter().flat_map(|row| &row.curve).map(|point| point[1]));
    let decades = panels.iter().map(|rows| highest(rows)).map(|[low, high]| high - low).fold(1.0, f64::max);
    let height = CELL[1] * panels.len().div_ceil(COLUMNS) as f64 + 40.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {height}\" font-family=\"sans-serif\" \
         font-size=\"9\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
        CELL[0] * COLUMNS as f64 + 10.0
    );
    for (i, rows) in panels.iter().enumerate() {
        let corner = [CELL[0] * (i % COLUMNS) as f64 + LEFT, CELL[1] * (i / COLUMNS) as f64 + TOP];
        let [_, high] = highest(rows);
        panel(&mut svg, corner, rows, seconds, [high - decades, high]);
    }
    let names = ["another method without fanlight", "the best without fanlight", "fanlight"];
    for (i, (name, color)) in names.into_iter().zip(COLORS).rev().enumerate() {
        let (x, y) = (LEFT + 200.0 * i as f64, height - 16.0);
        // Writing to a string does not fail.
        let _ = writeln!(
            svg,
            "<path d=\"M{x} {y}h20\" stroke=\"{color}\" stroke-width=\"2\"/><text x=\"{}\" y=\"{}\">{name}</text>",
            x + 26.0,
            y + 3.0
        );
    }
    svg + "</svg>\n"
}

/// Whole powers of ten, as exponents, around positive numbers.
fn bounds(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let (low, high) = values
        .filter(|value| *value > 0.0)
        .fold((f64::INFINITY, 0.0_f64), |(low, high), value| (low.min(value), high.max(value)));
    if low > high { [0.0, 1.0] } else { [low.log10().floor(), high.log10().ceil().max(low.log10().floor() + 1.0)] }
}

fn panel(svg: &mut String, [left, top]: [f64; 2], rows: &[Row], x: [f64; 2], y: [f64; 2]) {
    let [width, height] = PANEL;
    let share = |value: f64, [low, high]: [f64; 2]| (value - low) / (high - low);
    let across = |exponent: f64| left + width * share(exponent, x);
    let down = |exponent: f64| top + height * (1.0 - share(exponent, y));
    let (right, bottom) = (left + width, top + height);
    if let Some(Row { scene, bounces, .. }) = rows.first() {
        let plural = if *bounces == 1 { "" } else { "s" };
        let _ = writeln!(svg, "<text x=\"{left}\" y=\"{}\">{scene}, {bounces} bounce{plural}</text>", top - 5.0);
    }
    for exponent in x[0] as i32..=x[1] as i32 {
        let at = across(exponent.into());
        let _ = writeln!(
            svg,
            "<path d=\"M{at:.1} {top}V{bottom}\" stroke=\"#ddd\"/>\
             <text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{} s</text>",
            bottom + 11.0,
            10.0_f64.powi(exponent)
        );
    }
    for exponent in y[0] as i32..=y[1] as i32 {
        let at = down(exponent.into());
        let _ = write!(svg, "<path d=\"M{left} {at:.1}H{right}\" stroke=\"#ddd\"/>");
        if exponent % 2 == 0 {
            let _ =
                write!(svg, "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">1e{exponent}</text>", left - 3.0, at + 3.0);
        }
        svg.push('\n');
    }
    let kind = |row: &Row| if row.method == "fanlight" { 2 } else { usize::from(row.is_best) };
    for (wanted, color) in COLORS.into_iter().enumerate() {
        // Only the plain one of fanlight's variants is drawn.
        let drawn = rows.iter().filter(|row| kind(row) == wanted && !row.method.starts_with("fanlight@"));
        for Row { curve, .. } in drawn {
            let points: Vec<[f64; 2]> = curve.iter().copied().filter(|[_, error]| *error > 0.0).collect();
            let Some(last) = points.last() else { continue };
            let place = |[s, error]: [f64; 2]| [across(s.log10()), down(error.log10())];
            let line: Vec<String> =
                points.iter().map(|point| place(*point)).map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
            let [x, y] = place(*last);
            // A single image is a dot.
            let _ = writeln!(
                svg,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.6\"/>\
                 <circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2\" fill=\"{color}\"/>",
                line.join(" ")
            );
        }
    }
}
