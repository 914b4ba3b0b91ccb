//! How the variance of the mean of n samples falls with n, for numbers of different quality.

use fanlight::ShadingPoint;

use super::inputs::Input;
use super::smooth::{Case, Target, environment};
use crate::Failure;
use crate::args::Args;
use crate::methods;
use crate::parallel::parallel;
use crate::plot::panels::{Panel, Panels, Series, Style};
use crate::report::short;
use crate::variance::contribution;

const COUNTS: [u32; 4] = [16, 64, 256, 1024];

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    println!(
        "\nRelative variance of the mean of n samples, energy weighted, and slope of its logarithm against that of n"
    );
    println!("{:26} {:24} {:>9} {:>9} {:>9} {:>9} {:>6}", "case", "numbers", "16", "64", "256", "1024", "slope");
    let mut panels = vec![];
    for case in Case::all() {
        let points = case.points(args.effort.study_points.div_ceil(4));
        let mut series = vec![];
        for input in Input::ALL {
            let variances = variances(&case, &points, input, args.effort.repetitions as u64);
            let [a, b, c, d] = variances.map(short);
            println!("{:26} {:24} {a:>9} {b:>9} {c:>9} {d:>9} {:>6.2}", case.name, input.name(), slope(&variances));
            let marks = COUNTS.iter().zip(variances).map(|(n, v)| (f64::from(*n), v)).collect();
            series.push(Series { name: input.name().to_owned(), open: false, marks });
        }
        panels.push(Panel { title: case.name.to_owned(), series });
    }
    if let Some(directory) = &args.plots {
        let names = Input::ALL.map(|input| input.name().to_owned()).to_vec();
        let labels = ["samples", "relative variance of their mean"];
        let panels = Panels { panels, columns: 3, labels, style: Style::Lines, names, open: "" };
        panels.draw(&directory.join("stratification.svg"))?;
    }
    Ok(())
}

/// Relative variance of the mean for each number of samples.
fn variances(case: &Case, points: &[ShadingPoint], input: Input, repetitions: u64) -> [f64; 4] {
    let method = match case.target {
        Target::Lights => methods::build("fanlight", &case.scene),
        Target::SolidAngle => methods::build("uniform-solid-angle", &case.scene),
        Target::Environment => methods::build("environment-reject", &case.scene),
    };
    let environment = environment();
    let estimate = |x: &ShadingPoint, u: [f32; 3]| {
        let Some(drawn) = method.sample(x, u) else { return 0.0 };
        let value = match case.target {
            // Without the wall.
            Target::Environment => f64::from(x.cosine(drawn.direction) * environment.radiance(drawn.direction)),
            _ => contribution(&case.scene, x, &drawn),
        };
        value / drawn.pdf
    };
    COUNTS.map(|n| {
        let at_point = |_: usize, x: &ShadingPoint| {
            let means: Vec<f64> = (0..repetitions)
                .map(|seed| {
                    let numbers = input.points(n, seed + 1);
                    numbers.iter().map(|u| estimate(x, *u)).sum::<f64>() / f64::from(n)
                })
                .collect();
            let mean = means.iter().sum::<f64>() / means.len() as f64;
            let squares: f64 = means.iter().map(|m| (m - mean).powi(2)).sum();
            (squares / (means.len() - 1) as f64, mean * mean)
        };
        let (variance, squares) =
            parallel(points, at_point).into_iter().fold((0.0, 0.0), |sum, (v, e2)| (sum.0 + v, sum.1 + e2));
        variance / squares
    })
}

/// Slope of the line through the logarithms (least squares).
fn slope(variances: &[f64; 4]) -> f64 {
    let marks: Vec<(f64, f64)> = COUNTS.iter().zip(variances).map(|(n, v)| (f64::from(*n).ln(), v.ln())).collect();
    let mean = |get: fn(&(f64, f64)) -> f64| marks.iter().map(get).sum::<f64>() / marks.len() as f64;
    let (x, y) = (mean(|mark| mark.0), mean(|mark| mark.1));
    let products: f64 = marks.iter().map(|mark| (mark.0 - x) * (mark.1 - y)).sum();
    products / marks.iter().map(|mark| (mark.0 - x).powi(2)).sum::<f64>()
}
