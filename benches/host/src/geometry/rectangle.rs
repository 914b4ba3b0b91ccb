//! Rectangular windows.

use glam::{Vec2, Vec3};

use super::mesh::Mesh;
use super::plane::{Plane, rectangle_outline};

/// A rectangle in space. Its front is where the cross product of its sides points.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rectangle {
    pub(crate) corner: Vec3,
    pub(crate) sides: [Vec3; 2],
}

impl Rectangle {
    /// Returns a rectangle of a plane whose front faces a direction.
    pub(crate) fn new(plane: Plane, low: Vec2, high: Vec2, front: Vec3) -> Self {
        let corners = rectangle_outline(low, high);
        let [corner, right, _, top] = [0, 1, 2, 3].map(|i: usize| plane.point(corners[i]));
        let sides = [right - corner, top - corner];
        Self { corner, sides: if plane.normal().dot(front) > 0.0 { sides } else { [sides[1], sides[0]] } }
    }

    /// Unit normal of the front.
    pub(crate) fn normal(&self) -> Vec3 {
        self.sides[0].cross(self.sides[1]).normalize()
    }

    /// Returns the rectangle as two triangles.
    pub(crate) fn mesh(&self) -> Mesh {
        let [right, top] = self.sides;
        Mesh::quad([self.corner, self.corner + right, self.corner + right + top, self.corner + top])
    }
}
