//! What one scene does at one shading point.

use fanlight::{Hit, LightSample, LightSampler, ShadingPoint};
use glam::DVec3;

use super::columns;
use super::estimate::{LIMIT, crossing, estimate, relative_variance};
use super::exact;
use super::integral;
use super::numbers::HOSTILE;
use super::rows::Row;
use crate::common::density::id;
use crate::common::lights::Point;
use crate::common::oracle;
use crate::common::pcg::Pcg32;

/// Share of the unoccluded irradiance below which an estimate is not judged.
const DARK: f64 = 1e-6;
/// Relative variance of a sample above which directions from all around help.
const NOISY: f64 = 20.0;
/// Samples that bring anything below which their spread tells nothing.
const RARE: usize = 100;

/// Steps of a barycentric coordinate below which nothing is told apart.
const TOO_FEW: f64 = 16.0;

/// How much is done.
#[derive(Clone, Copy)]
pub(crate) struct Effort {
    /// Most points of each set; without any, densities are looked up alone.
    pub(crate) points: usize,
    /// Samples whose densities are looked up again.
    pub(crate) samples: usize,
    /// Samples whose directions are, too.
    pub(crate) directions: usize,
    /// Cells that a triangle is divided into for the integral over it.
    pub(crate) cells: usize,
}

/// Relative errors.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Found {
    /// Error of the sum of all integrals and the rate of `None`, which should be one.
    pub(crate) normalization: f64,
    /// What the rate of `None` and the integration do not tell.
    pub(crate) normalization_resolution: f64,
    pub(crate) agreement: f64,
    /// Error of the mean estimate, and [`LIMIT`] standard errors of it, if there is enough light.
    pub(crate) irradiance: Option<[f64; 2]>,
    /// Probability of `None`.
    pub(crate) none: f64,
    /// Whether every sample was `None`, and nothing arrives.
    pub(crate) dark: bool,
    /// Whether what counts is smaller than what barycentric coordinates of 24 bits tell apart.
    pub(crate) beyond: bool,
    /// What of it is lost where its rim is rounded.
    pub(crate) rounding: f64,
    /// Whether directions from all around helped.
    pub(crate) both: bool,
    pub(crate) samples: usize,
}

/// Everything about one cell. A sample that is no number is a panic. The estimates are those of a host without a lobe
/// at `x`, which `guide` may have.
pub(crate) fn measure(
    (row, lights): (&Row, &LightSampler),
    at: &dyn Point,
    [x, guide]: [&ShadingPoint; 2],
    effort: Effort,
    seed: u64,
) -> Found {
    let mut pcg = Pcg32::new(seed, 62);
    let mut found = Found::default();
    let kept = agreement(row, at, x, effort, &mut pcg, &mut found);
    if effort.points == 0 {
        return found;
    }
    let steps = exact::steps(&row.scene, x, row.detail);
    (found.beyond, found.rounding) = (steps < TOO_FEW, 1.0 / steps);
    let exact = exact::irradiance(&row.scene, x, row.ones);
    found.both = !is_many(row) && relative_variance(row, at, x, &mut pcg) > NOISY;
    let estimate = estimate(row, at, x, effort, &mut pcg, found.both, exact.arriving);
    found.samples += estimate.samples;
    found.none = estimate.none[0];
    if exact.arriving > DARK * exact.unoccluded {
        let error = (estimate.mean[0] / exact.arriving - 1.0).abs();
        let rare = if estimate.lit < RARE && !found.both { 1.0 } else { 0.0 };
        found.irradiance = Some([error, LIMIT * estimate.mean[1] / exact.arriving + rare]);
    } else if exact.arriving == 0.0 {
        assert_eq!(estimate.mean[0], 0.0, "{}: light where there is none at {x:?}", row.name);
    }
    found.dark = exact.arriving == 0.0 && found.none == 1.0;
    let (integral, error) = if is_many(row) {
        integral::some((row, lights), at, guide, &kept, effort.cells)
    } else {
        integral::all(row, at, x, &kept, effort.cells)
    };
    let unresolved = LIMIT * error;
    let (integral, unresolved) = if found.both && unresolved > LIMIT * estimate.integral[1] {
        (estimate.integral[0], LIMIT * estimate.integral[1])
    } else {
        (integral, unresolved)
    };
    found.normalization = (integral + found.none - 1.0).abs();
    // Where n samples had no exception, a rate of 12 / n would hardly have been missed.
    let unseen = if found.none > 0.0 { 12.0 / estimate.samples as f64 } else { 0.0 };
    found.normalization_resolution = unresolved + (LIMIT * estimate.none[1]).max(unseen);
    if found.none == 1.0 {
        assert!(integral == 0.0 || !found.dark, "{}: a density of {integral} without samples at {x:?}", row.name);
    }
    found
}

fn is_many(row: &Row) -> bool {
    row.scene.triangles().count() > 100
}

fn check_numbers(row: &Row, x: &ShadingPoint, sample: &LightSample) {
    let [b1, b2] = sample.hit().expect("a triangle").barycentrics;
    let vectors = sample.position.is_finite() && sample.direction.is_normalized() && sample.normal.is_normalized();
    let positive = [sample.pdf, sample.pdf_area, sample.pmf, sample.distance].iter().all(|v| *v > 0.0 && v.is_finite());
    let inside = b1 >= 0.0 && b2 >= 0.0 && b1 + b2 <= 1.0;
    assert!(vectors && positive && inside, "{}: {sample:?} at {x:?}", row.name);
}

fn difference(a: f32, b: f64) -> f64 {
    let (a, largest) = (f64::from(a), f64::from(a).max(b));
    assert!(a.is_finite() && a >= 0.0, "a density of {a}");
    if largest == 0.0 { 0.0 } else { (a - b).abs() / largest }
}

/// Draws samples with ordinary and hostile numbers, and looks them up again. Returns some.
fn agreement(
    row: &Row,
    at: &dyn Point,
    x: &ShadingPoint,
    effort: Effort,
    pcg: &mut Pcg32,
    found: &mut Found,
) -> Vec<LightSample> {
    let mut kept = Vec::new();
    // Each may cross all of the triangles.
    let directions = if row.large {
        1
    } else if is_many(row) {
        effort.directions.min(4)
    } else {
        effort.directions
    };
    for i in 0..effort.samples {
        let is_hostile = i % 8 == 0;
        let u = pcg.cube().map(|u| if is_hostile && pcg.below(2) == 0 { HOSTILE[pcg.below(HOSTILE.len())] } else { u });
        found.samples += 1;
        let Some(sample) = at.sample(u) else { continue };
        check_numbers(row, x, &sample);
        found.agreement =
            found.agreement.max(difference(at.pdf(&sample.hit().expect("a triangle")), f64::from(sample.pdf)));
        if i < directions {
            let along = at.pdf_sample_direction(&sample);
            assert!(along >= sample.pdf && along.is_finite(), "{}: {along} along {sample:?}", row.name);
            if let Some(sum) = over_hits(row, at, x, sample.direction.as_dvec3()) {
                let difference = difference(at.pdf_direction(sample.direction), sum);
                found.agreement = found.agreement.max(difference);
            }
        }
        kept.push(sample);
    }
    kept
}

/// Sum of the densities of all points that a ray crosses, found one by one. `None` if it is not clear, by rounding,
/// whether it crosses a triangle.
fn over_hits(row: &Row, at: &dyn Point, x: &ShadingPoint, direction: DVec3) -> Option<f64> {
    const RIM: f64 = 1e-9;
    let mut sum = 0.0;
    for (m, t) in row.scene.triangles() {
        let vertices = oracle::relative(&row.scene.meshes[m], t, x);
        let Some([b1, b2]) = crossing(vertices, direction) else { continue };
        let least = b1.min(b2).min(1.0 - b1 - b2);
        if least.abs() < RIM {
            return None;
        }
        if least > 0.0 {
            sum += f64::from(at.pdf(&Hit::new(id((m, t)), [b1 as f32, b2 as f32])));
        }
    }
    Some(sum)
}

/// A name for messages.
pub(crate) fn describe(row: &Row, column: usize, x: &ShadingPoint) -> String {
    format!("{}, {}, {}", row.name, columns::NAMES[column], columns::receiver_name(x))
}
