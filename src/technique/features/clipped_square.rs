//! What lines leave over of a square, in single precision.

use crate::geometry::Polygon;
use crate::warp::triangle::square_to_triangle;
use crate::warp::{Variate, pick, sum};

/// A square that is cut by three lines has at most seven vertices; rounding could add one.
const SQUARE_CAPACITY: usize = 8;

/// The convex rest of a square.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClippedSquare(Polygon<f32, SQUARE_CAPACITY>);

impl ClippedSquare {
    /// The square of unit side around the origin.
    pub(super) fn whole() -> Self {
        Self(Polygon::new([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]))
    }

    /// The part where `c + s x + t y` is not negative.
    #[inline]
    pub(super) fn clip(&self, [c, s, t]: [f32; 3]) -> Self {
        Self(self.0.clip(|[x, y]| c + s * x + t * y))
    }

    /// Areas of the triangles of the fan around the first vertex.
    #[inline]
    fn fan(&self) -> [f32; SQUARE_CAPACITY - 2] {
        let mut areas = [0.0; SQUARE_CAPACITY - 2];
        for (area, (_, double)) in areas.iter_mut().zip(self.0.fan()) {
            *area = (0.5 * double).max(0.0);
        }
        areas
    }

    /// Area.
    #[inline]
    pub(super) fn area(&self) -> f32 {
        self.fan().iter().sum()
    }

    /// Whether a point lies inside, or outside by no more than a margin.
    #[cfg(test)]
    pub(super) fn holds(&self, [x, y]: [f32; 2], slack: f32) -> bool {
        let vertices = self.0.vertices();
        let edges = (0..vertices.len()).map(|i| (vertices[i], vertices[(i + 1) % vertices.len()]));
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
        let [[x, y], b, c] = self.0.fan_triangle(chosen);
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
