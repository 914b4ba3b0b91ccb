//! What lines leave over of a square. In single precision, for shading points; building has its own polygons.

use crate::warp::triangle::square_to_triangle;
use crate::warp::{Variate, pick, sum};

/// A square that is cut by three lines has at most seven vertices; rounding could add one.
const CAPACITY: usize = 8;

/// The convex rest of a square.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClippedSquare {
    vertices: [[f32; 2]; CAPACITY],
    len: usize,
}

impl ClippedSquare {
    /// The square of unit side around the origin.
    pub(super) fn whole() -> Self {
        let mut vertices = [[0.0; 2]; CAPACITY];
        vertices[..4].copy_from_slice(&[[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]);
        Self { vertices, len: 4 }
    }

    /// The part where `c + s x + t y` is not negative (Sutherland and Hodgman 1974).
    #[inline]
    pub(super) fn clip(&self, [c, s, t]: [f32; 3]) -> Self {
        let mut out = Self { vertices: [[0.0; 2]; CAPACITY], len: 0 };
        let side = |[x, y]: [f32; 2]| c + s * x + t * y;
        let vertices = &self.vertices[..self.len];
        let Some(&last) = vertices.last() else { return out };
        let (mut a, mut da) = (last, side(last));
        for &b in vertices {
            let db = side(b);
            if (da < 0.0) != (db < 0.0) {
                let k = da / (da - db);
                out.push([a[0] + k * (b[0] - a[0]), a[1] + k * (b[1] - a[1])]);
            }
            if db >= 0.0 {
                out.push(b);
            }
            (a, da) = (b, db);
        }
        out
    }

    #[inline]
    fn push(&mut self, vertex: [f32; 2]) {
        if self.len < CAPACITY {
            self.vertices[self.len] = vertex;
            self.len += 1;
        }
    }

    /// Areas of the triangles of the fan around the first vertex.
    #[inline]
    fn fan(&self) -> [f32; CAPACITY - 2] {
        let [x, y] = self.vertices[0];
        let mut areas = [0.0; CAPACITY - 2];
        for (area, i) in areas.iter_mut().zip(2..self.len) {
            let ([bx, by], [cx, cy]) = (self.vertices[i - 1], self.vertices[i]);
            *area = (0.5 * ((bx - x) * (cy - y) - (by - y) * (cx - x))).max(0.0);
        }
        areas
    }

    /// Area.
    #[inline]
    pub(super) fn area(&self) -> f32 {
        self.fan().iter().sum()
    }

    /// Whether a point lies inside, or outside by no more than so much.
    #[cfg(test)]
    pub(super) fn holds(&self, [x, y]: [f32; 2], slack: f32) -> bool {
        let edges = (0..self.len).map(|i| (self.vertices[i], self.vertices[(i + 1) % self.len]));
        let left = |(a, b): ([f32; 2], [f32; 2])| {
            let [dx, dy] = [b[0] - a[0], b[1] - a[1]];
            dx * (y - a[1]) - dy * (x - a[0]) >= -slack * (dx * dx + dy * dy).sqrt()
        };
        { edges }.all(left)
    }

    /// A uniform point.
    pub(super) fn sample(&self, mut u: [Variate; 2]) -> [f32; 2] {
        let areas = self.fan();
        let chosen = pick(&areas, sum(&areas), &mut u[0]);
        let [b1, b2] = square_to_triangle(u.map(|u| u.value())).map(|b| b as f32);
        let [[x, y], b, c] = [self.vertices[0], self.vertices[chosen + 1], self.vertices[chosen + 2]];
        [x + b1 * (b[0] - x) + b2 * (c[0] - x), y + b1 * (b[1] - y) + b2 * (c[1] - y)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Pcg32;

    #[test]
    fn clipped_areas_and_points() {
        let corner = ClippedSquare::whole().clip([0.25, -1.0, -1.0]);
        assert!((corner.area() - (1.0 - 0.5 * 0.75 * 0.75)).abs() < 1e-6);
        assert_eq!(ClippedSquare::whole().clip([-2.0, 1.0, 1.0]).area(), 0.0);
        let mut pcg = Pcg32::new(1, 77);
        let mut left = 0;
        for i in 0..20_000 {
            let u = [Variate::new(pcg.next_f32(), i), Variate::new(pcg.next_f32(), !i)];
            let [x, y] = corner.sample(u);
            assert!(x + y <= 0.250_001 && x.abs() <= 0.5 && y.abs() <= 0.5);
            left += u32::from(x < 0.0);
        }
        // The left half is cut in its upper right corner, by 0.25² / 2.
        let expected = 20_000.0 * (0.5 - 0.031_25) / f64::from(corner.area());
        assert!((f64::from(left) - expected).abs() < 5.0 * 70.0, "{left} {expected}");
    }
}
