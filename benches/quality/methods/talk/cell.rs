//! A cell of a triangle's barycentric domain, cut into four.

use core::f32::consts::PI;

use glam::Vec3;

/// A cell after a number of cuts.
#[derive(Clone, Copy)]
pub(super) struct Cell {
    /// Relative to the shading point.
    vertices: [Vec3; 3],
    /// Places of the vertices on the triangle.
    places: [[f64; 2]; 3],
    pub(super) depth: u32,
    /// Number among all cells of its depth; four children follow each other.
    pub(super) index: usize,
}

/// How a cell is seen from the shading point.
pub(super) struct Footprint {
    pub(super) direction: Vec3,
    pub(super) distance2: f32,
    /// At the light.
    pub(super) cosine: f32,
    pub(super) solid_angle: f32,
}

impl Cell {
    pub(super) fn root(vertices: [Vec3; 3]) -> Self {
        Self { vertices, places: [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], depth: 0, index: 0 }
    }

    /// One at each corner, and the one between them.
    pub(super) fn children(&self) -> [Self; 4] {
        let middle = |i: usize, j: usize| {
            let place = [0, 1].map(|axis| 0.5 * (self.places[i][axis] + self.places[j][axis]));
            (0.5 * (self.vertices[i] + self.vertices[j]), place)
        };
        let corner = |i: usize| (self.vertices[i], self.places[i]);
        let (ab, bc, ca) = (middle(0, 1), middle(1, 2), middle(2, 0));
        let corners = [[corner(0), ab, ca], [ab, corner(1), bc], [ca, bc, corner(2)], [bc, ca, ab]];
        core::array::from_fn(|i| Self {
            vertices: corners[i].map(|(vertex, _)| vertex),
            places: corners[i].map(|(_, place)| place),
            depth: self.depth + 1,
            index: 4 * self.index + i,
        })
    }

    pub(super) fn footprint(&self) -> Footprint {
        let [a, b, c] = self.vertices;
        let center = (a + b + c) / 3.0;
        let distance2 = center.length_squared().max(f32::MIN_POSITIVE);
        let direction = center / distance2.sqrt();
        let cross = (b - a).cross(c - a);
        let seen = cross.dot(direction).abs();
        let cosine = seen / cross.length().max(f32::MIN_POSITIVE);
        Footprint { direction, distance2, cosine, solid_angle: (0.5 * seen / distance2).min(4.0 * PI) }
    }

    /// How many such cells make up the triangle.
    pub(super) fn parts(&self) -> f64 {
        f64::from(4.0_f32.powi(self.depth as i32))
    }

    /// Place on the triangle of a place on the cell.
    pub(super) fn place(&self, [s, t]: [f64; 2]) -> [f64; 2] {
        let [a, b, c] = self.places;
        [0, 1].map(|axis| a[axis] + (b[axis] - a[axis]) * s + (c[axis] - a[axis]) * t)
    }
}

/// The child that holds a point; takes its three barycentrics to that child's.
pub(super) fn follow(local: &mut [f64; 3]) -> usize {
    match local.iter().position(|b| *b >= 0.5) {
        Some(corner) => {
            *local = local.map(|b| 2.0 * b);
            local[corner] -= 1.0;
            corner
        }
        None => {
            *local = local.map(|b| 1.0 - 2.0 * b);
            3
        }
    }
}
