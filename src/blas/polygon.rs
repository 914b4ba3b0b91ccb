//! Small convex polygons: clipping to a strip, area, and exact integrals of bilinear functions.

/// A convex polygon of up to [`MAX_VERTICES`] vertices.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Polygon {
    vertices: [[f64; 2]; MAX_VERTICES],
    len: usize,
}

/// A triangle cut by four lines has at most seven vertices; rounding could add one at each cut.
const MAX_VERTICES: usize = 12;

impl Polygon {
    /// The triangle itself.
    pub(crate) fn triangle(corners: [[f64; 2]; 3]) -> Self {
        let mut vertices = [[0.0; 2]; MAX_VERTICES];
        vertices[..3].copy_from_slice(&corners);
        Self { vertices, len: 3 }
    }

    /// The vertices in order.
    pub(crate) fn vertices(&self) -> &[[f64; 2]] {
        &self.vertices[..self.len]
    }

    /// The part between two parallels: `lo <= coordinate <= hi` along axis 0 or 1.
    pub(crate) fn clip(&self, axis: usize, lo: f64, hi: f64) -> Self {
        let (mut min, mut max) = (f64::INFINITY, f64::NEG_INFINITY);
        for v in self.vertices() {
            min = min.min(v[axis]);
            max = max.max(v[axis]);
        }
        let mut out = *self;
        if min < lo {
            out = out.half_plane(axis, lo, 1.0);
        }
        if max > hi {
            out = out.half_plane(axis, hi, -1.0);
        }
        out
    }

    /// Sutherland and Hodgman's step: what lies on the side of the line where `sign * (coordinate - at)` is positive.
    fn half_plane(&self, axis: usize, at: f64, sign: f64) -> Self {
        let mut out = Self { vertices: [[0.0; 2]; MAX_VERTICES], len: 0 };
        let Some(mut a) = self.vertices().last().copied() else { return out };
        let mut da = sign * (a[axis] - at);
        for &b in self.vertices() {
            let db = sign * (b[axis] - at);
            if (da < 0.0) != (db < 0.0) {
                let t = da / (da - db);
                let mut cut = [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
                cut[axis] = at;
                out.push(cut);
            }
            if db >= 0.0 {
                out.push(b);
            }
            (a, da) = (b, db);
        }
        out
    }

    fn push(&mut self, vertex: [f64; 2]) {
        // More would mean that the polygon was not convex.
        if self.len < MAX_VERTICES {
            self.vertices[self.len] = vertex;
            self.len += 1;
        }
    }

    /// The triangles of a fan, each with its area.
    fn fan(&self) -> impl Iterator<Item = ([[f64; 2]; 3], f64)> {
        let v = self.vertices();
        (2..self.len).map(move |i| {
            let [a, b, c] = [v[0], v[i - 1], v[i]];
            let double = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            ([a, b, c], 0.5 * double.abs())
        })
    }

    /// Area, not negative.
    pub(crate) fn area(&self) -> f64 {
        self.fan().map(|(_, area)| area).sum()
    }

    /// Integrals of the four bilinear weights `(1-x)(1-y)`, `x(1-y)`, `(1-x)y`, `xy` of the unit square at `corner`,
    /// over this polygon inside of it.
    ///
    /// The weights are quadratic, so that the rule of the three edge midpoints is exact on each triangle of a fan.
    pub(crate) fn bilinear_weights(&self, corner: [f64; 2]) -> [f64; 4] {
        let mut weights = [0.0; 4];
        for ([a, b, c], area) in self.fan() {
            for (p, q) in [(a, b), (b, c), (c, a)] {
                let x = 0.5 * (p[0] + q[0]) - corner[0];
                let y = 0.5 * (p[1] + q[1]) - corner[1];
                let third = area / 3.0;
                weights[0] += third * (1.0 - x) * (1.0 - y);
                weights[1] += third * x * (1.0 - y);
                weights[2] += third * (1.0 - x) * y;
                weights[3] += third * x * y;
            }
        }
        // Rounding at the rim could leave a weight just below zero.
        weights.map(|w| w.max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clipped_area() {
        let triangle = Polygon::triangle([[0.0, 0.0], [4.0, 0.0], [0.0, 4.0]]);
        assert_eq!(triangle.area(), 8.0);
        assert_eq!(triangle.clip(0, 1.0, 2.0).area(), 2.5);
        assert_eq!(triangle.clip(0, 1.0, 2.0).clip(1, 0.0, 1.0).area(), 1.0);
        assert_eq!(triangle.clip(1, 5.0, 6.0).area(), 0.0);
    }

    #[test]
    fn weights_of_a_half_square() {
        let half = Polygon::triangle([[2.0, 3.0], [3.0, 3.0], [2.0, 4.0]]);
        let [w00, w10, w01, w11] = half.bilinear_weights([2.0, 3.0]);
        assert!((w11 - 1.0 / 24.0).abs() < 1e-15);
        assert!((w10 - 1.0 / 8.0).abs() < 1e-15 && (w01 - 1.0 / 8.0).abs() < 1e-15);
        assert!((w00 + w10 + w01 + w11 - 0.5).abs() < 1e-15);
    }
}
