//! Small multiples on logarithmic axes, with one color for each name in all of them and one legend below.

use core::ops::Range;
use std::path::Path;

use plotters::coord::Shift;
use plotters::coord::combinators::LogCoord;
use plotters::prelude::*;

use crate::Failure;

/// Distinguishable colors: those of Okabe and Ito (2008), and darker ones.
const COLORS: [RGBColor; 14] = [
    RGBColor(0, 0, 0),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 158, 115),
    RGBColor(213, 94, 0),
    RGBColor(0, 114, 178),
    RGBColor(204, 121, 167),
    RGBColor(150, 140, 20),
    RGBColor(120, 60, 150),
    RGBColor(130, 130, 130),
    RGBColor(140, 80, 40),
    RGBColor(60, 110, 60),
    RGBColor(200, 40, 60),
    RGBColor(40, 50, 120),
];
const PANEL: (u32, u32) = (300, 250);
const LEGEND_COLUMN: i32 = 225;
const LEGEND_ROW: i32 = 20;

/// How the marks of a series are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Style {
    /// Joined by a line.
    Lines,
    /// Alone, over lines along which error times time is the same.
    Marks,
}

/// The marks of one name.
pub(crate) struct Series {
    pub(crate) name: String,
    /// Draws rings instead of discs.
    pub(crate) open: bool,
    pub(crate) marks: Vec<(f64, f64)>,
}

/// One chart.
pub(crate) struct Panel {
    pub(crate) title: String,
    pub(crate) series: Vec<Series>,
}

/// A picture.
pub(crate) struct Panels {
    pub(crate) panels: Vec<Panel>,
    pub(crate) columns: usize,
    /// Labels of the horizontal and the vertical axis.
    pub(crate) labels: [&'static str; 2],
    pub(crate) style: Style,
    /// All names there are, in the order of their colors; those that appear in no panel are left out of the legend.
    pub(crate) names: Vec<String>,
    /// What rings stand for, if there are any.
    pub(crate) open: &'static str,
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<LogCoord<f64>, LogCoord<f64>>>;

impl Panels {
    pub(crate) fn draw(&self, path: &Path) -> Result<(), Failure> {
        if let Some(directory) = path.parent() {
            std::fs::create_dir_all(directory)?;
        }
        let legend_entries = self.legend();
        let rows = self.panels.len().div_ceil(self.columns);
        let (width, height) = (PANEL.0 * self.columns as u32, PANEL.1 * rows as u32);
        let per_row = (width as i32 / LEGEND_COLUMN).max(1) as usize;
        let legend_height = LEGEND_ROW * legend_entries.len().div_ceil(per_row) as i32 + 12;
        let root = SVGBackend::new(path, (width, height + legend_height as u32)).into_drawing_area();
        root.fill(&WHITE)?;
        let (charts, legend) = root.split_vertically(height);
        for (panel, area) in self.panels.iter().zip(charts.split_evenly((rows, self.columns))) {
            self.draw_panel(panel, &area)?;
        }
        for (i, (name, style)) in legend_entries.into_iter().enumerate() {
            let at = ((i % per_row) as i32 * LEGEND_COLUMN + 20, (i / per_row) as i32 * LEGEND_ROW + 10);
            legend.draw(&Circle::new(at, 4, style))?;
            legend.draw(&Text::new(name.to_owned(), (at.0 + 10, at.1 - 7), ("sans-serif", 14)))?;
        }
        root.present()?;
        Ok(())
    }

    /// Names that appear, and how.
    fn legend(&self) -> Vec<(&str, ShapeStyle)> {
        let all = || self.panels.iter().flat_map(|panel| &panel.series);
        let appears = |name: &&String| all().any(|series| series.name == **name);
        let mut entries: Vec<(&str, ShapeStyle)> =
            self.names.iter().filter(appears).map(|name| (name.as_str(), self.color(name).filled())).collect();
        if all().any(|series| series.open) {
            entries.push((self.open, BLACK.stroke_width(2)));
        }
        entries
    }

    fn color(&self, name: &str) -> RGBColor {
        COLORS[self.names.iter().position(|n| n == name).unwrap_or(0) % COLORS.len()]
    }

    /// Horizontal range: that of all panels.
    fn horizontal(&self) -> Range<f64> {
        let series = self.panels.iter().flat_map(|panel| &panel.series);
        span(series.flat_map(|series| &series.marks).filter(|m| is_positive(**m)).map(|mark| mark.0))
    }

    fn draw_panel(&self, panel: &Panel, area: &Area<'_>) -> Result<(), Failure> {
        let marks = || panel.series.iter().flat_map(|series| series.marks.iter().copied()).filter(|m| is_positive(*m));
        if marks().next().is_none() {
            return Ok(());
        }
        let (x, y) = (self.horizontal(), span(marks().map(|mark| mark.1)));
        let mut chart = ChartBuilder::on(area)
            .caption(&panel.title, ("sans-serif", 16))
            .margin(6)
            .x_label_area_size(36)
            .y_label_area_size(56)
            .build_cartesian_2d(x.clone().log_scale(), y.clone().log_scale())?;
        chart
            .configure_mesh()
            .bold_line_style(RGBColor(235, 235, 235))
            .light_line_style(WHITE)
            .x_labels(5)
            .y_labels(6)
            .x_label_formatter(&|x| number(*x))
            .y_label_formatter(&|y| number(*y))
            .x_desc(self.labels[0])
            .y_desc(self.labels[1])
            .draw()?;
        if self.style == Style::Marks {
            draw_equal_costs(&mut chart, &x, &y)?;
        }
        for series in &panel.series {
            let color = self.color(&series.name);
            let marks: Vec<(f64, f64)> = series.marks.iter().copied().filter(|mark| is_positive(*mark)).collect();
            if self.style == Style::Lines {
                chart.draw_series([PathElement::new(marks.clone(), color.stroke_width(2))])?;
            }
            let style = if series.open { color.stroke_width(2) } else { color.filled() };
            chart.draw_series(marks.into_iter().map(|mark| Circle::new(mark, 4, style)))?;
        }
        Ok(())
    }
}

fn is_positive(mark: (f64, f64)) -> bool {
    mark.0 > 0.0 && mark.1 > 0.0 && mark.0.is_finite() && mark.1.is_finite()
}

/// An interval around values.
fn span(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (low, high) = values.fold((f64::INFINITY, 0.0_f64), |(low, high), v| (low.min(v), high.max(v)));
    low / 2.0..high * 2.0
}

/// Lines along which y falls as x rises, a hundredfold apart.
fn draw_equal_costs(chart: &mut Chart<'_, '_>, x: &Range<f64>, y: &Range<f64>) -> Result<(), Failure> {
    let (low, high) = ((x.start * y.start).log10() / 2.0, (x.end * y.end).log10() / 2.0);
    for exponent in low.ceil() as i32..=high.floor() as i32 {
        let cost = 100.0_f64.powi(exponent);
        let from = x.start.max(cost / y.end);
        let to = x.end.min(cost / y.start);
        let line = vec![(from, cost / from), (to, cost / to)];
        chart.draw_series([PathElement::new(line, RGBColor(215, 215, 215))])?;
    }
    Ok(())
}

/// A short label.
fn number(x: f64) -> String {
    if (0.01..1e5).contains(&x) { format!("{x}") } else { format!("{x:.0e}") }
}
