//! What variances at many points come to, and the exact variance of the choice of a triangle.

use fanlight::ShadingPoint;

use crate::methods::Method;
use crate::oracle::{Class, Truth};
use crate::variance::Measured;

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

/// Evaluates the choice of a triangle; `None` if the method makes none.
pub(crate) fn select(method: &dyn Method, x: &ShadingPoint, truth: &Truth) -> Option<Selection> {
    if truth.class == Class::Sun && method.draws_suns_apart() {
        return None;
    }
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
pub(crate) fn summary(variances: impl Iterator<Item = (f64, f64)>) -> Option<Summary> {
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

/// Summary of measurements, their mean rate of zeros, and the largest share that is lost.
pub(crate) fn summarize(points: &[Measured], wanted: impl Fn(Class) -> bool) -> Option<(Summary, f64, f64)> {
    let points: Vec<&Measured> = points.iter().filter(|point| wanted(point.class)).collect();
    let zeros = points.iter().map(|point| point.zeros).sum::<f64>() / points.len() as f64;
    let lost = points.iter().fold(0.0, |most: f64, point| most.max(point.lost));
    summary(points.iter().map(|point| (point.variance, point.e2))).map(|summary| (summary, zeros, lost))
}

/// Summary of selections, and the largest share that is lost.
pub(crate) fn summarize_selection(points: &[Selection], wanted: impl Fn(Class) -> bool) -> Option<(Summary, f64)> {
    let points: Vec<&Selection> = points.iter().filter(|point| wanted(point.class)).collect();
    let lost = points.iter().fold(0.0, |most: f64, point| most.max(point.lost));
    summary(points.iter().map(|point| (point.variance, point.e2))).map(|summary| (summary, lost))
}
