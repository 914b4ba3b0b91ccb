//! The errors as a figure: of a sample against the training, and of the image against time.

use core::fmt::Write;

use crate::Pass;

const COLORS: [&str; 3] = ["#888888", "#d98032", "#2a6fbb"];
/// Extent of a panel, and its place.
const PANEL: [f64; 2] = [300.0, 240.0];
const LEFT: [f64; 2] = [60.0, 440.0];
const TOP: f64 = 30.0;

/// Returns the figure as SVG.
pub(crate) fn draw<const N: usize>(curves: &[(&str, [Pass; N])]) -> String {
    let mut svg = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 780 390\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"780\" height=\"390\" fill=\"white\"/>\n",
    );
    // The first pass has no training: it stands at one half.
    let by_training = |pass: &Pass| [f64::from(pass.trained).max(0.5), pass.error];
    panel(&mut svg, LEFT[0], ["training samples a pixel", "relMSE of one sample a pixel"], curves, by_training);
    panel(&mut svg, LEFT[1], ["seconds", "relMSE of the image so far"], curves, |pass| {
        [pass.seconds, pass.error_so_far]
    });
    for (i, (name, _)) in curves.iter().enumerate() {
        let y = TOP + PANEL[1] + 60.0 + 18.0 * i as f64;
        // Writing to a string does not fail.
        let _ = writeln!(
            svg,
            "<path d=\"M60 {y}h24\" stroke=\"{}\" stroke-width=\"2\"/><text x=\"92\" y=\"{}\">{name}</text>",
            COLORS[i],
            y + 4.0
        );
    }
    svg + "</svg>\n"
}

/// One panel, with logarithmic axes that hold all points.
fn panel<const N: usize>(
    svg: &mut String,
    left: f64,
    labels: [&str; 2],
    curves: &[(&str, [Pass; N])],
    at: impl Fn(&Pass) -> [f64; 2],
) {
    let points = || curves.iter().flat_map(|(_, passes)| passes.iter().map(&at));
    let bounds = [0, 1].map(|k| {
        let low = points().map(|point| point[k]).fold(f64::INFINITY, f64::min).log10().floor();
        let high = points().map(|point| point[k]).fold(0.0, f64::max).log10().ceil();
        [low, high.max(low + 1.0)]
    });
    let place = |[x, y]: [f64; 2]| {
        let share = |value: f64, [low, high]: [f64; 2]| (value.log10() - low) / (high - low);
        [left + PANEL[0] * share(x, bounds[0]), TOP + PANEL[1] * (1.0 - share(y, bounds[1]))]
    };
    let (right, bottom) = (left + PANEL[0], TOP + PANEL[1]);
    for (k, [low, high]) in bounds.into_iter().enumerate() {
        for exponent in low as i32..=high as i32 {
            let value = 10.0_f64.powi(exponent);
            let mut point = bounds.map(|[low, _]| 10.0_f64.powf(low));
            point[k] = value;
            let [x, y] = place(point);
            let _ = if k == 0 {
                writeln!(
                    svg,
                    "<path d=\"M{x:.1} {TOP}V{bottom}\" stroke=\"#ddd\"/><text x=\"{x:.1}\" y=\"{}\" \
                     text-anchor=\"middle\">{value}</text>",
                    bottom + 16.0
                )
            } else {
                writeln!(
                    svg,
                    "<path d=\"M{left} {y:.1}H{right}\" stroke=\"#ddd\"/><text x=\"{}\" y=\"{:.1}\" \
                     text-anchor=\"end\">{value}</text>",
                    left - 4.0,
                    y + 4.0
                )
            };
        }
    }
    let [across, down] = labels;
    let _ = writeln!(
        svg,
        "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{across}</text><text x=\"{left}\" y=\"{}\">{down}</text>",
        left + 0.5 * PANEL[0],
        bottom + 34.0,
        TOP - 10.0
    );
    for ((_, passes), color) in curves.iter().zip(COLORS) {
        let line: Vec<_> = passes.iter().map(|pass| place(at(pass))).map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
        let _ = writeln!(
            svg,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\"/>",
            line.join(" ")
        );
    }
}
