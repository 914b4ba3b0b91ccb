//! Integrals of a density over triangles, from the outside: nothing is known but values of `pdf` at points, and that
//! the density per area is constant over dyadic barycentric cells of a depth that is not known.

use fanlight::{Hit, LightSample, ShadingPoint, TriangleId};
use glam::DVec3;

use super::pcg::Pcg32;
use super::scene::Scene;

/// Cells are not divided further, unless a test asks for it. What is left is the difference between neighbours over
/// 4^-13 of a triangle.
const DEEPEST: u32 = 13;

/// Barycentric coordinates that every density is exact for are multiples of this.
const STEP: f64 = 1.0 / (1 << 24) as f64;

pub(crate) fn id((mesh, triangle): (usize, usize)) -> TriangleId {
    TriangleId { mesh: mesh as u32, triangle: triangle as u32 }
}

/// From here on cells are so small that four equal values settle them.
const DEEPEST_DOUBT: u32 = 8;

/// One triangle from one shading point.
pub(crate) struct OnTriangle<'a> {
    id: TriangleId,
    vertices: [DVec3; 3],
    /// Times the triangle's area, over the distance cubed: from solid angle to the unit of the triangle.
    height_area: f64,
    deepest: u32,
    most: usize,
    pdf: &'a dyn Fn(&Hit) -> f64,
}

impl<'a> OnTriangle<'a> {
    pub(crate) fn new(scene: &Scene, triangle: (usize, usize), x: &ShadingPoint, pdf: &'a dyn Fn(&Hit) -> f64) -> Self {
        let origin = x.position.as_dvec3();
        let vertices = scene.meshes[triangle.0].vertices(triangle.1).map(|v| v.as_dvec3() - origin);
        let [a, b, c] = vertices;
        // |n·a| / |n| · |n| / 2.
        let height_area = 0.5 * (b - a).cross(c - a).dot(a).abs();
        Self { id: id(triangle), vertices, height_area, deepest: DEEPEST, most: usize::MAX, pdf }
    }

    /// Divides cells so often if need be, but not more than so many of them. What is left undivided is looked at in
    /// random places, and what [`Self::integrate`] says of it is a standard error.
    pub(crate) fn limits(self, deepest: u32, most: usize) -> Self {
        Self { deepest, most, ..self }
    }

    /// Density in units of one over the triangle's area.
    fn density(&self, b: [f64; 2]) -> f64 {
        // Next to the shading point, rounding would be felt.
        let barycentrics = b.map(|b| ((b / STEP).round() * STEP) as f32);
        let pdf = (self.pdf)(&Hit { triangle: self.id, barycentrics });
        if pdf == 0.0 {
            return 0.0;
        }
        let [b1, b2] = barycentrics.map(f64::from);
        let [v0, v1, v2] = self.vertices;
        let distance = (v0 * (1.0 - b1 - b2) + v1 * b1 + v2 * b2).length();
        pdf * self.height_area / distance.powi(3)
    }

    /// Integrals over the cells of a depth, in the order of [`bin`]. Cells are divided as long as the density differs
    /// inside of them: between the middles of their quarters, of the quarters of these, or at one of the `probes`.
    /// Probes only tell where to look closer; samples do well. Second, the most that cells which were too small to
    /// divide can be wrong by.
    pub(crate) fn integrate(&self, bin_depth: u32, least_depth: u32, probes: &[[f32; 2]]) -> (Vec<f64>, f64) {
        let mut bins = vec![0.0; 1 << (2 * bin_depth)];
        let probes = probes.iter().map(|b| (b.map(f64::from), self.density(b.map(f64::from)))).collect();
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let pcg = Pcg32::new(self.id.triangle.into(), 63);
        let mut walk = Walk {
            pcg,
            on: self,
            bins: &mut bins,
            bin_depth,
            least_depth: least_depth.max(bin_depth),
            divided: 0,
            unresolved: 0.0,
            variance: 0.0,
        };
        walk.visit(corners, 0, 0, probes);
        let unresolved = if self.most == usize::MAX { walk.unresolved } else { walk.variance.sqrt() };
        (bins, unresolved)
    }
}

struct Walk<'a, 'b> {
    on: &'a OnTriangle<'b>,
    bins: &'a mut [f64],
    bin_depth: u32,
    least_depth: u32,
    divided: usize,
    unresolved: f64,
    variance: f64,
    pcg: Pcg32,
}

impl Walk<'_, '_> {
    fn visit(&mut self, corners: [[f64; 2]; 3], depth: u32, bin: usize, probes: Vec<([f64; 2], f64)>) {
        let quarters: [_; 4] = core::array::from_fn(|i| quarter(corners, i));
        if depth >= self.least_depth {
            let values = quarters.map(|q| self.on.density(middle(q)));
            // Averages are rounded, so that four can be the same by chance: then their quarters must be, too.
            let mut parts = Vec::new();
            if depth < DEEPEST_DOUBT && values.iter().all(|v| (v - values[0]).abs() <= 1e-4 * v) {
                let of_quarter = |q| (0..4).map(move |i| middle(quarter(q, i)));
                parts.extend(quarters.into_iter().flat_map(of_quarter).map(|b| self.on.density(b)));
            }
            // A horizon may leave no more than a tip of a cell.
            if self.on.most < usize::MAX && values.iter().all(|v| (v - values[0]).abs() <= 1e-4 * v) {
                let tips = (0..3).map(|k| self.on.density(tip(corners, k)));
                parts.extend(tips);
            }
            let all = || values.iter().chain(&parts).copied().chain(probes.iter().map(|p| p.1));
            let (low, high) = all().fold((f64::INFINITY, 0.0f64), |(low, high), v| (low.min(v), high.max(v)));
            if high - low <= 1e-4 * high || depth >= self.on.deepest || self.divided >= self.on.most {
                let share = 0.25f64.powi(depth as i32);
                if high - low > 1e-4 * high {
                    self.unresolved += share * (high - low);
                    if self.on.most < usize::MAX {
                        // Samples that fell where the random places may miss what they show.
                        if !probes.is_empty() {
                            self.variance += (0.25 * share * (high - low)).powi(2);
                        }
                        self.bins[bin] += share * self.at_random(quarters, share);
                        return;
                    }
                }
                self.bins[bin] += share * values.iter().sum::<f64>() / 4.0;
                return;
            }
        }
        self.divided += 1;
        let mut parts: [Vec<([f64; 2], f64)>; 4] = Default::default();
        for (b, value) in probes {
            let (i, local) = step(b);
            parts[i].push((local, value));
        }
        for (i, (corners, probes)) in quarters.into_iter().zip(parts).enumerate() {
            let bin = if depth < self.bin_depth { 4 * bin + i } else { bin };
            self.visit(corners, depth + 1, bin, probes);
        }
    }
}

impl Walk<'_, '_> {
    /// Mean over random places, two in each quarter of a cell of this share.
    fn at_random(&mut self, quarters: [[[f64; 2]; 3]; 4], share: f64) -> f64 {
        let mut sum = 0.0;
        for [a, b, c] in quarters {
            let [first, second] = [(); 2].map(|()| {
                let [u, v] = [self.pcg.f32(), self.pcg.f32()].map(f64::from);
                let [s, t] = if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] };
                self.on.density(core::array::from_fn(|i| a[i] + (b[i] - a[i]) * s + (c[i] - a[i]) * t))
            });
            sum += first + second;
            // Of the mean of the two, with the share of a quarter.
            self.variance += (share * (first - second)).powi(2) / 64.0;
        }
        sum / 8.0
    }
}

fn middle([a, b, c]: [[f64; 2]; 3]) -> [f64; 2] {
    core::array::from_fn(|i| (a[i] + b[i] + c[i]) / 3.0)
}

/// A point near one of the corners.
fn tip(corners: [[f64; 2]; 3], k: usize) -> [f64; 2] {
    let middle = middle(corners);
    core::array::from_fn(|i| corners[k][i] + 0.06 * (middle[i] - corners[k][i]))
}

/// One of the four similar parts of a barycentric triangle. The last one is the inverted one in the middle.
fn quarter(corners: [[f64; 2]; 3], i: usize) -> [[f64; 2]; 3] {
    let half = |a: [f64; 2], b: [f64; 2]| [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
    let [a, b, c] = corners;
    match i {
        0 => [a, half(a, b), half(a, c)],
        1 => [half(a, b), b, half(b, c)],
        2 => [half(a, c), half(b, c), c],
        _ => [half(b, c), half(a, c), half(a, b)],
    }
}

/// The quarter that holds a point, and the point in the quarter's own barycentrics.
fn step([b1, b2]: [f64; 2]) -> (usize, [f64; 2]) {
    if b1 >= 0.5 {
        (1, [2.0 * b1 - 1.0, 2.0 * b2])
    } else if b2 >= 0.5 {
        (2, [2.0 * b1, 2.0 * b2 - 1.0])
    } else if b1 + b2 <= 0.5 {
        (0, [2.0 * b1, 2.0 * b2])
    } else {
        (3, [1.0 - 2.0 * b1, 1.0 - 2.0 * b2])
    }
}

/// The cell of a depth that holds a point.
pub(crate) fn bin(barycentrics: [f32; 2], depth: u32) -> usize {
    let mut b = barycentrics.map(f64::from);
    (0..depth).fold(0, |bin, _| {
        let (i, local) = step(b);
        b = local;
        4 * bin + i
    })
}

/// Where samples fell, by triangle, to guide the integration.
pub(crate) fn probes(scene: &Scene, samples: &[LightSample]) -> Vec<Vec<Vec<[f32; 2]>>> {
    let mut probes: Vec<_> = scene.meshes.iter().map(|mesh| vec![Vec::new(); mesh.indices.len()]).collect();
    for sample in samples {
        let hit = sample.hit;
        probes[hit.triangle.mesh as usize][hit.triangle.triangle as usize].push(hit.barycentrics);
    }
    probes
}
