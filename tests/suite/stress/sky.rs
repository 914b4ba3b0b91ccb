//! Irradiance from a latitude-longitude image through a polygon, in double precision.
//!
//! Along a parallel each plane through the viewer, of an edge of the polygon or of the horizon, bounds an arc, and the
//! integral over an arc is one of sines and cosines. So only one of the two integrals is a sum over points.

use core::f64::consts::{PI, TAU};

use fanlight::Receiver;
use glam::DVec3;

use crate::common::scene::{Scene, Sky};

/// Parallels that are summed over, at least.
const PARALLELS: usize = 1 << 15;

/// Radiance of a sky that is the same everywhere.
pub(crate) fn constant(scene: &Scene) -> f64 {
    match &scene.sky {
        Sky::Constant(radiance) => f64::from(*radiance),
        Sky::LatLong { .. } => panic!("the sky has pixels"),
    }
}

/// The image of a scene's sky.
pub(crate) struct Rows<'a> {
    size: [usize; 2],
    texels: &'a [f32],
    to_local: glam::DMat3,
    /// Cosine and sine of the left ends of the columns.
    columns: Vec<[f64; 2]>,
    /// Up to each column of the current row, the integrals of the radiance times one, cosine and sine.
    sums: Vec<[f64; 3]>,
}

impl<'a> Rows<'a> {
    pub(crate) fn new(scene: &'a Scene) -> Option<Self> {
        let Sky::LatLong { size, texels } = &scene.sky else { return None };
        let end = |i: usize| TAU * i as f64 / size[0] as f64;
        Some(Self {
            size: *size,
            texels,
            to_local: scene.rotation.as_dmat3().transpose(),
            columns: (0..=size[0]).map(|i| [end(i).cos(), end(i).sin()]).collect(),
            sums: Vec::new(),
        })
    }

    /// Integral of radiance times cosine over the directions through a convex polygon.
    pub(crate) fn over(&mut self, polygon: &[DVec3], receiver: &Receiver) -> f64 {
        match *receiver {
            Receiver::Surface(normal) => self.above(polygon, Some(normal.as_dvec3())),
            Receiver::Transmissive(normal) => {
                self.above(polygon, Some(normal.as_dvec3())) + self.above(polygon, Some(-normal.as_dvec3()))
            }
            Receiver::Volume => self.above(polygon, None),
            other => unreachable!("{other:?} is none of the three receivers"),
        }
    }

    /// The part above the horizon of a normal, if there is one.
    fn above(&mut self, polygon: &[DVec3], normal: Option<DVec3>) -> f64 {
        let corners: Vec<DVec3> = polygon.iter().map(|v| (self.to_local * *v).normalize()).collect();
        let normal = normal.map(|normal| self.to_local * normal);
        let count = corners.len();
        let plane = |i: usize| {
            let plane = corners[i].cross(corners[(i + 1) % count]);
            if plane.dot(corners[(i + 2) % count]) < 0.0 { -plane } else { plane }
        };
        let planes: Vec<DVec3> = (0..count).map(plane).chain(normal).collect();
        let along_axes = normal.unwrap_or(DVec3::ZERO);
        let height = self.size[1];
        let step = PI / height as f64;
        let [low, high] = heights(&corners);
        let (first, last) = ((low / step) as usize, ((high / step) as usize).min(height - 1));
        let points = PARALLELS.div_ceil(last + 1 - first);
        let mut total = 0.0;
        for row in first..=last {
            if !self.sum_row(row) {
                continue;
            }
            let (start, end) = (low.max(row as f64 * step), high.min((row + 1) as f64 * step));
            let mut sum = 0.0;
            for point in 0..points {
                let (sin, cos) = (start + (end - start) * (point as f64 + 0.5) / points as f64).sin_cos();
                let plain_weight = normal.map_or(1.0, |normal| normal.z * cos);
                arcs(&planes, sin, cos, |from, to| {
                    let [plain, along, across] = self.between(row, from, to);
                    sum += sin * (plain_weight * plain + sin * (along_axes.x * along - along_axes.y * across));
                });
            }
            total += sum * (end - start) / points as f64;
        }
        total
    }

    /// Whether anything is lit in a row.
    fn sum_row(&mut self, row: usize) -> bool {
        let width = self.size[0];
        if self.texels[row * width..][..width].iter().all(|radiance| *radiance == 0.0) {
            return false;
        }
        let step = TAU / width as f64;
        self.sums.clear();
        let mut sum = [0.0; 3];
        self.sums.push(sum);
        for i in 0..width {
            let radiance = f64::from(self.texels[row * width + i]);
            let ([cos, sin], [next_cos, next_sin]) = (self.columns[i], self.columns[i + 1]);
            sum[0] += radiance * step;
            sum[1] += radiance * (next_sin - sin);
            sum[2] += radiance * (cos - next_cos);
            self.sums.push(sum);
        }
        true
    }

    /// Integrals of radiance times one, cosine and sine over an arc of the current row.
    fn between(&self, row: usize, from: f64, to: f64) -> [f64; 3] {
        let (a, b) = (self.up_to(row, from), self.up_to(row, to));
        core::array::from_fn(|i| b[i] - a[i])
    }

    fn up_to(&self, row: usize, phi: f64) -> [f64; 3] {
        let width = self.size[0];
        let column = ((phi / TAU * width as f64) as usize).min(width - 1);
        let radiance = f64::from(self.texels[row * width + column]);
        let ([cos, sin], [before, along, across]) = (self.columns[column], self.sums[column]);
        let (next_sin, next_cos) = phi.sin_cos();
        let start = TAU * column as f64 / width as f64;
        [before + radiance * (phi - start), along + radiance * (next_sin - sin), across + radiance * (cos - next_cos)]
    }
}

/// Angles from the pole between which a polygon lies for certain.
fn heights(corners: &[DVec3]) -> [f64; 2] {
    let middle = corners.iter().sum::<DVec3>().normalize_or_zero();
    let radius =
        corners.iter().map(|corner| middle.cross(*corner).length().atan2(middle.dot(*corner))).fold(0.0, f64::max);
    // A larger one may not lie within the circle around its corners.
    if !(radius < 1.0) {
        return [0.0, PI];
    }
    let angle = middle.x.hypot(middle.y).atan2(middle.z);
    [(angle - radius).max(0.0), (angle + radius).min(PI)]
}

/// Calls `visit` with the ends of all arcs of a parallel, within a turn, that are on the positive side of all planes.
fn arcs(planes: &[DVec3], sin: f64, cos: f64, mut visit: impl FnMut(f64, f64)) {
    let mut ends = [0.0; 16];
    let mut count = 1;
    for plane in planes {
        let reach = sin * plane.x.hypot(plane.y);
        let level = -plane.z * cos;
        if level >= reach {
            return;
        }
        if level > -reach {
            // The image's azimuth runs clockwise.
            let (center, half) = ((-plane.y).atan2(plane.x), (level / reach).acos());
            for end in [center - half, center + half] {
                ends[count] = end.rem_euclid(TAU);
                count += 1;
            }
        }
    }
    ends[count] = TAU;
    let ends = &mut ends[..=count];
    ends.sort_by(f64::total_cmp);
    for pair in ends.windows(2) {
        let middle = 0.5 * (pair[0] + pair[1]);
        let direction = DVec3::new(sin * middle.cos(), -sin * middle.sin(), cos);
        if pair[1] > pair[0] && planes.iter().all(|plane| plane.dot(direction) >= 0.0) {
            visit(pair[0], pair[1]);
        }
    }
}
