//! Mean of what samples bring over their density.

use fanlight::{Hit, LightSample, ShadingPoint};
use glam::DVec3;

use super::measure::Effort;
use super::rows::Row;
use crate::common::density::id;
use crate::common::lights::Point;
use crate::common::oracle;
use crate::common::pcg::Pcg32;

/// Independent sets of points, whose spread tells the error of their mean.
const SETS: usize = 32;
/// Standard errors of a mean of [`SETS`] sets that chance exceeds once in 200,000 times (Student's t).
pub(crate) const LIMIT: f64 = 5.5;
/// Resolution that is good enough to stop.
const RESOLVED: f64 = 2e-4;

/// Even points of the unit cube: multiples of the inverse powers of the generalized golden ratio.
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

/// Means with their standard errors.
pub(crate) struct Estimate {
    /// Mean of what samples bring over their density.
    pub(crate) mean: [f64; 2],
    /// Mean of the density over itself, which integrates it; by both techniques alone.
    pub(crate) integral: [f64; 2],
    pub(crate) none: [f64; 2],
    /// Samples that brought anything, of all sets.
    pub(crate) lit: usize,
    pub(crate) samples: usize,
}

/// What is summed over each set: [`Estimate`].
type Sums = [f64; 3];

/// Means over sets of points that grow until the spread is small. With `both` techniques, directions from all around
/// are the second one, and the balance heuristic (Veach and Guibas 1995) joins them.
pub(crate) fn estimate(
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
        let pdf = f64::from(at.pdf(&Hit::new(id((m, t)), near.map(|b| b as f32))));
        let sent = if row.ones { 1.0 } else { oracle::sent(&row.scene, m, t, [b1, b2], direction) };
        found.push(Crossing {
            brings: sent * oracle::cosine(&x.receiver, direction),
            pdf: pdf * (distance([b1, b2]) / distance(near)).powi(3),
        });
    }
    found
}

/// Variance of one sample relative to the square of the mean, as directions from all around find it.
pub(crate) fn relative_variance(row: &Row, at: &dyn Point, x: &ShadingPoint, pcg: &mut Pcg32) -> f64 {
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
    let (m, t) = (
        sample.hit().expect("a triangle").triangle.mesh.index() as usize,
        sample.hit().expect("a triangle").triangle.triangle as usize,
    );
    let b = sample.hit().expect("a triangle").barycentrics.map(f64::from);
    let [v0, v1, v2] = oracle::relative(&row.scene.meshes[m], t, x);
    let direction = (v0 * (1.0 - b[0] - b[1]) + v1 * b[0] + v2 * b[1]).normalize();
    let sent = if row.ones { 1.0 } else { oracle::sent(&row.scene, m, t, b, direction) };
    sent * oracle::cosine(&x.receiver, direction)
}

/// Where a ray crosses a triangle's plane, if it does.
pub(crate) fn crossing([a, b, c]: [DVec3; 3], direction: DVec3) -> Option<[f64; 2]> {
    let inner = |p: DVec3, q: DVec3| direction.dot(p.cross(q));
    let parts = [inner(b, c), inner(c, a), inner(a, b)];
    let total: f64 = parts.iter().sum();
    let distance = a.dot((b - a).cross(c - a)) / total;
    (total != 0.0 && distance > 0.0).then(|| [parts[1] / total, parts[2] / total])
}
