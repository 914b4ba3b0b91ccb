//! A point in a medium that scatters by the phase function of Henyey and Greenstein (1941).
//!
//! The weight of a direction ω is 4π times the phase function, so that an isotropic medium has 1:
//!
//! ```text
//! (1 - g²) / (1 + g² + 2 g ω·o)^(3/2)
//! ```
//!
//! The Legendre coefficients of this function are the powers of g. Blurred by directions whose mean cosine to their
//! center is c, it is therefore the same function of about `c g`.

use core::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::lambert::solid_angle;
use super::lanes::ReceiverLanes;
use super::lobe::{EVEN_SHARE, Lobe, SPREAD_OF_SOLID_ANGLE, unit_or_zero};
use super::volume::Volume;
use super::{HeightWeights, ReceiverKind};
use crate::math::sqrt;

/// Largest absolute asymmetry that guides. Chosen: the peak is 2e4 times the mean then.
///
/// Larger: weights become as large as `f32` allows. Smaller: clear media are guided less closely than can be.
const LARGEST_ASYMMETRY: f32 = 0.99;

/// A point in a medium with a Henyey-Greenstein phase function, seen from an outgoing direction.
///
/// As with [`Glossy`](crate::Glossy), the phase function only guides: densities are exact whatever the host's own is.
///
/// ```
/// use fanlight::{Scattering, ShadingPoint, glam::Vec3};
///
/// // Haze scatters forward: light from behind weighs most.
/// let x = ShadingPoint::scattering(Vec3::ZERO, Scattering::new(Vec3::X, 0.7));
/// assert!(x.weight(-Vec3::X) > x.weight(Vec3::X));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub struct Scattering {
    /// Unit vector; zero if there is none.
    outgoing: Vec3,
    asymmetry: f32,
}

impl Scattering {
    /// Returns a medium.
    ///
    /// - `outgoing` points to where the light is scattered: to the viewer, back along a path. Its length does not
    ///   matter.
    /// - `asymmetry` is the mean cosine g of the angle by which light is deflected, in `(-1, 1)`: positive scatters
    ///   forward. Absolute values above 0.99 count as 0.99.
    ///
    /// If the outgoing direction has no direction, or the asymmetry is NaN, the point is guided like an isotropic one.
    pub fn new(outgoing: Vec3, asymmetry: f32) -> Self {
        let outgoing = unit_or_zero(outgoing);
        let is_valid = !asymmetry.is_nan() && outgoing != Vec3::ZERO;
        let asymmetry = if is_valid { asymmetry.clamp(-LARGEST_ASYMMETRY, LARGEST_ASYMMETRY) } else { 0.0 };
        Self { outgoing, asymmetry }
    }

    /// Whether there is a lobe.
    #[inline]
    pub(super) fn has_lobe(&self) -> bool {
        self.asymmetry != 0.0
    }

    /// Returns the outgoing direction, a unit vector; zero if it has no direction.
    #[must_use]
    pub fn outgoing(&self) -> Vec3 {
        self.outgoing
    }

    /// Returns the asymmetry g that guides, in `[-0.99, 0.99]`.
    #[must_use]
    pub fn asymmetry(&self) -> f32 {
        self.asymmetry
    }

    /// Returns the medium with the outgoing direction mapped.
    #[inline]
    pub(super) fn map(self, map: impl Fn(Vec3) -> Vec3) -> Self {
        Self { outgoing: map(self.outgoing), ..self }
    }

    /// Returns the lobe prepared for loops.
    #[inline(always)]
    pub(crate) fn lobe(&self) -> PhaseLobe {
        PhaseLobe { outgoing: self.outgoing.to_array(), asymmetry: self.asymmetry }
    }
}

/// A phase function, prepared for loops.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PhaseLobe {
    outgoing: [f32; 3],
    asymmetry: f32,
}

impl PhaseLobe {
    #[inline(always)]
    fn cosine(&self, [x, y, z]: [f32; 3]) -> f32 {
        let [ox, oy, oz] = self.outgoing;
        x * ox + y * oy + z * oz
    }

    /// Returns the phase function times 4π at a cosine, blurred by a variance of directions.
    #[inline(always)]
    fn value(&self, cosine: f32, spread2: f32) -> f32 {
        // The mean cosine of directions of a small variance is 1 - s² / 2.
        let g = self.asymmetry / (1.0 + 0.5 * spread2);
        let base = 1.0 + g * g + 2.0 * g * cosine;
        // No less than (1 - |g|)², whatever rounding has done to the cosine.
        let least = (1.0 - g.abs()) * (1.0 - g.abs());
        let base = if base > least { base } else { least };
        (1.0 - g * g) / (base * sqrt(base))
    }
}

impl Lobe for PhaseLobe {
    #[inline(always)]
    fn weigh(&self, toward: f32, center: [f32; 3], distance: f32, spread2: f32) -> f32 {
        let value = self.value(self.cosine(center) / distance, spread2);
        toward * (EVEN_SHARE + (1.0 - EVEN_SHARE) * value)
    }

    /// The logarithm changes by 3 g sin θ / (1 + g² + 2 g cos θ) for each radian.
    #[inline(always)]
    fn variation(&self, direction: [f32; 3], spread2: f32) -> f32 {
        let (g, cosine) = (self.asymmetry, self.cosine(direction));
        let base = 1.0 + g * g + 2.0 * g * cosine;
        // Around the peak, half the blur stands in for the sine.
        let sine2 = 1.0 - cosine * cosine + 0.5 * spread2;
        9.0 * g * g * sine2 * 0.5 * spread2 / (base * base)
    }

    #[inline(always)]
    fn map(self, map: impl Fn([f32; 3]) -> [f32; 3]) -> Self {
        Self { outgoing: map(self.outgoing), ..self }
    }
}

/// What does not concern the direction is that of an isotropic medium.
impl ReceiverKind for Scattering {
    #[inline]
    fn weight(self, direction: Vec3) -> f32 {
        let lobe = self.lobe();
        lobe.value(lobe.cosine(direction.to_array()), 0.0)
    }

    #[inline(always)]
    fn normal(self) -> Vec3 {
        Volume.normal()
    }

    #[inline(always)]
    fn is_dark(self, vertices: &[Vec3; 3]) -> bool {
        Volume.is_dark(vertices)
    }

    #[inline(always)]
    fn has_horizon(self) -> bool {
        Volume.has_horizon()
    }

    #[inline(always)]
    fn mean_over_cone(self, axis: Vec3, sin_radius: f32) -> f32 {
        self.lobe().weigh(1.0, axis.to_array(), 1.0, 0.5 * sin_radius * sin_radius)
    }

    #[inline(always)]
    fn height_weights(self) -> HeightWeights {
        Volume.height_weights()
    }

    #[inline]
    fn weight_at_height(self, height: f32, inverse_distance: f32) -> f32 {
        Volume.weight_at_height(height, inverse_distance)
    }

    /// The solid angle is exact. The phase function is weighed at the centroid and between it and each vertex.
    fn irradiance(self, vertices: &[Vec3; 3]) -> f32 {
        let solid_angle = solid_angle(vertices);
        let [a, b, c] = vertices.map(Vec3::normalize_or_zero);
        let center = (a + b + c) * (1.0 / 3.0);
        let spread2 = 0.25 * SPREAD_OF_SOLID_ANGLE * solid_angle;
        let values = [center, a + center, b + center, c + center].map(|direction| {
            let direction = direction.normalize_or_zero().to_array();
            self.lobe().weigh(1.0, direction, 1.0, spread2)
        });
        solid_angle * FRAC_1_PI * 0.25 * values.iter().sum::<f32>()
    }

    #[inline(always)]
    fn least_over_directions(self, solid_angle: f32) -> f32 {
        Volume.least_over_directions(solid_angle)
    }

    #[inline(always)]
    fn lanes(self, position: Vec3) -> ReceiverLanes {
        Volume.lanes(position)
    }
}
