//! What is drawn of light on its way out.

use glam::Vec3;

#[cfg(doc)]
use super::emission::Emission;
use crate::record::{Hit, SampledLight};

/// A ray of light that leaves an emitter or enters through a portal.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct EmissionSample {
    /// What the ray starts from: a point of a triangle, or another light.
    pub light: SampledLight,
    /// World position that the ray starts from.
    pub position: Vec3,
    /// Unit normal of the front side there. For a light without an extent, the direction.
    pub normal: Vec3,
    /// Unit direction in which the light travels.
    pub direction: Vec3,
    /// Density of the ray, finite and above zero: per area perpendicular to `direction` and, unless the direction was
    /// given, per solid angle. For a light without an extent, per solid angle alone: there intensity over density is
    /// the power. For a distant light without an extent, per area alone: there irradiance over density is the power.
    ///
    /// It counts this light alone; [`Emission::pdf_ray`] counts all that the ray passes.
    pub pdf: f32,
    /// Probability of having chosen the light, given the direction for a portal. In `(0, 1]`.
    pub pmf: f32,
}

impl EmissionSample {
    /// Returns the point of the triangle that the ray starts from; `None` for any other kind of light.
    #[inline]
    #[must_use]
    pub const fn hit(&self) -> Option<Hit> {
        self.light.hit()
    }

    /// Whether the light has an extent. For a light without one, `pdf` is a density per solid angle alone.
    #[inline]
    #[must_use]
    pub const fn has_extent(&self) -> bool {
        self.light.has_extent()
    }
}
