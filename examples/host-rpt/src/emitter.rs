//! The scene's emitters, and how `rpt` draws points on them by itself.

use rand::{Rng, rngs::StdRng};
use rpt::glm::{self, DVec3};
use rpt::{HitRecord, Ray, Shape};

/// Texels of an emitter's image.
pub(crate) const SIZE: [usize; 2] = [128, 64];

/// A mesh with an image of its radiance.
#[derive(Clone)]
pub(crate) struct Emitter {
    pub(crate) positions: Vec<DVec3>,
    pub(crate) uvs: Vec<[f32; 2]>,
    pub(crate) indices: Vec<[u32; 3]>,
    pub(crate) image: Vec<f32>,
}

impl Emitter {
    /// A grid of the given cells over the unit square, whose front is where `u` to `v` turns counter-clockwise.
    pub(crate) fn new(
        [columns, rows]: [u32; 2],
        position: impl Fn(f64, f64) -> DVec3,
        radiance: impl Fn(f32, f32) -> f32,
    ) -> Self {
        let place = |i: u32| (i % (columns + 1), i / (columns + 1));
        let uv = |i: u32| [f64::from(place(i).0) / f64::from(columns), f64::from(place(i).1) / f64::from(rows)];
        let vertices = (columns + 1) * (rows + 1);
        let cells = (0..vertices).filter(|&i| place(i).0 < columns && place(i).1 < rows);
        let texel = |i: usize| {
            let [u, v] = [(i % SIZE[0], SIZE[0]), (i / SIZE[0], SIZE[1])].map(|(i, n)| (i as f32 + 0.5) / n as f32);
            radiance(u, v)
        };
        Self {
            positions: (0..vertices).map(|i| position(uv(i)[0], uv(i)[1])).collect(),
            uvs: (0..vertices).map(|i| uv(i).map(|x| x as f32)).collect(),
            indices: cells.flat_map(|i| [[i, i + 1, i + columns + 2], [i, i + columns + 2, i + columns + 1]]).collect(),
            image: (0..SIZE[0] * SIZE[1]).map(texel).collect(),
        }
    }

    /// Radiance at a point of a triangle: the image, interpolated and repeated.
    pub(crate) fn radiance(&self, triangle: u32, [b1, b2]: [f32; 2]) -> f64 {
        let [uv0, uv1, uv2] = self.indices[triangle as usize].map(|i| self.uvs[i as usize]);
        let at = |k: usize| (uv0[k] + b1 * (uv1[k] - uv0[k]) + b2 * (uv2[k] - uv0[k])) * SIZE[k] as f32 - 0.5;
        let texel = |x: f32, y: f32| {
            let [x, y] = [(x, SIZE[0]), (y, SIZE[1])].map(|(i, n)| (i as i64).rem_euclid(n as i64) as usize);
            f64::from(self.image[y * SIZE[0] + x])
        };
        let (x, y) = (at(0), at(1));
        let (fx, fy) = (f64::from(x - x.floor()), f64::from(y - y.floor()));
        let row = |y: f32| texel(x.floor(), y) * (1.0 - fx) + texel(x.floor() + 1.0, y) * fx;
        row(y.floor()) * (1.0 - fy) + row(y.floor() + 1.0) * fy
    }
}

/// As `rpt` samples meshes: a triangle like any other, and a point like any other of it.
impl Shape for Emitter {
    fn intersect(&self, _: &Ray, _: f64, _: &mut HitRecord) -> bool {
        false
    }

    fn sample(&self, _: &DVec3, rng: &mut StdRng) -> (DVec3, DVec3, f64) {
        let triangle = rng.gen_range(0..self.indices.len());
        let [a, b, c] = self.indices[triangle].map(|i| self.positions[i as usize]);
        let root = rng.r#gen::<f64>().sqrt();
        let b2 = root * rng.r#gen::<f64>();
        let b1 = root - b2;
        let cross = glm::cross(&(b - a), &(c - a));
        let density = 2.0 / cross.norm() / self.indices.len() as f64;
        let radiance = self.radiance(triangle as u32, [b1 as f32, b2 as f32]);
        (a + b1 * (b - a) + b2 * (c - a), cross.normalize(), density / radiance)
    }
}
