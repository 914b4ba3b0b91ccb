//! Variance of a method at many points.

use fanlight::ShadingPoint;

use crate::methods::{Drawn, Method};
use crate::oracle::{Class, Truth};
use crate::scenes::Scene;
use crate::scenes::pcg::Pcg32;

/// What was measured at one point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Measured {
    pub(crate) class: Class,
    /// Squared irradiance.
    e2: f64,
    /// Variance of the one-sample estimate.
    variance: f64,
    /// Share of samples that carry nothing.
    zeros: f64,
}

/// The exact variance of the choice of a triangle at one point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Selection {
    pub(crate) class: Class,
    e2: f64,
    variance: f64,
    /// Share of the irradiance from lights that cannot be chosen.
    lost: f64,
}

/// Median, 90th percentile and energy-weighted mean of a relative variance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Summary {
    pub(crate) median: f64,
    pub(crate) p90: f64,
    pub(crate) energy_weighted: f64,
}

/// Samples a method at a point whose irradiance is positive. The variance is the mean squared difference from the
/// true irradiance, so that a bias counts as well.
pub(crate) fn measure(
    scene: &Scene,
    method: &dyn Method,
    x: &ShadingPoint,
    truth: &Truth,
    samples: usize,
    seed: u64,
) -> Measured {
    let mut pcg = Pcg32::new(seed, 5);
    let (mut squares, mut zeros) = (0.0, 0);
    for _ in 0..samples {
        let estimate = method.sample(x, pcg.uniform3()).map_or(0.0, |drawn| contribution(scene, x, &drawn) / drawn.pdf);
        zeros += usize::from(estimate == 0.0);
        let error = estimate - truth.total;
        squares += error * error;
    }
    let n = samples as f64;
    Measured {
        class: truth.class,
        e2: truth.total * truth.total,
        variance: squares / n,
        zeros: f64::from(zeros as u32) / n,
    }
}

/// Radiance from a direction times the cosine.
pub(crate) fn contribution(scene: &Scene, x: &ShadingPoint, drawn: &Drawn) -> f64 {
    let cosine = f64::from(x.cosine(drawn.direction));
    if cosine == 0.0 {
        return 0.0;
    }
    let Some(sky) = &scene.sky else {
        return cosine * scene.weight(drawn.light, drawn.barycentrics.map(f64::from));
    };
    match scene.transmittance(x.position.as_dvec3(), drawn.direction.as_dvec3()) {
        0.0 => 0.0,
        transmittance => {
            let radiance = drawn.radiance.unwrap_or_else(|| f64::from(sky.environment.radiance(drawn.direction)));
            cosine * transmittance * radiance
        }
    }
}

/// Evaluates the choice of a triangle; `None` if the method makes none.
pub(crate) fn select(method: &dyn Method, x: &ShadingPoint, truth: &Truth) -> Option<Selection> {
    let pmfs = method.pmfs(x, &|light| truth.by_light[light] > 0.0)?;
    let (mut second_moment, mut lost) = (0.0, 0.0);
    for (&irradiance, &pmf) in truth.by_light.iter().zip(&pmfs) {
        if irradiance > 0.0 && pmf > 0.0 {
            second_moment += irradiance * irradiance / pmf;
        } else {
            lost += irradiance;
        }
    }
    let e2 = truth.total * truth.total;
    Some(Selection { class: truth.class, e2, variance: second_moment - e2, lost: lost / truth.total })
}

/// Relative variances, and the energies and variances behind them, in one.
fn summary(variances: impl Iterator<Item = (f64, f64)>) -> Option<Summary> {
    let (mut variance_sum, mut e2_sum) = (0.0, 0.0);
    let mut relative: Vec<f64> = variances
        .map(|(variance, e2)| {
            variance_sum += variance;
            e2_sum += e2;
            variance / e2
        })
        .collect();
    relative.sort_by(f64::total_cmp);
    let at = |share: f64| relative.get((share * relative.len() as f64) as usize).copied();
    Some(Summary { median: at(0.5)?, p90: at(0.9)?, energy_weighted: variance_sum / e2_sum })
}

/// Summary of measurements, and their mean rate of zeros.
pub(crate) fn summarise(points: &[Measured], wanted: impl Fn(Class) -> bool) -> Option<(Summary, f64)> {
    let points: Vec<&Measured> = points.iter().filter(|point| wanted(point.class)).collect();
    let zeros = points.iter().map(|point| point.zeros).sum::<f64>() / points.len() as f64;
    summary(points.iter().map(|point| (point.variance, point.e2))).map(|summary| (summary, zeros))
}

/// Summary of selections, and the largest share that is lost.
pub(crate) fn summarise_selection(points: &[Selection], wanted: impl Fn(Class) -> bool) -> Option<(Summary, f64)> {
    let points: Vec<&Selection> = points.iter().filter(|point| wanted(point.class)).collect();
    let lost = points.iter().fold(0.0, |most: f64, point| most.max(point.lost));
    summary(points.iter().map(|point| (point.variance, point.e2))).map(|summary| (summary, lost))
}
