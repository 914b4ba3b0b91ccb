//! Convex polygons in the plane, and cutting them along lines (Sutherland and Hodgman 1974).

use core::ops::{Add, Mul, Sub};

/// A number that coordinates are made of: `f32` where shading points wait for the result, `f64` where trees are built.
pub(crate) trait Coordinate:
    Copy
    + PartialOrd
    + Default
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + core::ops::Div<Output = Self>
{
}

impl Coordinate for f32 {}
impl Coordinate for f64 {}

/// A convex polygon of up to `CAPACITY` vertices, in either sense of rotation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Polygon<C, const CAPACITY: usize> {
    vertices: [[C; 2]; CAPACITY],
    len: usize,
}

impl<C: Coordinate, const CAPACITY: usize> Polygon<C, CAPACITY> {
    /// The polygon without vertices.
    #[inline]
    pub(crate) fn empty() -> Self {
        Self { vertices: [[C::default(); 2]; CAPACITY], len: 0 }
    }

    /// The polygon with these vertices.
    #[inline]
    pub(crate) fn new<const COUNT: usize>(vertices: [[C; 2]; COUNT]) -> Self {
        const { assert!(COUNT <= CAPACITY) };
        let mut polygon = Self { len: COUNT, ..Self::empty() };
        polygon.vertices[..COUNT].copy_from_slice(&vertices);
        polygon
    }

    /// Returns the vertices in order.
    #[inline]
    pub(crate) fn vertices(&self) -> &[[C; 2]] {
        &self.vertices[..self.len]
    }

    /// Returns the part where `side`, a linear function of the point, is not negative.
    #[inline]
    pub(crate) fn clip(&self, side: impl Fn([C; 2]) -> C) -> Self {
        let zero = C::default();
        let mut out = Self::empty();
        self.for_each_edge(side, |(a, da), (b, db)| {
            if (da < zero) != (db < zero) {
                out.push(crossing((a, da), (b, db)));
            }
            if db >= zero {
                out.push(b);
            }
        });
        out
    }

    /// Visits the ends of every edge, each with its value of `side`. The first edge ends at the first vertex.
    #[inline(always)]
    fn for_each_edge(&self, side: impl Fn([C; 2]) -> C, mut visit: impl FnMut(([C; 2], C), ([C; 2], C))) {
        let vertices = self.vertices();
        let Some(&last) = vertices.last() else { return };
        let mut from = (last, side(last));
        for &vertex in vertices {
            let to = (vertex, side(vertex));
            visit(from, to);
            from = to;
        }
    }

    #[inline]
    fn push(&mut self, vertex: [C; 2]) {
        // Rounding can make a polygon that is thinner than a rounding error slightly concave, and let a line cross it
        // more than twice. Dropping a vertex of such a sliver loses nothing.
        if self.len < CAPACITY {
            self.vertices[self.len] = vertex;
            self.len += 1;
        }
    }

    /// Returns the triangles of the fan around the first vertex, each with twice its signed area.
    #[inline]
    pub(crate) fn fan(&self) -> impl Iterator<Item = ([[C; 2]; 3], C)> {
        (2..self.len).map(|i| {
            let [a, b, c] = self.fan_triangle(i - 2);
            // Relative to a vertex: a polygon far from the origin loses no digits.
            ([a, b, c], (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
        })
    }

    /// Returns one triangle of the fan. There are at most `CAPACITY - 2`; vertices that the polygon does not have are
    /// the origin or left over.
    #[inline]
    pub(crate) fn fan_triangle(&self, index: usize) -> [[C; 2]; 3] {
        [self.vertices[0], self.vertices[index + 1], self.vertices[index + 2]]
    }
}

/// Returns the point of an edge where a linear function is zero that has these values at its ends.
#[inline(always)]
fn crossing<C: Coordinate>((a, da): ([C; 2], C), (b, db): ([C; 2], C)) -> [C; 2] {
    let k = da / (da - db);
    [a[0] + k * (b[0] - a[0]), a[1] + k * (b[1] - a[1])]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(polygon: Polygon<f64, 12>) -> f64 {
        0.5 * polygon.fan().map(|(_, double)| double).sum::<f64>()
    }

    #[test]
    fn clipped_area() {
        let triangle = Polygon::new([[0.0, 0.0], [4.0, 0.0], [0.0, 4.0]]);
        let strip = |polygon: Polygon<f64, 12>, axis: usize, lo: f64, hi: f64| {
            polygon.clip(|point| point[axis] - lo).clip(|point| hi - point[axis])
        };
        assert_eq!(area(triangle), 8.0);
        assert_eq!(area(strip(triangle, 0, 1.0, 2.0)), 2.5);
        assert_eq!(area(strip(strip(triangle, 0, 1.0, 2.0), 1, 0.0, 1.0)), 1.0);
        assert_eq!(area(strip(triangle, 1, 5.0, 6.0)), 0.0);
        assert_eq!(area(triangle.clip(|[x, y]| x + y - 2.0)), 6.0);
    }
}
