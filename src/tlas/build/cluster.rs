//! Lights and clusters of lights as the build of a tree sees them.
//!
//! Here a cluster's normals lie in a box, as its positions do: to add a light takes a few vector instructions and
//! no trigonometry, where the union of two cones takes two arcs and a turn. The cones of the finished tree are made of
//! the lights themselves.

use glam::Vec3A;

use crate::bounds::{LightBounds, orientation_measure};
use crate::math;

/// Least squared length of the middle of a box of unit normals. Below it, the normals count as pointing everywhere: the
/// middle is no direction any more, and dividing by its length would only enlarge rounding. Affects costs alone.
/// *Measured*: docs/ACCURACY.md, "Constants of the build"; not sensitive.
const LEAST_MIDDLE2: f32 = 1e-4;

/// A light on its way into the tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    pub(super) low: Vec3A,
    pub(super) high: Vec3A,
    pub(super) normal: Vec3A,
    pub(super) energy: f32,
    pub(super) two_sided: bool,
    pub(super) light: u32,
}

impl Item {
    pub(super) fn new(bounds: &LightBounds, light: u32) -> Self {
        Self {
            low: bounds.aabb.min.into(),
            high: bounds.aabb.max.into(),
            normal: bounds.normals.axis.into(),
            energy: bounds.energy(),
            two_sided: bounds.two_sided,
            light,
        }
    }

    /// Returns twice the center of the box; coordinates are small enough to be added.
    #[inline(always)]
    pub(super) fn double_center(&self) -> Vec3A {
        self.low + self.high
    }
}

/// Several lights, as the heuristic sees them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cluster {
    pub(super) low: Vec3A,
    pub(super) high: Vec3A,
    pub(super) normal_low: Vec3A,
    pub(super) normal_high: Vec3A,
    pub(super) energy: f32,
    pub(super) two_sided: bool,
}

impl Cluster {
    pub(super) const EMPTY: Self = Self {
        low: Vec3A::INFINITY,
        high: Vec3A::NEG_INFINITY,
        normal_low: Vec3A::INFINITY,
        normal_high: Vec3A::NEG_INFINITY,
        energy: 0.0,
        two_sided: false,
    };

    /// Adds a light whose normal has been turned to the wanted side.
    #[inline(always)]
    pub(super) fn add(&mut self, item: &Item, normal: Vec3A) {
        self.low = self.low.min(item.low);
        self.high = self.high.max(item.high);
        self.normal_low = self.normal_low.min(normal);
        self.normal_high = self.normal_high.max(normal);
        self.energy += item.energy;
        self.two_sided |= item.two_sided;
    }

    #[inline(always)]
    pub(super) fn union(self, other: &Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            normal_low: self.normal_low.min(other.normal_low),
            normal_high: self.normal_high.max(other.normal_high),
            energy: self.energy + other.energy,
            two_sided: self.two_sided || other.two_sided,
        }
    }

    /// Returns `M_A · M_Ω · energy` of the heuristic.
    pub(super) fn cost(&self) -> f32 {
        self.cost_in(&Units { pad: 0.0, per_length: 1.0, per_energy: 1.0 })
    }

    #[inline]
    pub(super) fn cost_in(&self, units: &Units) -> f32 {
        let e = (self.high - self.low) * units.per_length + Vec3A::splat(units.pad);
        let area = 2.0 * (e.x * e.y + e.y * e.z + e.z * e.x);
        area * orientation_measure(self.least_cos(), self.two_sided) * (self.energy * units.per_energy)
    }

    /// Returns the least cosine of the angle between a normal and the middle of all.
    #[inline]
    fn least_cos(&self) -> f32 {
        let middle = 0.5 * (self.normal_low + self.normal_high);
        let half = 0.5 * (self.normal_high - self.normal_low);
        let length2 = middle.length_squared();
        if length2 < LEAST_MIDDLE2 {
            return -1.0;
        }
        let inverse = 1.0 / math::sqrt(length2);
        // By the corner of the box that is farthest back, and by the ball around the box; the larger one is true, too.
        let by_corner = (length2 - middle.abs().dot(half)) * inverse;
        let by_ball = 0.5 * (1.0 + length2 - half.length_squared()) * inverse;
        by_corner.max(by_ball).clamp(-1.0, 1.0)
    }
}

/// Units of costs, which keep the costs of tiny or dark lights apart.
pub(super) struct Units {
    /// Length by which edges are extended, so that flat boxes still compare.
    pub(super) pad: f32,
    pub(super) per_length: f32,
    pub(super) per_energy: f32,
}
