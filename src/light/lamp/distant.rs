//! A light infinitely far away: one direction, or all directions of a cap.
//!
//! It has no place, so it is never in the tree over the lights. What samples it is in
//! [`distant`](crate::light::distant).

use core::f32::consts::{FRAC_PI_2, PI};

use glam::{DVec3, Vec3};

use super::{LampFault, LampKind, Reach, ShapeView, VALUES, check_axis, check_weight, within};
use crate::geometry::{Aabb, Cone};
use crate::light::emitted::EmittedRay;
use crate::light::profiles::Profiles;
use crate::math;
use crate::receiver::ShadingPoint;
use crate::warp::Variate;

/// Least angular radius that is not zero, in radians. *Proved*: directions in single precision, 6e-8, resolve it to a
/// hundredth. Larger: suns of other planets are refused. Smaller: samples lie beside the light that they are of.
const LEAST_RADIUS: f32 = 1e-5;

/// A light infinitely far away, such as the sun or the moon.
///
/// Without an angular radius, light travels in one direction, and samples are
/// [`SampledLight::Punctual`](crate::SampledLight::Punctual): `pdf` is a probability. With one, the same irradiance
/// comes from a cap of directions of constant radiance, and samples are
/// [`SampledLight::Shape`](crate::SampledLight::Shape).
///
/// ```
/// use fanlight::glam::Vec3;
/// use fanlight::{DistantLight, LightSampler, ShadingPoint};
///
/// let sun = DistantLight::new(Vec3::new(0.0, -0.6, -0.8), 1000.0).angular_radius(0.00465);
/// let lights = LightSampler::builder().light(sun)?.build()?;
/// let here = lights.at(&ShadingPoint::surface(Vec3::ZERO, Vec3::Z));
/// let sample = here.sample([0.5; 3]).expect("the sun is above the horizon");
/// // All of the irradiance is the sun's, and nothing of it is noise.
/// let irradiance = sun.radiance() * sample.direction.z / sample.pdf;
/// assert!((irradiance - 800.0).abs() < 0.1);
/// # Ok::<(), fanlight::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub struct DistantLight {
    axis: Vec3,
    irradiance: f32,
    radius: f32,
}

impl DistantLight {
    /// Returns a light that travels along `axis`, of any length. `irradiance` is the luminance of the irradiance on a
    /// surface that faces the light.
    pub fn new(axis: Vec3, irradiance: f32) -> Self {
        Self { axis: axis.as_dvec3().normalize_or_zero().as_vec3(), irradiance, radius: 0.0 }
    }

    /// Sets the angle in radians from the middle of the light to its rim, as seen from anywhere: from 1e-5 to π, or 0
    /// for a light without an extent, which is the default. The irradiance stays the same.
    pub const fn angular_radius(mut self, radius: f32) -> Self {
        self.radius = radius;
        self
    }

    /// Returns the radiance that arrives from each direction of the light: the irradiance over π sin² r for an angular
    /// radius r, and over π from a right angle on. Infinite for a light without an extent.
    #[must_use]
    pub fn radiance(&self) -> f32 {
        self.irradiance / self.facing()
    }

    /// Irradiance on a surface that faces a light of unit radiance.
    fn facing(&self) -> f32 {
        let (sin, _) = math::sin_cos(self.radius.min(FRAC_PI_2));
        PI * sin * sin
    }

    /// Direction in which light travels, irradiance, and angular radius.
    pub(in crate::light) fn numbers(&self) -> (Vec3, f32, f32) {
        (self.axis, self.irradiance, self.radius)
    }
}

impl From<DistantLight> for super::Lamp {
    fn from(light: DistantLight) -> Self {
        Self::Distant(light)
    }
}

/// What a light has that is nowhere.
impl LampKind for DistantLight {
    const CODE: u32 = 6;

    fn to_values(self) -> [f32; VALUES] {
        let [x, y, z] = self.axis.to_array();
        [x, y, z, self.irradiance, self.radius, 0.0, 0.0, 0.0, 0.0, 0.0]
    }

    fn from_values([x, y, z, irradiance, radius, ..]: [f32; VALUES]) -> Self {
        Self { axis: Vec3::new(x, y, z), irradiance, radius }
    }

    fn check(&self) -> Result<(), LampFault> {
        check_axis("length of the axis", self.axis)?;
        check_weight("irradiance", self.irradiance)?;
        if self.radius == 0.0 {
            return Ok(());
        }
        within("angular radius", self.radius, [LEAST_RADIUS, PI], "0, or from 1e-5 to π")?;
        within("radiance", self.radiance(), [0.0, 1e38], "at most 1e38")
    }

    fn has_extent(&self) -> bool {
        self.radius > 0.0
    }

    fn weight(&self) -> f32 {
        self.irradiance
    }

    /// Zero, so that nothing of the light is in the tree.
    fn area(&self, _profiles: Profiles<'_>) -> f32 {
        0.0
    }

    fn reach(&self, _profiles: Profiles<'_>) -> Reach {
        Reach {
            aabb: Aabb { min: Vec3::ZERO, max: Vec3::ZERO },
            normals: Cone::single(self.axis),
            emission: self.radius,
            two_sided: false,
            mean: Vec3::ZERO,
            variance: 0.0,
            normal: self.axis,
        }
    }

    fn view(&self, _x: &ShadingPoint, _profiles: Profiles<'_>) -> Option<ShapeView> {
        None
    }

    fn is_crossed(&self, _origin: Vec3, _direction: DVec3) -> bool {
        false
    }

    /// Never called, as nothing of the light is in the tree.
    fn emit(&self, _point: [Variate; 2], _direction: [Variate; 2], _side: f64, _profiles: Profiles<'_>) -> EmittedRay {
        EmittedRay::from_point(Vec3::ZERO, self.axis, 0.0)
    }

    fn emission_pdf(&self, _direction: Vec3, _profiles: Profiles<'_>) -> f64 {
        0.0
    }
}
