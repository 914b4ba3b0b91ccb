//! The point that light is gathered at, and how a direction is weighted there.
//!
//! Each kind of receiver is a file, which answers the same questions ([`ReceiverKind`]): the weight of a direction,
//! whether a triangle is dark for certain, the mean over a cone of directions, the weights of the cells of a triangle,
//! the exact irradiance, and what the loop over the lanes of a tree's node needs. A new kind is a new file, a variant
//! of [`Receiver`] and a line in `dispatch`. If it has a [`Lobe`], that is a line in `for_lobe` as well.

mod effort;
mod glossy;
mod lambert;
mod lanes;
mod lobe;
mod microfacet;
mod parts;
mod placed;
mod scattering;
mod surface;
mod transmissive;
mod volume;

use glam::Vec3;

use crate::math::{at_least, at_most};
pub use effort::Effort;
pub use glossy::Glossy;
pub(crate) use lanes::{LEAST_CLUSTER_COSINE, ReceiverLanes};
pub(crate) use lobe::{Lobe, NoLobe, SPREAD_OF_RADIUS2, SPREAD_OF_SOLID_ANGLE, for_lobe};
pub use microfacet::Microfacet;
pub(crate) use placed::{PlacedLobe, RoundedPoint, own_receiver};
pub use scattering::Scattering;
use surface::Surface;
use transmissive::Transmissive;
use volume::Volume;

/// Weight of a direction at a shading point.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Receiver {
    /// An opaque surface with this unit normal: `max(0, cos θ)`.
    Surface(Vec3),
    /// A surface that also passes light through, with this unit normal: `|cos θ|`.
    Transmissive(Vec3),
    /// A point in a medium: every direction counts the same.
    Volume,
    /// An opaque surface with a glossy lobe: what it scatters of the direction.
    Glossy(Glossy),
    /// A point in a medium with a phase function: what it scatters of the direction.
    Scattering(Scattering),
    /// A surface with microfacet lobes, opaque or not: what it scatters of the direction.
    Microfacet(Microfacet),
}

/// A position, and how a direction is weighted there.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ShadingPoint {
    /// World position. Nothing arrives at a position with a coordinate that is not finite or is above 1e15.
    pub position: Vec3,
    /// Weight of a direction at this point.
    pub receiver: Receiver,
    /// Light groups that the point receives, a set of bits: a light arrives if it is in any of them. All by default.
    pub groups: u32,
    /// How much a call may do to follow the light. [`Effort::Full`] by default.
    pub effort: Effort,
    /// Time in the shutter interval.
    pub(crate) time: f32,
}

/// All light groups. *Format.*
pub(crate) const ALL_GROUPS: u32 = u32::MAX;

/// Largest difference of a squared length from 1 up to which a normal counts as a unit vector.
///
/// *Chosen*: twice 1e-3 to first order, which is what a normal interpolated in half precision is off. A larger value
/// accepts normals that bias nothing but guide worse; a smaller one spends time on normals that are good enough.
/// Documented at [`ShadingPoint::new`].
const UNIT_TOLERANCE: f32 = 2e-3;

impl Receiver {
    /// Returns the same receiver in another frame.
    #[inline]
    pub(crate) fn map(self, map: impl Fn(Vec3) -> Vec3) -> Self {
        match self {
            Self::Surface(normal) => Self::Surface(map(normal)),
            Self::Transmissive(normal) => Self::Transmissive(map(normal)),
            Self::Volume => Self::Volume,
            Self::Glossy(surface) => Self::Glossy(surface.map(map)),
            Self::Scattering(medium) => Self::Scattering(medium.map(map)),
            Self::Microfacet(surface) => Self::Microfacet(surface.map(map)),
        }
    }

    /// Whether directions are favored beyond the cosine.
    #[inline]
    pub(crate) fn has_lobe(&self) -> bool {
        matches!(self, Self::Glossy(_) | Self::Scattering(_) | Self::Microfacet(_))
    }
}

impl ShadingPoint {
    /// Returns a point with any receiver.
    ///
    /// A normal whose length is within 1e-3 of 1 is taken as it is, bit for bit. Any other normal is normalized; one
    /// without a direction (zero, infinite or NaN) stays as it is, and the samples at such a point are valid but
    /// useless.
    #[must_use]
    pub fn new(position: Vec3, receiver: Receiver) -> Self {
        let receiver = match receiver {
            Receiver::Surface(normal) => Receiver::Surface(unit(normal)),
            Receiver::Transmissive(normal) => Receiver::Transmissive(unit(normal)),
            Receiver::Volume => Receiver::Volume,
            // Without a lobe, the loops need not look for one.
            Receiver::Glossy(surface) if !surface.has_lobe() => Receiver::Surface(surface.normal()),
            Receiver::Scattering(medium) if !medium.has_lobe() => Receiver::Volume,
            Receiver::Microfacet(surface) if !surface.has_lobe() => surface.without_lobe(),
            receiver @ (Receiver::Glossy(_) | Receiver::Scattering(_) | Receiver::Microfacet(_)) => receiver,
        };
        Self { position, receiver, groups: ALL_GROUPS, effort: Effort::Full, time: 0.0 }
    }

    /// Sets the light groups that the point receives, a set of bits. All by default.
    ///
    /// A light arrives if it shares a group with the point: if `mesh.groups & x.groups` is not zero. All other lights
    /// have the density zero here.
    #[must_use]
    pub const fn with_groups(mut self, groups: u32) -> Self {
        self.groups = groups;
        self
    }

    /// Sets how much a call may do to follow the light: [`Effort::Full`] by default. Samples and densities are exact
    /// with either.
    #[must_use]
    pub const fn with_effort(mut self, effort: Effort) -> Self {
        self.effort = effort;
        self
    }

    /// Sets the time at which light is gathered, in the shutter interval from 0 to 1; 0 until this sets it, and for
    /// NaN. A time outside of the interval counts as its nearer end.
    ///
    /// It matters only where lights move: [`Mesh::moving_to`](crate::Mesh::moving_to) and
    /// [`Instance::moving_to`](crate::Instance::moving_to).
    #[must_use]
    pub fn at_time(mut self, time: f32) -> Self {
        self.time = shutter_time(time);
        self
    }

    /// Returns the time at which light is gathered, in [0, 1].
    #[must_use]
    pub const fn time(&self) -> f32 {
        self.time
    }

    /// Returns a point on an opaque surface. `normal` is a unit vector to the side that light is gathered from; see
    /// [`Self::new`] for other lengths.
    #[must_use]
    pub fn surface(position: Vec3, normal: Vec3) -> Self {
        Self {
            position,
            receiver: Receiver::Surface(unit(normal)),
            groups: ALL_GROUPS,
            effort: Effort::Full,
            time: 0.0,
        }
    }

    /// Returns a point on a surface that gathers light from both sides. `normal` is a unit vector; see [`Self::new`]
    /// for other lengths.
    #[must_use]
    pub fn transmissive(position: Vec3, normal: Vec3) -> Self {
        Self {
            position,
            receiver: Receiver::Transmissive(unit(normal)),
            groups: ALL_GROUPS,
            effort: Effort::Full,
            time: 0.0,
        }
    }

    /// Returns a point in a participating medium.
    #[must_use]
    pub const fn volume(position: Vec3) -> Self {
        Self { position, receiver: Receiver::Volume, groups: ALL_GROUPS, effort: Effort::Full, time: 0.0 }
    }

    /// Returns a point on an opaque surface with a glossy lobe.
    #[must_use]
    pub fn glossy(position: Vec3, surface: Glossy) -> Self {
        Self::new(position, Receiver::Glossy(surface))
    }

    /// Returns a point in a participating medium with a phase function.
    #[must_use]
    pub fn scattering(position: Vec3, medium: Scattering) -> Self {
        Self::new(position, Receiver::Scattering(medium))
    }

    /// Returns a point on a surface with microfacet lobes, which may transmit.
    #[must_use]
    pub fn microfacet(position: Vec3, surface: Microfacet) -> Self {
        Self::new(position, Receiver::Microfacet(surface))
    }

    /// Returns the cosine of a unit direction that points away from this point: clamped on opaque surfaces, absolute on
    /// transmissive ones, and 1 in a medium.
    ///
    /// This is the factor of the estimate beside the host's own BSDF or phase function. A lobe is no part of it.
    #[must_use]
    pub fn cosine(&self, direction: Vec3) -> f32 {
        match self.receiver {
            Receiver::Glossy(surface) => Receiver::Surface(surface.normal()).weight(direction),
            Receiver::Scattering(_) => 1.0,
            Receiver::Microfacet(surface) => surface.without_lobe().weight(direction),
            receiver => receiver.weight(direction),
        }
    }

    /// Returns the weight that samples follow in a unit direction that points away from this point: the
    /// [`cosine`](Self::cosine) without a lobe, and with one what the lobe scatters, lobe and cosine together, relative
    /// to a white diffuse surface or to an isotropic medium.
    ///
    /// A target for resampling or a check of parameters; no estimate needs it.
    #[must_use]
    pub fn weight(&self, direction: Vec3) -> f32 {
        self.receiver.weight(direction)
    }

    /// Returns the point prepared for the loop over the lanes of a node. The lobe is that of the receiver, by
    /// [`for_lobe`].
    #[inline(always)]
    pub(crate) fn lanes<L: Lobe>(&self, lobe: L) -> ReceiverLanes<L> {
        self.receiver.lanes(self.position).with_lobe(lobe)
    }
}

/// Returns a time of the shutter interval: the nearer end for one outside of it, and the start for NaN.
pub(crate) fn shutter_time(time: f32) -> f32 {
    at_most(at_least(time, 0.0), 1.0)
}

/// A normal of unit length, untouched if it has that length already.
#[inline]
fn unit(normal: Vec3) -> Vec3 {
    if (normal.length_squared() - 1.0).abs() <= UNIT_TOLERANCE { normal } else { normal.normalize_or(normal) }
}

/// How heights over the receiver's plane and distances make the weight of a cell: numbers alone, so that all kinds
/// share one loop without a branch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HeightWeights {
    /// What a height below the plane is multiplied by.
    below: f32,
    /// What the distance is multiplied by, which stands in for the height where every direction counts.
    distance: f32,
}

impl HeightWeights {
    /// Returns the weight of a point at this height and distance, times the distance.
    #[inline(always)]
    pub(crate) fn at(self, height: f32, distance: f32) -> f32 {
        at_least(height, self.below * height) + self.distance * distance
    }

    /// Returns the mean weight of a cell times its distance, by the heights of its corners.
    #[inline(always)]
    pub(crate) fn mean(self, [a, b, c]: [f32; 3], distance: f32) -> f32 {
        let weight = |height: f32| at_least(height, self.below * height);
        (weight(a) + weight(b) + weight(c)) * (1.0 / 3.0) + self.distance * distance
    }
}

/// The questions that every kind of receiver answers.
pub(crate) trait ReceiverKind: Copy {
    /// Returns the weight of a unit direction.
    fn weight(self, direction: Vec3) -> f32;

    /// Returns the normal that heights are measured along; zero without one.
    fn normal(self) -> Vec3;

    /// Whether a triangle with these vertices, relative to the receiver, sends nothing there for certain.
    fn is_dark(self, vertices: &[Vec3; 3]) -> bool;

    /// Whether height below the plane of [`Self::normal`] makes a cell dark.
    fn has_horizon(self) -> bool;

    /// Returns the mean weight of the directions of a cone. Zero only if all of them have the weight zero.
    fn mean_over_cone(self, axis: Vec3, sin_radius: f32) -> f32;

    /// Writes the mean weights of many cones ([`mean_over_cone`](Self::mean_over_cone)), with axes by component.
    #[inline(always)]
    fn means_over_cones<const LANES: usize>(
        self,
        axes: &[[f32; LANES]; 3],
        sin_radii: &[f32; LANES],
        means: &mut [f32; LANES],
    ) {
        let [x, y, z] = axes;
        for i in 0..LANES {
            means[i] = self.mean_over_cone(Vec3::new(x[i], y[i], z[i]), sin_radii[i]);
        }
    }

    /// Returns what the weights of cells are made from, apart from a lobe.
    fn height_weights(self) -> HeightWeights;

    /// Returns the weight of the direction to a center at this mean height and distance, apart from a lobe.
    fn weight_at_height(self, height: f32, inverse_distance: f32) -> f32;

    /// Returns the irradiance over π from a triangle of unit radiance, exact as far as `f32` goes, but for a lobe. The
    /// vertices are relative to the receiver.
    fn irradiance(self, vertices: &[Vec3; 3]) -> f32;

    /// Returns the least mean weight of a small cell of directions, of which the central one is weighed
    /// ([`ReceiverLanes::weight_of_cell`]). It stands in for what the other directions of the cell weigh.
    fn least_over_directions(self, solid_angle: f32) -> f32;

    /// Returns what the loop over the lanes of a node needs, apart from a lobe.
    fn lanes(self, position: Vec3) -> ReceiverLanes;
}

/// Calls the same method of whichever kind a receiver is.
macro_rules! dispatch {
    ($receiver:expr, $kind:ident => $call:expr) => {
        match $receiver {
            Receiver::Surface(normal) => {
                let $kind = Surface { normal };
                $call
            }
            Receiver::Transmissive(normal) => {
                let $kind = Transmissive { normal };
                $call
            }
            Receiver::Volume => {
                let $kind = Volume;
                $call
            }
            Receiver::Glossy($kind) => $call,
            Receiver::Scattering($kind) => $call,
            Receiver::Microfacet($kind) => $call,
        }
    };
}

impl ReceiverKind for Receiver {
    #[inline]
    fn weight(self, direction: Vec3) -> f32 {
        dispatch!(self, kind => kind.weight(direction))
    }

    #[inline(always)]
    fn normal(self) -> Vec3 {
        dispatch!(self, kind => kind.normal())
    }

    #[inline(always)]
    fn is_dark(self, vertices: &[Vec3; 3]) -> bool {
        dispatch!(self, kind => kind.is_dark(vertices))
    }

    #[inline(always)]
    fn has_horizon(self) -> bool {
        dispatch!(self, kind => kind.has_horizon())
    }

    #[inline]
    fn mean_over_cone(self, axis: Vec3, sin_radius: f32) -> f32 {
        dispatch!(self, kind => kind.mean_over_cone(axis, sin_radius))
    }

    #[inline(always)]
    fn means_over_cones<const LANES: usize>(
        self,
        axes: &[[f32; LANES]; 3],
        sin_radii: &[f32; LANES],
        means: &mut [f32; LANES],
    ) {
        dispatch!(self, kind => kind.means_over_cones(axes, sin_radii, means));
    }

    #[inline(always)]
    fn height_weights(self) -> HeightWeights {
        dispatch!(self, kind => kind.height_weights())
    }

    #[inline]
    fn weight_at_height(self, height: f32, inverse_distance: f32) -> f32 {
        dispatch!(self, kind => kind.weight_at_height(height, inverse_distance))
    }

    fn irradiance(self, vertices: &[Vec3; 3]) -> f32 {
        dispatch!(self, kind => kind.irradiance(vertices))
    }

    #[inline(always)]
    fn least_over_directions(self, solid_angle: f32) -> f32 {
        dispatch!(self, kind => kind.least_over_directions(solid_angle))
    }

    #[inline(always)]
    fn lanes(self, position: Vec3) -> ReceiverLanes {
        dispatch!(self, kind => kind.lanes(position))
    }
}

#[cfg(test)]
mod tests;
