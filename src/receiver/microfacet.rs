//! A surface with microfacet lobes of any kind: reflection of one roughness along a tangent and of another across, and
//! transmission to the other side.
//!
//! The weight of a direction ω is π times what the surface scatters of it. In the terms of Walter et al. 2007, with η
//! the index of refraction on the side of ω relative to that of the outgoing direction o (1 for a reflection), the half
//! vector is `h = ± (o + η ω) / |o + η ω|`, and
//!
//! ```text
//! π f cos θ = π D(h) G(ω, o) / (4 cos θo) · 4 η² |o·h| |ω·h| / |o + η ω|²
//! ```
//!
//! The last factor, the quotient of the two Jacobians, is 1 for a reflection. D is the anisotropic GGX distribution,
//! and G Smith's height-correlated term (Heitz 2014). Without a change of index light passes straight on; the lobe is
//! then the reflection, mirrored to the other side.
//!
//! Over a region of directions with the variance s², the half vector moves by `η |ω·h| / |o + η ω|` of it in the plane
//! of incidence, and by `η / |o + η ω|` across. Both widen the distribution: to the matrix of the roughnesses,
//! `diag(αx², αy²)`, that of this movement is added.

mod lobe;

use core::f32::consts::PI;

use glam::{DVec3, Vec3};

use super::glossy::{LEAST_LOBE_WEIGHT, LEAST_OUTGOING, LEAST_ROUGHNESS};
use super::lambert::{lambert, solid_angle};
use super::lanes::ReceiverLanes;
use super::lobe::{EVEN_SHARE, Lobe, unit_or_zero};
use super::parts::mean_over_parts;
use super::surface::Surface;
use super::transmissive::Transmissive;
use super::{Glossy, HeightWeights, Receiver, ReceiverKind, unit};
use crate::math::{at_least, at_most, atan2_64, only_if, sin_cos, sqrt, sqrt64};
pub(crate) use lobe::MicrofacetLobe;
use lobe::{Halfway, Side};

/// Difference of the index of refraction from 1 up to which light passes straight on. Chosen.
///
/// Larger: surfaces that do refract are taken for thin ones. Smaller: the rounding of half vectors would show.
const THIN: f32 = 0.01;

/// Range of the relative index of refraction. Chosen: all materials are within, seen from either side.
const INDICES: [f32; 2] = [0.1, 10.0];

/// Least squared length of what a direction has across a half vector. *Proved*: rounding leaves as much. Larger: half
/// vectors near the directions are blurred as if these were on it.
const LEAST_ACROSS2: f32 = 1e-12;

/// Sum of all weights of a surface. *Format.*
const ALL_SHARES: u16 = u16::MAX;

/// A surface with a glossy reflection and a rough transmission over a diffuse base, seen from an outgoing direction.
///
/// As with [`Glossy`], the lobes *guide*: densities are exact whatever the host's own BSDF is. A reflection of one
/// roughness in all directions and without a transmission is faster as a [`Glossy`].
///
/// ```
/// use fanlight::{Glossy, Microfacet, ShadingPoint, glam::Vec3};
///
/// let (normal, outgoing) = (Vec3::Z, Vec3::new(0.6, 0.0, 0.8));
/// // Brushed along x.
/// let steel = Glossy::new(normal, outgoing, 0.2).anisotropic(Vec3::X, [0.05, 0.4]);
/// let x = ShadingPoint::microfacet(Vec3::ZERO, steel);
/// let mirror = Vec3::new(-0.6, 0.0, 0.8);
/// assert!(x.weight((mirror + 0.3 * Vec3::Y).normalize()) > x.weight((mirror + 0.3 * Vec3::X).normalize()));
///
/// // Ground glass that reflects 8 %: lights on the other side are seen.
/// let glass = Microfacet::new(normal, outgoing, 0.2).with_weights(0.0, 0.08, 0.92).with_ior(1.5);
/// let x = ShadingPoint::microfacet(Vec3::ZERO, glass);
/// assert!(x.weight(Vec3::new(-0.4, 0.0, -0.91652)) > x.weight(mirror));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub struct Microfacet {
    /// Unit normal.
    normal: Vec3,
    /// Unit vector; zero if there is none.
    outgoing: Vec3,
    /// Angle of the tangent around the normal.
    angle: f32,
    /// Along the tangent and across.
    roughness: [f32; 2],
    /// Relative index of refraction; 1 for a thin surface.
    ior: f32,
    /// Weights of the reflection and of the transmission, relative to the sum of all; [`ALL_SHARES`] is 1.
    shares: [u16; 2],
}

// A receiver of any kind is as large as this, and is copied for every one of them.
const _: () = assert!(size_of::<Microfacet>() <= 44);

impl Microfacet {
    /// Returns a surface that has nothing but a reflection, of one roughness in all directions.
    ///
    /// All parameters are those of [`Glossy::new`]. The outgoing direction must be on the side of the normal. If it is
    /// not, has no direction, or a roughness is NaN, the point is guided like a diffuse one, and with a transmission
    /// like a transmissive one.
    pub fn new(normal: Vec3, outgoing: Vec3, roughness: f32) -> Self {
        let (normal, outgoing) = (unit(normal), unit_or_zero(outgoing));
        let surface = Self { normal, outgoing, angle: 0.0, roughness: [1.0; 2], ior: 1.0, shares: [ALL_SHARES, 0] };
        surface.with_roughness([roughness; 2])
    }

    /// Returns the same surface with a roughness along a tangent and one across.
    ///
    /// - `tangent` is any vector; what it has along the normal does not count, and its length does not matter.
    /// - `roughness` are the αx and αy of the GGX distribution, each as in [`Glossy::new`]: along the tangent and
    ///   across it.
    ///
    /// If the tangent has no direction across the normal, the surface is as rough in all directions, by the geometric
    /// mean.
    pub fn anisotropic(self, tangent: Vec3, roughness: [f32; 2]) -> Self {
        let surface = self.with_roughness(roughness);
        let (along, axes) = (unit_or_zero(tangent).as_dvec3(), axes_across(self.normal));
        let [x, y] = axes.map(|axis| axis.dot(along));
        // NaN fails.
        if x * x + y * y > f64::from(LEAST_ACROSS2) {
            return Self { angle: atan2_64(y, x) as f32, ..surface };
        }
        let [x, y] = surface.roughness.map(f64::from);
        Self { roughness: [sqrt64(x * y) as f32; 2], ..surface }
    }

    fn with_roughness(self, roughness: [f32; 2]) -> Self {
        if roughness.iter().any(|alpha| alpha.is_nan()) {
            return Self { outgoing: Vec3::ZERO, roughness: [1.0; 2], ..self };
        }
        Self { roughness: roughness.map(|alpha| alpha.clamp(LEAST_ROUGHNESS, 1.0)), ..self }
    }

    /// Returns the same surface with these albedos of the diffuse base, of the reflection, and of the transmission: the
    /// shares of light that each scatters, such as luminances, with Fresnel or without.
    ///
    /// Only their ratios matter. What is negative or NaN counts as zero, and an infinite one as a large number. If the
    /// last two are zero, the point is guided like a diffuse one. The factor η² by which a refraction changes radiance
    /// may be in the weight of the transmission.
    pub fn with_weights(self, diffuse: f32, reflected: f32, transmitted: f32) -> Self {
        let weights =
            [diffuse, reflected, transmitted].map(|weight| f64::from(at_most(at_least(weight, 0.0), f32::MAX)));
        let sum: f64 = weights.iter().sum();
        // What is positive stays so, and all of it adds up.
        let code = |weight: f64| {
            let share = weight / sum * f64::from(ALL_SHARES);
            if weight > 0.0 { (share as u16).saturating_add(1) } else { 0 }
        };
        let [diffuse, reflected, transmitted] = weights;
        let base = code(diffuse).min(ALL_SHARES - 2);
        let shares = match [reflected > 0.0, transmitted > 0.0] {
            [false, false] => [0; 2],
            [true, false] => [ALL_SHARES - base, 0],
            [false, true] => [0, ALL_SHARES - base],
            [true, true] => {
                let transmitted = code(transmitted).min(ALL_SHARES - 1 - base);
                [ALL_SHARES - base - transmitted, transmitted]
            }
        };
        Self { shares, ..self }
    }

    /// Returns the same surface with an index of refraction: that of the far side, relative to the side of the normal.
    /// A glass of 1.5 has 1.5 as seen from the air, and 1 / 1.5 as seen from inside.
    ///
    /// Within 0.01 of 1, as without this call, light passes straight on, and what is transmitted is spread as the
    /// reflection is: a thin wall, such as a pane with air on both sides. NaN counts as 1, and what is below 0.1 or
    /// above 10 as these.
    pub fn with_ior(self, ior: f32) -> Self {
        // NaN fails.
        let refracts = (ior - 1.0).abs() > THIN;
        Self { ior: if refracts { ior.clamp(INDICES[0], INDICES[1]) } else { 1.0 }, ..self }
    }

    /// Whether there is a lobe.
    #[inline]
    pub(super) fn has_lobe(&self) -> bool {
        self.shares != [0; 2] && self.normal.dot(self.outgoing) > 0.0
    }

    /// Whether light comes from both sides.
    #[inline(always)]
    pub(super) fn transmits(&self) -> bool {
        self.shares[1] > 0
    }

    /// Returns the receiver that has the same cosine, and no lobe.
    #[inline]
    pub(super) fn without_lobe(&self) -> Receiver {
        if self.transmits() { Receiver::Transmissive(self.normal) } else { Receiver::Surface(self.normal) }
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

    /// Returns the tangent, a unit vector across the normal.
    #[must_use]
    pub fn tangent(&self) -> Vec3 {
        let [s, t] = axes_across(self.normal);
        let (sin, cos) = sin_cos(self.angle);
        (s * f64::from(cos) + t * f64::from(sin)).as_vec3()
    }

    /// Returns the roughnesses along the tangent and across it that guide, in `[1e-3, 1]`.
    #[must_use]
    pub fn roughness(&self) -> [f32; 2] {
        self.roughness
    }

    /// Returns the relative index of refraction that guides; 1 for a thin surface.
    #[must_use]
    pub fn ior(&self) -> f32 {
        self.ior
    }

    /// Returns the weights of the diffuse base, of the reflection and of the transmission, which add up to 1, in steps
    /// of 1 / 65535.
    #[must_use]
    pub fn weights(&self) -> [f32; 3] {
        let [reflected, transmitted] = self.shares;
        let rest = ALL_SHARES - reflected - transmitted;
        [rest, reflected, transmitted].map(|share| f32::from(share) * (1.0 / f32::from(ALL_SHARES)))
    }

    /// Returns the surface with all vectors mapped.
    #[inline]
    pub(super) fn map(self, map: impl Fn(Vec3) -> Vec3) -> Self {
        let [normal, outgoing, tangent] = [self.normal, self.outgoing, self.tangent()].map(map);
        let [x, y] = axes_across(normal).map(|axis| axis.dot(tangent.as_dvec3()));
        Self { normal, outgoing, angle: atan2_64(y, x) as f32, ..self }
    }

    /// Returns the mean weight of the directions of a cone, by the lobe of the surface.
    #[inline(always)]
    fn mean_by(self, lobe: &MicrofacetLobe, axis: Vec3, sin_radius: f32) -> f32 {
        let cosine = if self.transmits() {
            self.transmissive().mean_over_cone(axis, sin_radius)
        } else {
            self.surface().mean_over_cone(axis, sin_radius)
        };
        // A disk of the radius R has a variance of R² / 2.
        let mean = lobe.weigh(cosine, axis.to_array(), 1.0, 0.5 * sin_radius * sin_radius);
        only_if(cosine > 0.0, mean)
    }

    #[inline(always)]
    fn surface(self) -> Surface {
        Surface { normal: self.normal }
    }

    #[inline(always)]
    fn transmissive(self) -> Transmissive {
        Transmissive { normal: self.normal }
    }

    /// Returns the lobe prepared for loops.
    #[inline(always)]
    pub(crate) fn lobe(&self) -> MicrofacetLobe {
        let tangent = self.tangent();
        let frame = [tangent, self.normal.cross(tangent), self.normal];
        let [t, b, n] = frame.map(|axis| axis.dot(self.outgoing));
        let n = at_least(n, LEAST_OUTGOING);
        let [x2, y2] = self.roughness.map(|alpha| alpha * alpha);
        let is_thin = self.ior == 1.0;
        let [diffuse, reflected, transmitted] = self.weights();
        MicrofacetLobe {
            frame: frame.map(|axis| axis.to_array()),
            outgoing: [t, b, n],
            alpha2: [x2, y2],
            masking: sqrt(n * n + x2 * t * t + y2 * b * b),
            sides: [
                Side {
                    ior: 1.0,
                    upright: 1.0,
                    turn: 1.0,
                    even: diffuse + EVEN_SHARE * reflected,
                    other: transmitted,
                    share: reflected,
                },
                Side {
                    ior: self.ior,
                    upright: if is_thin { -1.0 } else { 1.0 },
                    turn: if is_thin { 1.0 } else { -1.0 },
                    even: EVEN_SHARE * transmitted,
                    other: diffuse + reflected,
                    share: transmitted,
                },
            ],
            least: LEAST_LOBE_WEIGHT * (reflected + transmitted),
            transmits: if self.transmits() { 1.0 } else { 0.0 },
        }
    }
}

impl From<Glossy> for Microfacet {
    fn from(surface: Glossy) -> Self {
        let [diffuse, reflected] = surface.weights();
        Self::new(surface.normal(), surface.outgoing(), surface.roughness()).with_weights(diffuse, reflected, 0.0)
    }
}

impl Glossy {
    /// Returns the same surface with a roughness along a tangent and one across; see [`Microfacet::anisotropic`].
    pub fn anisotropic(self, tangent: Vec3, roughness: [f32; 2]) -> Microfacet {
        Microfacet::from(self).anisotropic(tangent, roughness)
    }
}

/// Returns two unit vectors across a normal and each other.
#[inline]
fn axes_across(normal: Vec3) -> [DVec3; 2] {
    let (s, t) = normal.as_dvec3().normalize_or(DVec3::Z).any_orthonormal_pair();
    [s, t]
}

/// What concerns the cosine is that of an opaque surface, or of a transmissive one.
impl ReceiverKind for Microfacet {
    /// No less than a thousandth of the cosine: what a refraction leaves out may be in the host's own lobe.
    #[inline]
    fn weight(self, direction: Vec3) -> f32 {
        let lobe = self.lobe();
        let local = lobe.local(direction.to_array());
        let [_, _, height] = local;
        // NaN fails.
        if !(height > 0.0 || self.transmits() && height < 0.0) {
            return 0.0;
        }
        let side = lobe.side(height);
        // A half vector below the horizon belongs to no facet.
        let Halfway { sum: [_, _, upward], along: [out, _], .. } = lobe.halfway(&side, local);
        let is_below = side.turn < 0.0 && !(upward * out > 0.0);
        let value = if is_below { 0.0 } else { lobe.value(&side, height.abs(), local, 0.0) };
        at_least(self.weights()[0] * at_least(height, 0.0) + value, lobe.least * height.abs())
    }

    #[inline(always)]
    fn normal(self) -> Vec3 {
        self.normal
    }

    #[inline(always)]
    fn is_dark(self, vertices: &[Vec3; 3]) -> bool {
        !self.transmits() && self.surface().is_dark(vertices)
    }

    #[inline(always)]
    fn has_horizon(self) -> bool {
        !self.transmits()
    }

    #[inline(always)]
    fn mean_over_cone(self, axis: Vec3, sin_radius: f32) -> f32 {
        self.mean_by(&self.lobe(), axis, sin_radius)
    }

    #[inline(always)]
    fn means_over_cones<const LANES: usize>(
        self,
        [x, y, z]: &[[f32; LANES]; 3],
        sin_radii: &[f32; LANES],
        means: &mut [f32; LANES],
    ) {
        let lobe = self.lobe();
        for i in 0..LANES {
            means[i] = self.mean_by(&lobe, Vec3::new(x[i], y[i], z[i]), sin_radii[i]);
        }
    }

    #[inline(always)]
    fn height_weights(self) -> HeightWeights {
        if self.transmits() { self.transmissive().height_weights() } else { self.surface().height_weights() }
    }

    #[inline]
    fn weight_at_height(self, height: f32, inverse_distance: f32) -> f32 {
        let height = if self.transmits() { height.abs() } else { height };
        self.surface().weight_at_height(height, inverse_distance)
    }

    /// The diffuse part is exact. The lobes' is the sum over small parts, each weighed at its center.
    fn irradiance(self, vertices: &[Vec3; 3]) -> f32 {
        let lobe = self.lobe();
        let mean = mean_over_parts(vertices, |point, distance, variance| {
            let [t, b, n] = lobe.local((point / distance).to_array());
            let is_seen = n > 0.0 || self.transmits();
            is_seen.then(|| lobe.value(&lobe.side(n), n.abs(), [t, b, n], variance))
        });
        let [above, below] = lobe.sides;
        let opposite = if self.transmits() { below.even * lambert(-self.normal, vertices) } else { 0.0 };
        above.even * lambert(self.normal, vertices) + opposite + mean * solid_angle(vertices) * (1.0 / PI)
    }

    #[inline(always)]
    fn least_over_directions(self, solid_angle: f32) -> f32 {
        if self.transmits() {
            self.transmissive().least_over_directions(solid_angle)
        } else {
            self.surface().least_over_directions(solid_angle)
        }
    }

    #[inline(always)]
    fn lanes(self, position: Vec3) -> ReceiverLanes {
        if self.transmits() { self.transmissive().lanes(position) } else { self.surface().lanes(position) }
    }
}

#[cfg(test)]
mod tests;
