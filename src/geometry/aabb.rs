//! Axis-aligned boxes.

use glam::Vec3;

/// An axis-aligned box; empty when a minimum lies above its maximum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Aabb {
    pub(crate) min: Vec3,
    pub(crate) max: Vec3,
}

impl Aabb {
    /// The box that holds nothing and that every union ignores.
    pub(crate) const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// The smallest box around the points.
    pub(crate) fn around(points: &[Vec3]) -> Self {
        points.iter().fold(Self::EMPTY, |aabb, &p| Self { min: aabb.min.min(p), max: aabb.max.max(p) })
    }

    /// The smallest box around both.
    pub(crate) fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Edge lengths; zero for the empty box.
    pub(crate) fn extent(&self) -> Vec3 {
        (self.max - self.min).max(Vec3::ZERO)
    }

    /// Surface area; zero for the empty box.
    pub(crate) fn area(&self) -> f32 {
        let e = self.extent();
        2.0 * (e.x * e.y + e.y * e.z + e.z * e.x)
    }
}
