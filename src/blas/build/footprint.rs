//! The part of the texture plane under a cell: a triangle in texels.

use glam::Vec2;

use crate::blas::barycentric::{LATTICE, LatticeCell};
use crate::blas::build::texture::Texture;
use crate::error::{Error, ErrorKind};
use crate::math::{floor_to_i64, sqrt64};

/// Texture coordinates may be this large. *Proved*: up to here texel indices stay exact, and beyond it an `f32` cannot
/// tell the texels of a larger image apart anyway.
pub(crate) const UV_LIMIT: f32 = 1e5;

/// Checks the texture coordinates of one vertex of a mesh.
pub(crate) fn check_uv(mesh: usize, vertex: usize, uv: Vec2) -> Result<(), Error> {
    // NaN fails the comparison.
    if uv.x.abs() <= UV_LIMIT && uv.y.abs() <= UV_LIMIT {
        Ok(())
    } else {
        Err(Error(ErrorKind::TextureCoordinate { mesh, vertex, value: uv.to_array(), limit: UV_LIMIT }))
    }
}

/// A triangle's texture coordinates, in texels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UvTriangle {
    corners: [[f64; 2]; 3],
    /// How far off, in texels and along each axis, a host may look because it interpolates in `f32`.
    slack: [f64; 2],
}

impl UvTriangle {
    /// `uv` is within [`UV_LIMIT`].
    pub(crate) fn new(texture: &Texture<'_>, uv: [Vec2; 3]) -> Self {
        let size = texture.size().map(f64::from);
        let corners = uv.map(|uv| [f64::from(uv.x) * size[0], f64::from(uv.y) * size[1]]);
        // b0 uv0 + b1 uv1 + b2 uv2 rounds five times, each barycentric coordinate once or twice, the product with the
        // size once: within 16 half units in the last place of the largest coordinate.
        let slack = core::array::from_fn(|k| {
            let largest = corners.iter().fold(0.0f64, |m, c| m.max(c[k].abs()));
            largest / f64::from(1 << 20) + 1e-6
        });
        Self { corners, slack }
    }

    /// Twice the area and the square of the longest edge, in texels: a cell of depth `d` has `4^-d` of both.
    pub(crate) fn extent(&self) -> (f64, f64) {
        let [a, b, c] = self.corners;
        let edge = |p: [f64; 2], q: [f64; 2]| [q[0] - p[0], q[1] - p[1]];
        let (e0, e1, e2) = (edge(a, b), edge(a, c), edge(b, c));
        let square = |e: [f64; 2]| e[0] * e[0] + e[1] * e[1];
        ((e0[0] * e1[1] - e0[1] * e1[0]).abs(), square(e0).max(square(e1)).max(square(e2)))
    }

    /// Area, or length where that is more, in texels.
    pub(crate) fn covered(&self) -> f64 {
        let (double_area, longest) = self.extent();
        (0.5 * double_area).max(sqrt64(longest))
    }

    /// Width and height of the box around the triangle, in texels.
    pub(crate) fn box_size(&self) -> [f64; 2] {
        core::array::from_fn(|k| {
            let (lo, hi) = bounds(&self.corners, k);
            hi - lo
        })
    }

    /// The triangle under a cell.
    pub(crate) fn footprint(&self, cell: LatticeCell) -> TexelFootprint {
        let scale = 1.0 / f64::from(LATTICE);
        let [a, b, c] = self.corners;
        // Edges first: exactly degenerate triangles stay so.
        let corners = cell.corners().map(|p| {
            let (b1, b2) = (f64::from(p.0[1]) * scale, f64::from(p.0[2]) * scale);
            [a[0] + b1 * (b[0] - a[0]) + b2 * (c[0] - a[0]), a[1] + b1 * (b[1] - a[1]) + b2 * (c[1] - a[1])]
        });
        TexelFootprint::new(corners, self.slack)
    }
}

/// Ends along an axis of corners that are numbers. (`f64::min` would test for NaN.)
#[inline(always)]
fn bounds(corners: &[[f64; 2]; 3], k: usize) -> (f64, f64) {
    ends(corners.map(|c| c[k]))
}

/// The least and the largest of three numbers.
#[inline(always)]
fn ends([a, b, c]: [f64; 3]) -> (f64, f64) {
    let (low, high) = if a < b { (a, b) } else { (b, a) };
    (if c < low { c } else { low }, if c > high { c } else { high })
}

/// A triangle in texels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TexelFootprint {
    /// An integer point near the triangle. All else counts from here, so that nothing is lost far from the origin.
    pub(crate) origin: [i64; 2],
    /// The corners.
    pub(crate) corners: [[f64; 2]; 3],
    /// Low end of the box around them.
    pub(crate) lo: [f64; 2],
    /// High end of the box around them.
    pub(crate) hi: [f64; 2],
    /// How far off a host may look: see [`UvTriangle`].
    pub(crate) slack: [f64; 2],
}

impl TexelFootprint {
    fn new(corners: [[f64; 2]; 3], slack: [f64; 2]) -> Self {
        let origin = core::array::from_fn(|k| floor_to_i64(bounds(&corners, k).0));
        let corners = corners.map(|c| [c[0] - origin[0] as f64, c[1] - origin[1] as f64]);
        let (x, y) = (bounds(&corners, 0), bounds(&corners, 1));
        Self { origin, corners, lo: [x.0, y.0], hi: [x.1, y.1], slack }
    }

    /// The edges' normals, each with what the triangle spans along it.
    #[inline]
    pub(crate) fn normals(&self) -> [EdgeNormal; 3] {
        let corners = &self.corners;
        core::array::from_fn(|k| {
            let (p, q, r) = (corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]);
            let normal = [p[1] - q[1], q[0] - p[0]];
            let (lo, hi) = ends([p, q, r].map(|v| normal[0] * v[0] + normal[1] * v[1]));
            EdgeNormal { normal, lo, hi }
        })
    }

    /// Twice the area.
    pub(crate) fn double_area(&self) -> f64 {
        let [a, b, c] = self.corners;
        ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs()
    }
}

/// A normal of an edge of a triangle, and what the triangle spans along it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeNormal {
    /// Not of unit length.
    pub(crate) normal: [f64; 2],
    /// Low end of the triangle.
    pub(crate) lo: f64,
    /// High end of the triangle.
    pub(crate) hi: f64,
}

impl TexelFootprint {
    /// Whether the closed triangle, of which these are the normals, meets a closed box. Works for triangles without
    /// area, too.
    pub(crate) fn meets(&self, normals: &[EdgeNormal; 3], x: [f64; 2], y: [f64; 2]) -> bool {
        if self.lo[0] > x[1] || self.hi[0] < x[0] || self.lo[1] > y[1] || self.hi[1] < y[0] {
            return false;
        }
        let center = [0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1])];
        let half = [0.5 * (x[1] - x[0]), 0.5 * (y[1] - y[0])];
        normals.iter().all(|EdgeNormal { normal: n, lo, hi }| {
            let at = n[0] * center[0] + n[1] * center[1];
            let reach = n[0].abs() * half[0] + n[1].abs() * half[1];
            at + reach >= *lo && at - reach <= *hi
        })
    }
}
