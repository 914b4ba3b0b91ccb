//! What one scene does at one shading point.

use fanlight::{Hit, LightSample, ShadingPoint};
use glam::DVec3;

use crate::columns;
use crate::common::density::{OnTriangle, id, probes};
use crate::common::lights::Point;
use crate::common::oracle;
use crate::common::pcg::Pcg32;
use crate::exact;
use crate::numbers::HOSTILE;
use crate::rows::Row;

/// Triangles that together have less probability than this are left out of an integral.
const NEGLIGIBLE: f64 = 1e-6;
/// Halvings of an edge down to which a density can vary.
const DEEPEST: u32 = 20;
/// Triangles of a large scene that are integrated over.
const SOME: usize = 8;
/// Independent sets of points, whose spread tells the error of their mean.
const SETS: usize = 32;
/// Standard errors of a mean of so many sets that chance exceeds once in 200,000 times (Student's t).
pub(crate) const LIMIT: f64 = 5.5;
/// Share of the unoccluded irradiance below which an estimate is not judged.
const DARK: f64 = 1e-6;
/// Relative variance of a sample above which directions from all around help.
const NOISY: f64 = 20.0;
/// Samples that bring anything below which their spread tells nothing.
const RARE: usize = 100;
/// Resolution that is good enough to stop.
const RESOLVED: f64 = 2e-4;

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
    /// Of the sum of all integrals and the rate of `None` against one.
    pub(crate) normalisation: f64,
    /// What the rate of `None` and the integration do not tell.
    pub(crate) normalisation_resolution: f64,
    pub(crate) agreement: f64,
    /// Of the mean estimate and [`LIMIT`] standard errors of it, if there is enough light.
    pub(crate) irradiance: Option<[f64; 2]>,
    /// Probability of `None`.
    pub(crate) none: f64,
    /// Whether every sample was `None`, and nothing arrives.
    pub(crate) dark: bool,
    /// Whether what counts is smaller than what barycentric coordinates of 24 bits tell apart.
    pub(crate) beyond: bool,
    /// Whether directions from all around helped.
    pub(crate) both: bool,
    pub(crate) samples: usize,
}

/// Even points of the unit cube: multiples of the inverse powers of the generalised golden ratio.
struct Even {
    start: [f64; 3],
}

impl Even {
    fn point(&self, i: usize) -> [f32; 3] {
        const GOLDEN: f64 = 1.220_744_084_605_759_5;
        core::array::from_fn(|k| {
            let step = GOLDEN.powi(-(k as i32 + 1));
            let u = (self.start[k] + step * i as f64).fract();
            ((u * 16_777_216.0) as u32).min(0xff_ffff) as f32 / 16_777_216.0
        })
    }
}

/// Everything about one cell. A sample that is no number is a panic.
pub(crate) fn measure(row: &Row, at: &dyn Point, x: &ShadingPoint, effort: Effort, seed: u64) -> Found {
    let mut pcg = Pcg32::new(seed, 62);
    let mut found = Found::default();
    let kept = agreement(row, at, x, effort, &mut pcg, &mut found);
    if effort.points == 0 {
        return found;
    }
    found.beyond = exact::is_beyond(&row.scene, x, row.detail);
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
    let (integral, error) =
        if is_many(row) { some(row, at, x, &kept, effort.cells) } else { all(row, at, x, &kept, effort.cells) };
    let unresolved = LIMIT * error;
    let (integral, unresolved) = if found.both && unresolved > LIMIT * estimate.integral[1] {
        (estimate.integral[0], LIMIT * estimate.integral[1])
    } else {
        (integral, unresolved)
    };
    found.normalisation = (integral + found.none - 1.0).abs();
    // Of a rate without an exception among n, an exception in 12 / n would be too likely to miss.
    let unseen = if found.none > 0.0 { 12.0 / estimate.samples as f64 } else { 0.0 };
    found.normalisation_resolution = unresolved + (LIMIT * estimate.none[1]).max(unseen);
    if found.none == 1.0 {
        assert!(integral == 0.0 || !found.dark, "{}: a density of {integral} without samples at {x:?}", row.name);
    }
    found
}

fn is_many(row: &Row) -> bool {
    row.scene.triangles().count() > 100
}

fn check_numbers(row: &Row, x: &ShadingPoint, sample: &LightSample) {
    let [b1, b2] = sample.hit.barycentrics;
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
    let directions = if is_many(row) { effort.directions.min(4) } else { effort.directions };
    for i in 0..effort.samples {
        let is_hostile = i % 8 == 0;
        let u = pcg.cube().map(|u| if is_hostile && pcg.below(2) == 0 { HOSTILE[pcg.below(HOSTILE.len())] } else { u });
        found.samples += 1;
        let Some(sample) = at.sample(u) else { continue };
        check_numbers(row, x, &sample);
        found.agreement = found.agreement.max(difference(at.pdf(&sample.hit), f64::from(sample.pdf)));
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
            sum += f64::from(at.pdf(&Hit { triangle: id((m, t)), barycentrics: [b1 as f32, b2 as f32] }));
        }
    }
    Some(sum)
}

/// Where a ray crosses a triangle's plane, if it does.
fn crossing([a, b, c]: [DVec3; 3], direction: DVec3) -> Option<[f64; 2]> {
    let inner = |p: DVec3, q: DVec3| direction.dot(p.cross(q));
    let parts = [inner(b, c), inner(c, a), inner(a, b)];
    let total: f64 = parts.iter().sum();
    let distance = a.dot((b - a).cross(c - a)) / total;
    (total != 0.0 && distance > 0.0).then(|| [parts[1] / total, parts[2] / total])
}

/// Means with their standard errors.
struct Estimate {
    /// Of what samples bring over their density.
    mean: [f64; 2],
    /// Of the density over itself, which integrates it; by both techniques alone.
    integral: [f64; 2],
    none: [f64; 2],
    /// Samples that brought anything, of all sets.
    lit: usize,
    samples: usize,
}

/// What is summed over each set: [`Estimate`].
type Sums = [f64; 3];

/// Means over sets of points that grow until the spread is small. With `both` techniques, directions from all around
/// are the second one, and the balance heuristic (Veach and Guibas 1995) joins them.
fn estimate(
    row: &Row,
    at: &dyn Point,
    x: &ShadingPoint,
    effort: Effort,
    pcg: &mut Pcg32,
    both: bool,
    exact: f64,
) -> Estimate {
    let starts: Vec<Even> =
        (0..SETS).map(|_| Even { start: core::array::from_fn(|_| f64::from(pcg.u32()) / 4_294_967_296.0) }).collect();
    let mut sums = [[0.0; 3]; SETS];
    let (mut done, mut next, mut lit) = (0, effort.points.min(64), 0);
    let around = if both { AROUND } else { 0.0 };
    loop {
        for (sum, even) in sums.iter_mut().zip(&starts) {
            for i in done..next {
                let u = even.point(i);
                match at.sample(u) {
                    Some(sample) => {
                        let pdf = f64::from(sample.pdf);
                        let brought = contribution(row, x, &sample) / (pdf + around);
                        lit += usize::from(brought > 0.0);
                        sum[0] += brought;
                        sum[1] += pdf / (pdf + around);
                    }
                    None => sum[2] += 1.0,
                }
                if both {
                    for Crossing { brings, pdf } in crossings(row, at, x, all_around([u[1], u[2]])) {
                        sum[0] += brings / (pdf + around);
                        sum[1] += pdf / (pdf + around);
                    }
                }
            }
        }
        done = next;
        let means: [_; 3] = core::array::from_fn(|k| statistics(sums.map(|sum: Sums| sum[k] / done as f64)));
        let [mean, integral, none] = means;
        let resolved = |[mean, error]: [f64; 2], scale: f64| LIMIT * error <= RESOLVED * scale || mean == 0.0;
        if done >= effort.points || (done >= 1024.min(effort.points) && resolved(mean, exact) && resolved(none, 0.2)) {
            return Estimate { mean, integral, none, lit, samples: SETS * done };
        }
        next = (2 * done).min(effort.points);
    }
}

/// Density of directions from all around.
const AROUND: f64 = 0.25 * core::f64::consts::FRAC_1_PI;

fn all_around([u, v]: [f32; 2]) -> DVec3 {
    let (z, phi) = (1.0 - 2.0 * f64::from(u), core::f64::consts::TAU * f64::from(v));
    let radius = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(radius * phi.cos(), radius * phi.sin(), z)
}

/// A point that a ray crosses.
struct Crossing {
    brings: f64,
    /// In the point itself, which may lie between those for which `pdf` is exact.
    pdf: f64,
}

fn crossings(row: &Row, at: &dyn Point, x: &ShadingPoint, direction: DVec3) -> Vec<Crossing> {
    let mut found = Vec::new();
    for (m, t) in row.scene.triangles() {
        let mesh = &row.scene.meshes[m];
        let vertices = oracle::relative(mesh, t, x);
        let Some([b1, b2]) = crossing(vertices, direction) else { continue };
        if !oracle::sends(vertices, mesh) || b1.min(b2).min(1.0 - b1 - b2) < 0.0 {
            continue;
        }
        let [a, b, c] = vertices;
        let distance = |[b1, b2]: [f64; 2]| (a * (1.0 - b1 - b2) + b * b1 + c * b2).length();
        let near = [b1, b2].map(|b| (b * 16_777_216.0).round() / 16_777_216.0);
        let pdf = f64::from(at.pdf(&Hit { triangle: id((m, t)), barycentrics: near.map(|b| b as f32) }));
        let sent = if row.ones { 1.0 } else { oracle::sent(&row.scene, m, t, [b1, b2], direction) };
        found.push(Crossing {
            brings: sent * oracle::cosine(&x.receiver, direction),
            pdf: pdf * (distance([b1, b2]) / distance(near)).powi(3),
        });
    }
    found
}

/// Variance of one sample relative to the square of the mean, as directions from all around find it.
fn relative_variance(row: &Row, at: &dyn Point, x: &ShadingPoint, pcg: &mut Pcg32) -> f64 {
    const DIRECTIONS: u32 = 256;
    let (mut first, mut second) = (0.0, 0.0);
    for _ in 0..DIRECTIONS {
        for Crossing { brings, pdf } in crossings(row, at, x, all_around([pcg.f32(), pcg.f32()])) {
            assert!(brings == 0.0 || pdf > 0.0, "{}: light without a density at {x:?}", row.name);
            first += brings;
            second += if brings > 0.0 { brings * brings / pdf } else { 0.0 };
        }
    }
    if first == 0.0 { 0.0 } else { second * f64::from(DIRECTIONS) / (first * first) * AROUND }
}

fn statistics(values: [f64; SETS]) -> [f64; 2] {
    let n = SETS as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / (n - 1.0);
    [mean, (square / n).sqrt()]
}

/// What the point of a sample sends, times the cosine.
fn contribution(row: &Row, x: &ShadingPoint, sample: &LightSample) -> f64 {
    let (m, t) = (sample.hit.triangle.mesh as usize, sample.hit.triangle.triangle as usize);
    let b = sample.hit.barycentrics.map(f64::from);
    let [v0, v1, v2] = oracle::relative(&row.scene.meshes[m], t, x);
    let direction = (v0 * (1.0 - b[0] - b[1]) + v1 * b[0] + v2 * b[1]).normalize();
    let sent = if row.ones { 1.0 } else { oracle::sent(&row.scene, m, t, b, direction) };
    sent * oracle::cosine(&x.receiver, direction)
}

fn over_triangle(
    row: &Row,
    at: &dyn Point,
    x: &ShadingPoint,
    triangle: (usize, usize),
    [depth, most]: [usize; 2],
    probes: &[[f32; 2]],
) -> (f64, f64) {
    let pdf = |hit: &Hit| f64::from(at.pdf(hit));
    let on = OnTriangle::new(&row.scene, triangle, x, &pdf).limits(DEEPEST, most);
    let (whole, open) = on.integrate(0, depth as u32, probes);
    (whole[0], open)
}

/// Integral of the density over all triangles, and its standard error.
fn all(row: &Row, at: &dyn Point, x: &ShadingPoint, kept: &[LightSample], cells: usize) -> (f64, f64) {
    let probes = probes(&row.scene, kept);
    // Suns are drawn beside the trees.
    let most = |(m, t): (usize, usize)| {
        let drawn = probes[m][t].len() as f64 / kept.len().max(1) as f64;
        f64::from(at.pmf(id((m, t)))).max(drawn)
    };
    let mut triangles: Vec<_> = row.scene.triangles().map(|t| (most(t), t)).collect();
    triangles.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut left: f64 = triangles.iter().map(|t| t.0).sum();
    let (mut sum, mut variance) = (0.0, 0.0);
    for (pmf, triangle) in triangles {
        if left < NEGLIGIBLE {
            break;
        }
        left -= pmf;
        let probes = &probes[triangle.0][triangle.1];
        let divisions = 30 + (cells as f64 * pmf) as usize;
        let over = |depth: usize| over_triangle(row, at, x, triangle, [depth, divisions], probes);
        let depth = if pmf > 0.05 { 5 } else { 1 };
        // What the first cells do not tell shows where there are more.
        let ((coarse, _), (fine, error)) = (over(depth - 1), over(depth));
        sum += fine;
        variance += error * error + (fine - coarse) * (fine - coarse);
    }
    (sum, variance.sqrt())
}

/// The sum of all triangles' probabilities, times what the integral over some that were drawn is of theirs.
fn some(row: &Row, at: &dyn Point, x: &ShadingPoint, kept: &[LightSample], cells: usize) -> (f64, f64) {
    let total: f64 = row.scene.triangles().map(|t| f64::from(at.pmf(id(t)))).sum();
    let some: Vec<_> = kept.iter().take(SOME).map(|sample| sample.hit.triangle).collect();
    let (mut ratio, mut variance) = (0.0, 0.0);
    for triangle in &some {
        let triangle = (triangle.mesh as usize, triangle.triangle as usize);
        let pmf = f64::from(at.pmf(id(triangle)));
        let over = |depth: usize| over_triangle(row, at, x, triangle, [depth, cells], &[]);
        let ((coarse, _), (fine, error)) = (over(2), over(3));
        ratio += fine / pmf;
        variance += (error * error + (fine - coarse) * (fine - coarse)) / (pmf * pmf);
    }
    let count = some.len().max(1) as f64;
    (if some.is_empty() { 0.0 } else { total * ratio / count }, total * variance.sqrt() / count)
}

/// A name for messages.
pub(crate) fn describe(row: &Row, column: usize, x: &ShadingPoint) -> String {
    format!("{}, {}, {}", row.name, columns::NAMES[column], columns::receiver_name(x))
}
