//! Integrals of the density over all triangles.

use fanlight::{Hit, LightSample, LightSampler, ShadingPoint};

use super::rows::Row;
use crate::common::density::{OnTriangle, id, probes};
use crate::common::lights::Point;
use crate::common::parallel;

/// Triangles that together have less probability than this are left out of an integral.
const NEGLIGIBLE: f64 = 1e-6;
/// Share of a triangle's probability that may stay in doubt.
const ENOUGH: f64 = 1e-5;
/// Halvings of an edge down to which a density can vary.
const DEEPEST: u32 = 20;
/// Triangles of a large scene that are integrated over.
const SOME: usize = 8;
/// Triangles that a thread takes at a time.
const CHUNK: usize = 4096;

fn over_triangle(
    row: &Row,
    at: &dyn Point,
    x: &ShadingPoint,
    triangle: (usize, usize),
    [depth, most]: [usize; 2],
    enough: f64,
    probes: &[[f32; 2]],
) -> (f64, f64) {
    let pdf = |hit: &Hit| f64::from(at.pdf(hit));
    let on = OnTriangle::new(&row.scene, triangle, x, &pdf).limits(DEEPEST, most, enough);
    let (whole, open) = on.integrate(0, depth as u32, probes);
    (whole[0], open)
}

/// Integral of the density over all triangles, and its standard error.
pub(crate) fn all(row: &Row, at: &dyn Point, x: &ShadingPoint, kept: &[LightSample], cells: usize) -> (f64, f64) {
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
        let over = |depth: usize| over_triangle(row, at, x, triangle, [depth, divisions], ENOUGH * pmf, probes);
        let depth = if pmf > 0.05 { 5 } else { 1 };
        // What the first cells do not tell shows where there are more.
        let ((coarse, _), (fine, error)) = (over(depth - 1), over(depth));
        sum += fine;
        variance += error * error + (fine - coarse) * (fine - coarse);
    }
    (sum, variance.sqrt())
}

/// The sum of all triangles' probabilities, times what the integral over some that were drawn is of theirs.
pub(crate) fn some(
    (row, lights): (&Row, &LightSampler),
    at: &dyn Point,
    x: &ShadingPoint,
    kept: &[LightSample],
    cells: usize,
) -> (f64, f64) {
    let triangles: Vec<_> = row.scene.triangles().collect();
    let chunks: Vec<_> = triangles.chunks(CHUNK).collect();
    let sum = |chunk: &[(usize, usize)]| {
        let at = lights.at(x);
        chunk.iter().map(|&t| f64::from(at.pmf(id(t)))).sum::<f64>()
    };
    let total: f64 = parallel::map(chunks.len(), |i| sum(chunks[i])).iter().sum();
    let some: Vec<_> = kept.iter().take(SOME).map(|sample| sample.hit().expect("a triangle").triangle).collect();
    let (mut ratio, mut variance) = (0.0, 0.0);
    for triangle in &some {
        let triangle = (triangle.mesh.index() as usize, triangle.triangle as usize);
        let pmf = f64::from(at.pmf(id(triangle)));
        let over = |depth: usize| over_triangle(row, at, x, triangle, [depth, cells], ENOUGH * pmf, &[]);
        let ((coarse, _), (fine, error)) = (over(2), over(3));
        ratio += fine / pmf;
        variance += (error * error + (fine - coarse) * (fine - coarse)) / (pmf * pmf);
    }
    let count = some.len().max(1) as f64;
    (if some.is_empty() { 0.0 } else { total * ratio / count }, total * variance.sqrt() / count)
}
