//! Convex polygons that are cut along lines.

/// Most vertices that a polygon can have. A square that is cut twice along each of two lines has 8.
const CAPACITY: usize = 12;

/// A convex polygon in the plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Polygon {
    points: [[f64; 2]; CAPACITY],
    len: usize,
}

impl Polygon {
    const EMPTY: Self = Self { points: [[0.0; 2]; CAPACITY], len: 0 };

    /// The polygon with these vertices, in either sense of rotation.
    pub(super) fn new<const N: usize>(points: [[f64; 2]; N]) -> Self {
        const { assert!(N <= CAPACITY) };
        let mut polygon = Self { len: N, ..Self::EMPTY };
        polygon.points[..N].copy_from_slice(&points);
        polygon
    }

    pub(super) fn points(&self) -> &[[f64; 2]] {
        &self.points[..self.len]
    }

    /// Unsigned area.
    pub(super) fn area(&self) -> f64 {
        let points = self.points();
        let Some(&[ox, oy]) = points.first() else { return 0.0 };
        // Relative to a vertex: a polygon far from the origin loses no digits.
        let cross = |p: &[[f64; 2]]| (p[0][0] - ox) * (p[1][1] - oy) - (p[1][0] - ox) * (p[0][1] - oy);
        0.5 * points.windows(2).map(cross).sum::<f64>().abs()
    }

    /// The parts where `side`, a linear function of the point, is negative and where it is positive.
    #[inline]
    pub(super) fn split(&self, side: impl Fn([f64; 2]) -> f64) -> (Self, Self) {
        let (mut negative, mut positive) = (Self::EMPTY, Self::EMPTY);
        let Some(&last) = self.points().last() else { return (negative, positive) };
        let mut previous = (last, side(last));
        for &point in self.points() {
            let (p, s) = previous;
            let t = side(point);
            if s * t < 0.0 {
                let k = s / (s - t);
                let cut = [p[0] + k * (point[0] - p[0]), p[1] + k * (point[1] - p[1])];
                negative.push(cut);
                positive.push(cut);
            }
            if t <= 0.0 {
                negative.push(point);
            }
            if t >= 0.0 {
                positive.push(point);
            }
            previous = (point, t);
        }
        (negative, positive)
    }

    fn push(&mut self, point: [f64; 2]) {
        // Rounding can make a polygon that is thinner than a rounding error slightly concave, and let a line
        // cross it more than twice. Dropping a vertex of such a sliver loses nothing.
        if self.len < CAPACITY {
            self.points[self.len] = point;
            self.len += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_add_up() {
        let square = Polygon::new([[5.0, 7.0], [6.0, 7.0], [6.0, 8.0], [5.0, 8.0]]);
        let (below, above) = square.split(|[x, y]| x + y - 12.25);
        assert!((below.area() - 0.03125).abs() < 1e-15 && (above.area() - 0.96875).abs() < 1e-15);
        let (nothing, all) = square.split(|[x, _]| x - 5.0);
        assert_eq!((nothing.area(), all.area()), (0.0, 1.0));
        assert_eq!(Polygon::EMPTY.split(|[x, _]| x).0.area(), 0.0);
    }
}
