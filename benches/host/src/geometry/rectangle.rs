//! Rectangular windows.

use glam::{Vec2, Vec3};

use super::mesh::Mesh;
use super::plane::{Plane, rectangle_outline};

/// Distance, relative to a side, below which two corners are the same: more than rounding, less than any window differs
/// from a rectangle by intent.
const SAME: f32 = 1e-4;

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

    /// Returns the rectangle that two triangles make up; `None` if they make up none.
    pub(crate) fn of([first, second]: [[Vec3; 3]; 2]) -> Option<Self> {
        let near = |a: Vec3, b: Vec3| a.distance(b) < SAME * first[0].distance(first[1]);
        // Both triangles have the diagonal; the corner across from it is a right angle.
        let k = (0..3).find(|&k| !second.iter().any(|&other| near(other, first[k])))?;
        let [corner, right, top] = [0, 1, 2].map(|i| first[(k + i) % 3]);
        let sides = [right - corner, top - corner];
        let is_right = sides[0].dot(sides[1]).abs() < SAME * sides[0].length() * sides[1].length();
        let is_whole = second.iter().any(|&other| near(other, right + sides[1]));
        let is_shared = [right, top].iter().all(|&end| second.iter().any(|&other| near(other, end)));
        (is_right && is_whole && is_shared).then_some(Self { corner, sides })
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
