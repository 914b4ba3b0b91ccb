//! How a receiver favors directions beyond its cosine, as the vector loops need it.
//!
//! The loops over the children of a node, over the cells of a triangle and over cells of directions are compiled for
//! each kind of lobe, and [`for_lobe`] chooses one of them once for a whole walk. A receiver without a lobe pays
//! nothing.

use glam::Vec3;

/// Share of a lobe that guides like a diffuse surface, or like an isotropic medium. It covers what the estimate of a
/// lobe misses in its tails.
///
/// *Measured* on clouds (docs/ACCURACY.md, "Lobes"): 0.01 and 0.005 are as good there. Larger: samples that the lobe
/// hardly sees. Smaller: fireflies from lights that are near and off the peak.
pub(super) const EVEN_SHARE: f32 = 0.02;

/// Variance of the directions of a compact region, such as a square, relative to its solid angle. *Proved*: that of a
/// square of side `s` is `s² / 12` along each of its two axes.
///
/// Larger: lobes are blurred more than the region does. Smaller: the lobe of the center stands for the whole region.
pub(crate) const SPREAD_OF_SOLID_ANGLE: f32 = 1.0 / 6.0;

/// Variance of the points of a triangle, relative to the squared distance of the farthest vertex from the centroid.
/// *Proved* for an equilateral one; others have up to 1/6.
///
/// Larger or smaller: as [`SPREAD_OF_SOLID_ANGLE`].
pub(crate) const SPREAD_OF_RADIUS2: f32 = 0.25;

/// Variation up to which a lobe is about constant. Chosen: the relative deviation is two fifths then.
///
/// Larger: divides less, for more noise. Smaller: steps that cost more than they gain.
const CONSTANT_VARIATION: f32 = 0.16;

/// A lobe, prepared for the loops.
pub(crate) trait Lobe: Copy {
    /// Returns the mean weight of the directions to a region, times its distance. Positive if `toward` is.
    ///
    /// `toward` is the mean weight without the lobe, times the distance; `center` is the vector to the region's center,
    /// and `distance` its length; `spread2` is the variance of the directions around it, in squared radians, of both
    /// axes together.
    fn weigh(&self, toward: f32, center: [f32; 3], distance: f32, spread2: f32) -> f32;

    /// Returns about how much the logarithm of the lobe varies over a region of directions with this variance around a
    /// unit direction, squared.
    fn variation(&self, direction: [f32; 3], spread2: f32) -> f32;

    /// Whether the lobe is about constant over a region of directions with this variance around a unit direction.
    #[inline(always)]
    fn is_about_constant(&self, direction: [f32; 3], spread2: f32) -> bool {
        self.variation(direction, spread2) <= CONSTANT_VARIATION
    }

    /// How much the bounds of clusters shrink along each axis: negative where rounding may have moved the shading
    /// point, which widens them. Zero for a point that was passed in.
    #[inline(always)]
    fn inset(&self) -> f32 {
        0.0
    }

    /// Returns the lobe in another frame.
    fn map(self, map: impl Fn([f32; 3]) -> [f32; 3]) -> Self;
}

/// Nothing beyond the cosine.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NoLobe;

impl Lobe for NoLobe {
    #[inline(always)]
    fn weigh(&self, toward: f32, _center: [f32; 3], _distance: f32, _spread2: f32) -> f32 {
        toward
    }

    #[inline(always)]
    fn variation(&self, _direction: [f32; 3], _spread2: f32) -> f32 {
        0.0
    }

    #[inline(always)]
    fn map(self, _map: impl Fn([f32; 3]) -> [f32; 3]) -> Self {
        self
    }
}

/// Evaluates an expression with the lobe of a receiver, compiled for each kind of lobe.
macro_rules! for_lobe {
    ($receiver:expr, $lobe:ident => $call:expr) => {
        match $receiver {
            $crate::receiver::Receiver::Glossy(surface) => {
                let $lobe = surface.lobe();
                $call
            }
            $crate::receiver::Receiver::Scattering(medium) => {
                let $lobe = medium.lobe();
                $call
            }
            $crate::receiver::Receiver::Microfacet(surface) => {
                let $lobe = surface.lobe();
                $call
            }
            _ => {
                let $lobe = $crate::receiver::NoLobe;
                $call
            }
        }
    };
}
pub(crate) use for_lobe;

/// Returns a unit vector, or zero for what has no direction.
#[inline]
pub(super) fn unit_or_zero(vector: Vec3) -> Vec3 {
    // In doubles, whose squares neither overflow nor vanish.
    vector.as_dvec3().normalize_or_zero().as_vec3()
}
