//! Integrals of a density over triangles, from the outside: nothing is known but values of `pdf` at points, and that
//! either the density per area is constant over dyadic barycentric cells of a depth that is not known, or that per
//! solid angle over cells of any shape, or that per area linear over the triangle, but for what is added in places.

use fanlight::{Hit, LightSample, MeshId, ShadingPoint, TriangleId};
use glam::DVec3;

use super::pcg::Pcg32;
use super::scene::Scene;

/// Cells are not divided further, unless a test asks for it. What is left is the difference between neighbors over
/// 4^-13 of a triangle.
const DEEPEST: u32 = 13;

/// Where the density per solid angle is constant over cells, those whose integral is less in doubt are not divided
/// either: edges of cells by solid angle cross all others, at any depth.
const NEGLIGIBLE_DOUBT: f64 = 5e-7;

/// Barycentric coordinates that every density is exact for are multiples of this.
const STEP: f64 = 1.0 / (1 << 24) as f64;

pub(crate) fn id((mesh, triangle): (usize, usize)) -> TriangleId {
    TriangleId::new(MeshId::from_index(mesh as u32), triangle as u32)
}

/// From here on cells are so small that four equal values settle them.
const DEEPEST_DOUBT: u32 = 8;

/// Cells with more probability are divided, however equal the density looks: what little they hide would count.
const HEAVY: f64 = 2e-5;

/// Number of points, of 16, that must lie on a linear function.
const MOST: usize = 12;

mod walk;

use walk::{Cell, Open, Walk};

/// A density at a point.
#[derive(Clone, Copy, Debug, Default)]
struct Density {
    /// Per solid angle.
    pdf: f64,
    /// From solid angle to the unit of the triangle.
    scale: f64,
    /// What a density that is linear over the triangle has here above its mean.
    slope: f64,
}

impl Density {
    /// In units of one over the triangle's area.
    fn by_area(self) -> f64 {
        self.pdf * self.scale
    }

    /// Density in units of one over the triangle's area, without the slope of the triangle's density.
    fn level(self) -> f64 {
        self.by_area() - self.slope
    }
}

/// One triangle from one shading point.
pub(crate) struct OnTriangle<'a> {
    id: TriangleId,
    vertices: [DVec3; 3],
    /// Times the triangle's area, over the distance cubed: from solid angle to the unit of the triangle.
    height_area: f64,
    is_by_angle: bool,
    /// What a density that is linear over the triangle has above its mean in the three corners.
    slope: [f64; 3],
    /// Factor on [`HEAVY`] and [`NEGLIGIBLE_DOUBT`].
    coarser: f64,
    deepest: u32,
    most: usize,
    enough: f64,
    pdf: &'a dyn Fn(&Hit) -> f64,
}

impl<'a> OnTriangle<'a> {
    pub(crate) fn new(scene: &Scene, triangle: (usize, usize), x: &ShadingPoint, pdf: &'a dyn Fn(&Hit) -> f64) -> Self {
        let origin = x.position.as_dvec3();
        let vertices = scene.meshes[triangle.0].vertices(triangle.1).map(|v| v.as_dvec3() - origin);
        let [a, b, c] = vertices;
        // |n·a| / |n| · |n| / 2.
        let height_area = 0.5 * (b - a).cross(c - a).dot(a).abs();
        let (deepest, most, enough) = (DEEPEST, usize::MAX, 0.0);
        let on = Self {
            id: id(triangle),
            vertices,
            height_area,
            is_by_angle: false,
            slope: [0.0; 3],
            coarser: 1.0,
            deepest,
            most,
            enough,
            pdf,
        };
        let slope = on.find_slope().unwrap_or_default();
        Self { is_by_angle: on.is_constant_by_angle(), slope, ..on }
    }

    /// Divides cells up to `deepest` times, but not more than `most` of them, and none where all that is in doubt is
    /// `enough`. What is left undivided is looked at in random places, and what [`Self::integrate`] says of it is a
    /// standard error.
    pub(crate) fn limits(self, deepest: u32, most: usize, enough: f64) -> Self {
        Self { deepest, most, enough, ..self }
    }

    /// Leaves cells undivided that are `factor` times as probable, or as much in doubt, whichever way the
    /// density is constant.
    pub(crate) fn coarser(self, factor: f64) -> Self {
        Self { coarser: factor, ..self }
    }

    /// Whether neighboring points have the same density per solid angle rather than per area: a majority of pairs.
    fn is_constant_by_angle(&self) -> bool {
        let mut pcg = Pcg32::new(self.id.triangle.into(), 62);
        let is_same = |a: f64, b: f64| (a - b).abs() <= 1e-5 * a.max(b);
        let mut votes = 0;
        for _ in 0..16 {
            let [u, v] = [pcg.f32(), pcg.f32()].map(|u| 0.001 + 0.498 * f64::from(u));
            let pair = [[u, v], [u + 1e-4, v + 5e-5]].map(|b| self.density(b));
            let by_angle = is_same(pair[0].pdf, pair[1].pdf);
            let by_area = is_same(pair[0].by_area(), pair[1].by_area());
            votes += i32::from(by_angle) - i32::from(by_area);
        }
        votes > 0
    }

    /// The slope of the linear function that the density per area follows in most of the triangle, if there is one.
    fn find_slope(&self) -> Option<[f64; 3]> {
        let mut pcg = Pcg32::new(self.id.triangle.into(), 64);
        let mut point = || {
            let [u, v] = [pcg.f32(), pcg.f32()].map(|u| 0.001 + 0.998 * f64::from(u));
            if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] }
        };
        let known: Vec<([f64; 2], f64)> =
            [(); 16].iter().map(|()| point()).map(|b| (b, self.density(b).by_area())).collect();
        known.windows(3).find_map(|window| {
            let [(p, f), (q, g), (r, h)] = [window[0], window[1], window[2]];
            let (e, d) = ([q[0] - p[0], q[1] - p[1]], [r[0] - p[0], r[1] - p[1]]);
            let determinant = e[0] * d[1] - e[1] * d[0];
            let slopes =
                [((g - f) * d[1] - (h - f) * e[1]) / determinant, ((h - f) * e[0] - (g - f) * d[0]) / determinant];
            let at = |b: [f64; 2]| f + slopes[0] * (b[0] - p[0]) + slopes[1] * (b[1] - p[1]);
            let fits = known.iter().filter(|(b, value)| *value > 0.0 && (at(*b) - value).abs() <= 2e-5 * value).count();
            let is_level = slopes.iter().all(|slope| slope.abs() <= 1e-3 * f);
            let mean = at([1.0 / 3.0, 1.0 / 3.0]);
            (determinant.abs() > 0.05 && fits >= MOST && !is_level)
                .then(|| [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|corner| at(corner) - mean))
        })
    }

    /// The density at a point.
    fn density(&self, b: [f64; 2]) -> Density {
        // Next to the shading point, rounding would be felt.
        let barycentrics = b.map(|b| ((b / STEP).round() * STEP) as f32);
        let [b1, b2] = barycentrics.map(f64::from);
        let [v0, v1, v2] = self.vertices;
        let distance = (v0 * (1.0 - b1 - b2) + v1 * b1 + v2 * b2).length();
        let scale = self.height_area / distance.powi(3);
        let pdf = (self.pdf)(&Hit::new(self.id, barycentrics));
        let [s0, s1, s2] = self.slope;
        let slope = s0 * (1.0 - b1 - b2) + s1 * b1 + s2 * b2;
        if distance > 0.0 { Density { pdf, scale, slope } } else { Density::default() }
    }

    /// Solid angle of a barycentric triangle with this share of the area.
    fn solid_angle(&self, corners: [[f64; 2]; 3], share: f64) -> f64 {
        let [v0, v1, v2] = self.vertices;
        let [a, b, c] = corners.map(|[b1, b2]| (v0 * (1.0 - b1 - b2) + v1 * b1 + v2 * b2).normalize_or_zero());
        let lengths = corners.map(|[b1, b2]| (v0 * (1.0 - b1 - b2) + v1 * b1 + v2 * b2).length());
        let triple = 2.0 * self.height_area * share / lengths.iter().product::<f64>();
        let angle = 2.0 * triple.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a));
        if angle.is_finite() { angle } else { 0.0 }
    }

    /// Integrals over the cells of a depth, in the order of [`bin`]. Cells are divided as long as the density differs
    /// inside of them: between the middles of their quarters, of the quarters of these, or at one of the `probes`;
    /// those that matter most come first. Probes only tell where to look closer; samples do well. Second, what cells
    /// which were too small to divide can be wrong by, five standard errors.
    pub(crate) fn integrate(&self, bin_depth: u32, least_depth: u32, probes: &[[f32; 2]]) -> (Vec<f64>, f64) {
        let probes = probes.iter().map(|b| (b.map(f64::from), self.density(b.map(f64::from)))).collect();
        let mut walk = Walk::new(self, bin_depth, least_depth);
        walk.look_at(Cell { corners: [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], depth: 0, bin: 0, probes });
        let mut divided = 0;
        while let Some(Open { key, cell, range, values }) = walk.open.pop() {
            if divided < self.most && walk.doubt > self.enough {
                divided += 1;
                walk.doubt -= key;
                walk.divide(cell);
            } else {
                walk.settle(&cell, range, &values);
            }
        }
        let unresolved = if self.is_limited() { walk.variance.sqrt() } else { 5.0 * walk.variance.sqrt() };
        (walk.bins, unresolved)
    }

    fn is_limited(&self) -> bool {
        self.most < usize::MAX
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
        let hit = sample.hit().expect("a triangle");
        probes[hit.triangle.mesh.index() as usize][hit.triangle.triangle as usize].push(hit.barycentrics);
    }
    probes
}
