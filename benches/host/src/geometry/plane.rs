//! Walls: polygons with holes in a plane across one of the axes.

use earcut::Earcut;
use glam::{Vec2, Vec3, vec2, vec3};

use super::mesh::Mesh;

/// A plane across an axis. Its coordinates are the other two axes in the order x, y, z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Plane {
    X(f32),
    Y(f32),
    Z(f32),
}

impl Plane {
    /// Returns the point with these coordinates.
    pub(crate) const fn point(self, at: Vec2) -> Vec3 {
        match self {
            Self::X(x) => vec3(x, at.x, at.y),
            Self::Y(y) => vec3(at.x, y, at.y),
            Self::Z(z) => vec3(at.x, at.y, z),
        }
    }

    /// Returns the normal of what runs counter-clockwise in the plane's coordinates.
    pub(crate) const fn normal(self) -> Vec3 {
        match self {
            Self::X(_) => Vec3::X,
            Self::Y(_) => Vec3::NEG_Y,
            Self::Z(_) => Vec3::Z,
        }
    }

    /// Returns a polygon with holes; its front is where the normal is.
    pub(crate) fn polygon(self, outline: &[Vec2], holes: &[Vec<Vec2>]) -> Mesh {
        let points: Vec<Vec2> = outline.iter().chain(holes.iter().flatten()).copied().collect();
        let starts: Vec<u32> = holes
            .iter()
            .scan(outline.len() as u32, |next, hole| Some(core::mem::replace(next, *next + hole.len() as u32)))
            .collect();
        let mut corners: Vec<u32> = Vec::new();
        Earcut::new().earcut(points.iter().map(Vec2::to_array), &starts, &mut corners);
        let indices = corners.as_chunks::<3>().0.iter().map(|&[a, b, c]| {
            let [pa, pb, pc] = [a, b, c].map(|i| points[i as usize]);
            if (pb - pa).perp_dot(pc - pa) > 0.0 { [a, b, c] } else { [a, c, b] }
        });
        Mesh { indices: indices.collect(), positions: points.iter().map(|&at| self.point(at)).collect(), uvs: vec![] }
    }
}

/// Returns the corners of a rectangle, counter-clockwise.
pub(crate) fn rectangle_outline(low: Vec2, high: Vec2) -> Vec<Vec2> {
    vec![low, vec2(high.x, low.y), high, vec2(low.x, high.y)]
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3, vec2};

    use super::{Plane, rectangle_outline};

    #[test]
    fn walls_face_their_normal_and_leave_holes_open() {
        let outline = rectangle_outline(Vec2::ZERO, vec2(6.0, 3.0));
        let hole = rectangle_outline(vec2(1.0, 0.9), vec2(2.2, 2.1));
        for plane in [Plane::X(1.0), Plane::Y(2.0), Plane::Z(3.0)] {
            let mesh = plane.polygon(&outline, core::slice::from_ref(&hole));
            let area: Vec3 = mesh.triangles().map(|[a, b, c]| 0.5 * (b - a).cross(c - a)).sum();
            assert!((area.dot(plane.normal()) - (18.0 - 1.44)).abs() < 1e-4, "{plane:?}");
        }
    }
}
