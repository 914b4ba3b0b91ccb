//! A surface with a glossy lobe: a microfacet reflection over a diffuse base.
//!
//! The weight of a direction ω is π times what the surface scatters of it, `π f cos θ`, so that a white diffuse surface
//! has the cosine:
//!
//! ```text
//! kd cos θ + ks π D(h) G(ω, o) / (4 cos θo)      h = (ω + o) / |ω + o|
//! ```
//!
//! with the GGX distribution D of the roughness α and Smith's height-correlated G (Walter et al. 2007; Heitz 2014).
//! Over a region of directions with the variance s², the half vector moves by half of it in the plane of incidence, and
//! by `1 / (2 o·h)` of it across. The mean of D is therefore that of a wider distribution, with
//!
//! ```text
//! α'² = √((α² + s²/4) (α² + s²/(4 (o·h)²)))
//! ```

use core::f32::consts::PI;

use glam::Vec3;

use super::lambert::{lambert, solid_angle};
use super::lanes::ReceiverLanes;
use super::lobe::{EVEN_SHARE, Lobe, unit_or_zero};
use super::parts::mean_over_parts;
use super::surface::Surface;
use super::{HeightWeights, ReceiverKind, unit};
use crate::math::{at_least, at_most, only_if, sqrt};

/// Least roughness that guides. Chosen: cells of the deepest division are as large as such a lobe.
///
/// Larger: smooth surfaces are guided less closely than can be. Smaller: the rounding of half vectors would show.
pub(super) const LEAST_ROUGHNESS: f32 = 1e-3;

/// Least cosine of the outgoing direction. Chosen: against a division by zero.
///
/// Larger: lobes of grazing views are blurred. Smaller: weights become as large as `f32` allows.
pub(super) const LEAST_OUTGOING: f32 = 1e-3;

/// Share of the largest cosine, 1, that the lobe keeps as a weight wherever it is not below the horizon.
///
/// Chosen with [`EVEN_SHARE`], which vanishes where the mean cosine does. Larger: more samples at the horizon. Smaller:
/// what little of a cluster stands over the horizon of a lobe starves.
pub(super) const LEAST_LOBE_WEIGHT: f32 = 1e-3;

/// Least squared length of the sum of two unit vectors. *Proved*: rounding leaves as much of opposite ones.
pub(super) const LEAST_SUM2: f32 = 1e-7;

/// A surface with a glossy reflection over a diffuse base, seen from an outgoing direction.
///
/// A sample is drawn in proportion to what the surface reflects of it, as far as the GGX lobe says. The lobe *guides*:
/// the densities are exact for any of its parameters, and the host evaluates its own BSDF, whatever it is. So Fresnel
/// and colors may be left out or put into the weights, and a lobe that is about right serves.
///
/// ```
/// use fanlight::{Glossy, ShadingPoint, glam::Vec3};
///
/// // A coat of roughness 0.1 that reflects 4 %, over a base of albedo 0.5.
/// let coated = Glossy::new(Vec3::Z, Vec3::new(0.6, 0.0, 0.8), 0.1).with_weights(0.5, 0.04);
/// let x = ShadingPoint::glossy(Vec3::ZERO, coated);
/// // The mirror direction weighs most.
/// assert!(x.weight(Vec3::new(-0.6, 0.0, 0.8)) > x.weight(Vec3::Z));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub struct Glossy {
    /// Unit normal.
    normal: Vec3,
    /// Unit vector; zero if there is none.
    outgoing: Vec3,
    roughness: f32,
    /// Weight of the lobe, relative to the sum of both weights.
    share: f32,
}

impl Glossy {
    /// Returns a surface that has nothing but the lobe.
    ///
    /// - `normal` is a unit vector to the side that light is gathered from, treated as that of
    ///   [`ShadingPoint::new`](crate::ShadingPoint::new).
    /// - `outgoing` points away from the surface, to where the light is scattered: to the viewer, back along a path.
    ///   Its length does not matter.
    /// - `roughness` is the α of the GGX distribution, in `[0, 1]` (Walter et al. 2007), and *not* its square root,
    ///   which artists are often given. Below 1e-3 it counts as 1e-3, and above 1 as 1. There, light that
    ///   is not found by sampling the BSDF is hardly found by sampling lights.
    ///
    /// If the outgoing direction is below the surface or has no direction, or the roughness is NaN, nothing is
    /// reflected: the point is guided like a diffuse one.
    pub fn new(normal: Vec3, outgoing: Vec3, roughness: f32) -> Self {
        let (outgoing, is_valid) = (unit_or_zero(outgoing), !roughness.is_nan());
        let outgoing = if is_valid { outgoing } else { Vec3::ZERO };
        let roughness = if is_valid { roughness.clamp(LEAST_ROUGHNESS, 1.0) } else { 1.0 };
        Self { normal: unit(normal), outgoing, roughness, share: 1.0 }.with_weights(0.0, 1.0)
    }

    /// Returns the same surface with these albedos of the diffuse base and of the lobe: the shares of light that each
    /// scatters, such as luminances, with Fresnel or without.
    ///
    /// Only their ratio matters. What is negative or NaN counts as zero, and an infinite one as a large number. If both
    /// are zero, the point is guided like a diffuse one.
    pub fn with_weights(self, diffuse: f32, glossy: f32) -> Self {
        let [diffuse, glossy] = [diffuse, glossy].map(|weight| f64::from(at_most(at_least(weight, 0.0), f32::MAX)));
        let share =
            if glossy > 0.0 && self.normal.dot(self.outgoing) > 0.0 { glossy / (diffuse + glossy) } else { 0.0 };
        Self { share: share as f32, ..self }
    }

    /// Whether there is a lobe.
    #[inline]
    pub(super) fn has_lobe(&self) -> bool {
        self.share > 0.0
    }

    /// Returns the unit normal.
    #[must_use]
    pub fn normal(&self) -> Vec3 {
        self.normal
    }

    /// Returns the outgoing direction, a unit vector; zero if it has no direction.
    #[must_use]
    pub fn outgoing(&self) -> Vec3 {
        self.outgoing
    }

    /// Returns the roughness α that guides, in `[1e-3, 1]`.
    #[must_use]
    pub fn roughness(&self) -> f32 {
        self.roughness
    }

    /// Returns the weights of the diffuse base and of the lobe, which add up to 1.
    #[must_use]
    pub fn weights(&self) -> [f32; 2] {
        [1.0 - self.share, self.share]
    }

    /// Returns the surface with both vectors mapped.
    #[inline]
    pub(super) fn map(self, map: impl Fn(Vec3) -> Vec3) -> Self {
        Self { normal: map(self.normal), outgoing: map(self.outgoing), ..self }
    }

    #[inline(always)]
    fn surface(self) -> Surface {
        Surface { normal: self.normal }
    }

    /// Returns the lobe prepared for loops.
    #[inline(always)]
    pub(crate) fn lobe(&self) -> GgxLobe {
        let alpha2 = self.roughness * self.roughness;
        let cosine = at_least(self.normal.dot(self.outgoing), LEAST_OUTGOING);
        GgxLobe {
            normal: self.normal.to_array(),
            outgoing: self.outgoing.to_array(),
            cosine,
            alpha2,
            masking: sqrt(alpha2 + (1.0 - alpha2) * (cosine * cosine)),
            diffuse: 1.0 - self.share + EVEN_SHARE * self.share,
            share: self.share,
        }
    }
}

/// A GGX lobe over a diffuse base, prepared for loops.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GgxLobe {
    normal: [f32; 3],
    outgoing: [f32; 3],
    /// Cosine of the outgoing direction.
    cosine: f32,
    alpha2: f32,
    /// `√(α² + (1 - α²) cos² θo)`, a part of Smith's term.
    masking: f32,
    /// Weight of the diffuse base, with the share of the lobe that guides like it.
    diffuse: f32,
    /// Weight of the lobe.
    share: f32,
}

impl GgxLobe {
    /// Returns the weight of the lobe in a unit direction of this cosine, blurred by a variance of directions.
    #[inline(always)]
    fn value(&self, cosine: f32, [x, y, z]: [f32; 3], spread2: f32) -> f32 {
        let (sine2, sum2) = self.half_vector([x, y, z]);
        // (o·h)² is a quarter of |ω + o|².
        let blur = 0.25 * spread2;
        let widths2 = (self.alpha2 + blur) * (self.alpha2 + blur * (4.0 / sum2));
        let width2 = at_most(sqrt(widths2), 1.0);
        // In this form nothing cancels where the lobe is narrow. π D:
        let tail = sine2 + (1.0 - sine2) * width2;
        let distribution = width2 / (tail * tail);
        // G / (4 cos θ cos θo):
        let shadowing = sqrt(self.alpha2 + (1.0 - self.alpha2) * (cosine * cosine));
        let visibility = 0.5 / (cosine * self.masking + self.cosine * shadowing);
        self.share * distribution * (visibility * cosine)
    }

    /// Returns the squared sine of the angle between the half vector and the normal, and the squared length of the sum
    /// of both directions.
    #[inline(always)]
    fn half_vector(&self, [x, y, z]: [f32; 3]) -> (f32, f32) {
        let ([nx, ny, nz], [ox, oy, oz]) = (self.normal, self.outgoing);
        let (hx, hy, hz) = (x + ox, y + oy, z + oz);
        let sum2 = at_least(hx * hx + hy * hy + hz * hz, LEAST_SUM2);
        let along = nx * hx + ny * hy + nz * hz;
        // What lies across, and not the difference of squares: that would cancel.
        let (hx, hy, hz) = (hx - nx * along, hy - ny * along, hz - nz * along);
        (at_most((hx * hx + hy * hy + hz * hz) / sum2, 1.0), sum2)
    }
}

impl Lobe for GgxLobe {
    #[inline(always)]
    fn weigh(&self, toward: f32, center: [f32; 3], distance: f32, spread2: f32) -> f32 {
        let inverse = 1.0 / distance;
        let [x, y, z] = center;
        let value = self.value(toward * inverse, [x * inverse, y * inverse, z * inverse], spread2);
        self.diffuse * toward + distance * (value + LEAST_LOBE_WEIGHT * self.share)
    }

    /// The logarithm of D changes by 4 h / (α² + h²) for each step of the half vector, which is 2 / √(α² + h²) where
    /// that is largest.
    #[inline(always)]
    fn variation(&self, direction: [f32; 3], spread2: f32) -> f32 {
        let (sine2, sum2) = self.half_vector(direction);
        let blur = 0.25 * spread2 * at_least(4.0 / sum2, 1.0);
        8.0 * blur / (self.alpha2 + sine2)
    }

    #[inline(always)]
    fn map(self, map: impl Fn([f32; 3]) -> [f32; 3]) -> Self {
        Self { normal: map(self.normal), outgoing: map(self.outgoing), ..self }
    }
}

/// What concerns the cosine is that of an opaque surface.
impl ReceiverKind for Glossy {
    #[inline]
    fn weight(self, direction: Vec3) -> f32 {
        let cosine = self.surface().weight(direction);
        if cosine > 0.0 {
            (1.0 - self.share) * cosine + self.lobe().value(cosine, direction.to_array(), 0.0)
        } else {
            0.0
        }
    }

    #[inline(always)]
    fn normal(self) -> Vec3 {
        self.normal
    }

    #[inline(always)]
    fn is_dark(self, vertices: &[Vec3; 3]) -> bool {
        self.surface().is_dark(vertices)
    }

    #[inline(always)]
    fn has_horizon(self) -> bool {
        true
    }

    #[inline(always)]
    fn mean_over_cone(self, axis: Vec3, sin_radius: f32) -> f32 {
        let cosine = self.surface().mean_over_cone(axis, sin_radius);
        // A disk of the radius R has a variance of R² / 2.
        let mean = self.lobe().weigh(cosine, axis.to_array(), 1.0, 0.5 * sin_radius * sin_radius);
        only_if(cosine > 0.0, mean)
    }

    #[inline(always)]
    fn height_weights(self) -> HeightWeights {
        self.surface().height_weights()
    }

    #[inline]
    fn weight_at_height(self, height: f32, inverse_distance: f32) -> f32 {
        self.surface().weight_at_height(height, inverse_distance)
    }

    /// The diffuse part is exact. The lobe's is the sum over small parts, each weighed at its center.
    fn irradiance(self, vertices: &[Vec3; 3]) -> f32 {
        let lobe = self.lobe();
        let mean = mean_over_parts(vertices, |point, distance, variance| {
            let cosine = self.normal.dot(point) / distance;
            (cosine > 0.0).then(|| lobe.value(cosine, (point / distance).to_array(), variance))
        });
        lobe.diffuse * lambert(self.normal, vertices) + mean * solid_angle(vertices) * (1.0 / PI)
    }

    #[inline(always)]
    fn least_over_directions(self, solid_angle: f32) -> f32 {
        self.surface().least_over_directions(solid_angle)
    }

    #[inline(always)]
    fn lanes(self, position: Vec3) -> ReceiverLanes {
        self.surface().lanes(position)
    }
}
