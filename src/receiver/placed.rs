//! A receiver in the space of an object, whose light tree is walked there.
//!
//! With M the linear part of the map to the world, a cluster at r in the object's space with the area vector a, and a
//! receiver of the normal n in the world, the irradiance from the cluster is
//!
//! ```text
//! det M (a·r) (n·Mr) / |Mr|⁴
//! ```
//!
//! Heights over the receiver's plane are those over the plane with the normal Mᵀn in the object's space, and both sides
//! of a triangle stay its sides. So the loop over lanes finds `(a·r) (Mᵀn·r) / |r|⁴` by itself, and what is missing is
//! the factor `det M (|r| / |Mr|)⁴`. It is constant for a rotation and a uniform scale. For any other map it takes the
//! place of a lobe, and so does what a lobe in the world makes of the direction Mr.

use glam::{DMat3, DVec3};

use super::lobe::{Lobe, NoLobe};
use super::{Receiver, ReceiverKind};
use crate::geometry::Placement;
use crate::math::{at_least, sqrt, sqrt64};

/// Least squared distance in the world. *Proved*: its inverse is finite. A larger one would show in tiny scenes.
const LEAST_DISTANCE2: f32 = 1e-30;

/// Nothing beyond the cosine, for a shading point that was rounded when it was mapped.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RoundedPoint {
    /// How far rounding has moved the shading point along each axis, at most.
    pub(crate) margin: f32,
}

impl Lobe for RoundedPoint {
    #[inline(always)]
    fn weigh(&self, toward: f32, _center: [f32; 3], _distance: f32, _spread2: f32) -> f32 {
        toward
    }

    #[inline(always)]
    fn variation(&self, _direction: [f32; 3], _spread2: f32) -> f32 {
        0.0
    }

    #[inline(always)]
    fn inset(&self) -> f32 {
        -self.margin
    }

    #[inline(always)]
    fn map(self, _map: impl Fn([f32; 3]) -> [f32; 3]) -> Self {
        self
    }
}

/// What a map that is no similarity, and a lobe in the world, make of the weight of a direction in an object's space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedLobe<L = NoLobe> {
    /// Columns of the map's linear part.
    columns: [[f32; 3]; 3],
    /// Length of the normal in the object's space before it was made a unit vector; zero in a medium.
    normal_length: f32,
    /// 1 in a medium, where the distance stands in for the height, and zero elsewhere.
    medium: f32,
    /// Square root of the determinant's size.
    root: f32,
    /// Mean squared length of what unit vectors are mapped to.
    scale2: f32,
    margin: f32,
    /// Lobe in the world.
    lobe: L,
}

impl<L: Lobe> PlacedLobe<L> {
    /// Returns the lobe for a map, with the lobe of the receiver in the world. `normal_length` is that of
    /// [`own_receiver`].
    pub(crate) fn new(placement: &Placement, receiver: Receiver, normal_length: f64, margin: f32, lobe: L) -> Self {
        let is_medium = receiver.normal() == glam::Vec3::ZERO;
        Self {
            columns: placement.linear.to_cols_array_2d().map(|column| column.map(|value| value as f32)),
            normal_length: if is_medium { 0.0 } else { normal_length as f32 },
            medium: if is_medium { 1.0 } else { 0.0 },
            root: sqrt64(placement.determinant.abs()) as f32,
            scale2: placement.mean_scale2() as f32,
            margin,
            lobe,
        }
    }

    /// Returns the image of a vector.
    #[inline(always)]
    fn mapped(&self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = self.columns;
        // Not a map, whose closure would be compiled for the baseline.
        [ax * x + bx * y + cx * z, ay * x + by * y + cy * z, az * x + bz * y + cz * z]
    }
}

impl<L: Lobe> Lobe for PlacedLobe<L> {
    #[inline(always)]
    fn weigh(&self, toward: f32, center: [f32; 3], distance: f32, spread2: f32) -> f32 {
        let [x, y, z] = center;
        let [wx, wy, wz] = self.mapped(center);
        let distance2 = distance * distance;
        // What the distance has of the spread of the positions is mapped on average.
        let spread = at_least(distance2 - (x * x + y * y + z * z), 0.0);
        let mapped2 = at_least(wx * wx + wy * wy + wz * wz + self.scale2 * spread, LEAST_DISTANCE2);
        let (mapped, ratio2) = (sqrt(mapped2), distance2 / mapped2);
        let toward = self.normal_length * toward + self.medium * mapped;
        let weight = self.lobe.weigh(toward, [wx, wy, wz], mapped, spread2 * ratio2 * self.scale2);
        let factor = self.root * ratio2;
        weight * factor * factor
    }

    #[inline(always)]
    fn variation(&self, direction: [f32; 3], spread2: f32) -> f32 {
        let [x, y, z] = self.mapped(direction);
        let length2 = at_least(x * x + y * y + z * z, LEAST_DISTANCE2);
        let inverse = 1.0 / sqrt(length2);
        self.lobe.variation([x * inverse, y * inverse, z * inverse], spread2 * self.scale2 / length2)
    }

    #[inline(always)]
    fn inset(&self) -> f32 {
        -self.margin
    }

    /// The frame is that of the world.
    #[inline(always)]
    fn map(self, map: impl Fn([f32; 3]) -> [f32; 3]) -> Self {
        Self { lobe: self.lobe.map(map), ..self }
    }
}

/// Returns the receiver in an object's space, apart from a lobe, and the length of its normal there before it was made
/// a unit vector. `linear` is that of the map to the world.
pub(crate) fn own_receiver(receiver: Receiver, linear: &DMat3) -> (Receiver, f64) {
    let normal: DVec3 = linear.transpose() * receiver.normal().as_dvec3();
    let unit = normal.normalize_or_zero().as_vec3();
    let own = match receiver {
        Receiver::Surface(_) | Receiver::Glossy(_) => Receiver::Surface(unit),
        Receiver::Transmissive(_) => Receiver::Transmissive(unit),
        Receiver::Volume | Receiver::Scattering(_) => Receiver::Volume,
        Receiver::Microfacet(_) if receiver.has_horizon() => Receiver::Surface(unit),
        Receiver::Microfacet(_) => Receiver::Transmissive(unit),
    };
    (own, normal.length())
}
