//! What a portal sends, by spherical harmonics (Wang and Ramamoorthi 2018): `-- --harmonics` prints a table.
//!
//! The window of the workload, with its smooth sky alone and with its sun. For each degree: how far the irradiance
//! without noise is from the truth, and the variance of uniform directions through the window with the harmonics as a
//! control variate, next to the crate's samples.

use std::time::Instant;

use fanlight::ShadingPoint;

use crate::args::Effort;
use crate::comparison::truths;
use crate::methods::harmonic::{Harmonic, normal};
use crate::methods::{self, Drawn, Method};
use crate::metrics::summary;
use crate::oracle::Truth;
use crate::parallel::parallel;
use crate::scenes::pcg::Pcg32;
use crate::scenes::sky::Sky;
use crate::scenes::{Scene, openings};
use crate::timing::median;
use crate::variance::contribution;

const DEGREES: [usize; 4] = [3, 5, 7, 9];

/// Prints the table.
pub(crate) fn run(effort: &Effort) {
    println!("| window | degree | error of the irradiance, median (p90) | variance, median (EW) | ns a portal |");
    println!("| --- | ---: | ---: | ---: | ---: |");
    for (name, sky) in [("smooth sky", Sky::without_sun()), ("with a sun", Sky::new())] {
        let scene = Scene { sky: Some(sky), ..openings::window() };
        let points = truths(&scene, effort.points);
        let window = methods::build("uniform-solid-angle", &scene);
        let plain = |method: &dyn Method, control: Option<&Harmonic>| {
            let variance = |i: usize, (x, truth): &(ShadingPoint, Truth)| {
                (variance(&scene, method, control, x, truth, effort.samples, i as u64), truth.total * truth.total)
            };
            let found = summary(parallel(&points, variance).into_iter()).expect("some point is lit");
            format!("{:.4} ({:.3})", found.median, found.energy_weighted)
        };
        for degree in DEGREES {
            let harmonic = Harmonic::new(&scene, degree, f64::INFINITY);
            let mut errors = parallel(&points, |_, (x, truth)| {
                let sum: f64 = (0..scene.lights.len()).map(|portal| harmonic.irradiance(x, portal)).sum();
                (sum / truth.total - 1.0).abs()
            });
            errors.sort_by(f64::total_cmp);
            let [middle, high] = [0.5, 0.9].map(|share| errors[(share * errors.len() as f64) as usize]);
            let time = nanoseconds(&harmonic, &points, effort);
            let variance = plain(window.as_ref(), Some(&harmonic));
            println!("| {name}, control variate | {degree} | {middle:.4} ({high:.3}) | {variance} | {time:.0} |");
        }
        println!("| {name}, uniform directions | - | - | {} | - |", plain(window.as_ref(), None));
        let crate_itself = methods::build("fanlight", &scene);
        println!("| {name}, `fanlight` | - | - | {} | - |", plain(crate_itself.as_ref(), None));
    }
}

/// Variance of the one-sample estimate by plain Monte Carlo, less a control variate if there is one.
fn variance(
    scene: &Scene,
    method: &dyn Method,
    control: Option<&Harmonic>,
    x: &ShadingPoint,
    truth: &Truth,
    samples: usize,
    seed: u64,
) -> f64 {
    let mut pcg = Pcg32::new(seed, 5);
    let known: f64 =
        control.map_or(0.0, |harmonic| (0..scene.lights.len()).map(|portal| harmonic.irradiance(x, portal)).sum());
    let control = |drawn: &Drawn| {
        let direction = drawn.direction.as_dvec3();
        let is_above = normal(x).dot(direction) > 0.0;
        control.filter(|_| is_above).map_or(0.0, |harmonic| harmonic.harmonics().at(direction).dot(normal(x)))
    };
    let square = |drawn: Option<Drawn>| {
        let rest = drawn.map_or(0.0, |drawn| (contribution(scene, x, &drawn) - control(&drawn)) / drawn.pdf);
        (known + rest - truth.total).powi(2)
    };
    (0..samples).map(|_| square(method.sample(x, pcg.uniform3()))).sum::<f64>() / samples as f64
}

/// The time of the irradiance of a portal.
fn nanoseconds(harmonic: &Harmonic, points: &[(ShadingPoint, Truth)], effort: &Effort) -> f64 {
    let calls = effort.calls.div_ceil(16);
    let time = || {
        let start = Instant::now();
        for i in 0..calls {
            core::hint::black_box(harmonic.irradiance(&points[i % points.len()].0, i % 2));
        }
        start.elapsed().as_secs_f64() * 1e9 / calls as f64
    };
    median((0..effort.repeats).map(|_| time()).collect())
}
