//! A point that sends radiant intensity into a cone, with a smooth falloff to its rim.

use core::f32::consts::FRAC_PI_2;

use glam::{DVec3, Vec3};

use super::point::PointView;
use super::{LampFault, LampKind, Reach, ShapeView, VALUES, check_axis, check_position, check_weight, within};
use crate::geometry::{Aabb, Cone};
use crate::light::emitted::EmittedRay;
use crate::light::profiles::Profiles;
use crate::math;
use crate::receiver::ShadingPoint;
use crate::warp::Variate;
use crate::warp::spherical_cap::SphericalCap;

/// How far rounding to single precision may move a unit vector. *Proved*: 6e-8 a component. A larger one would give
/// densities to directions beside the cone.
const DIRECTION_ROUNDING: f64 = 2e-7;

/// A point without an extent that sends light into a cone.
///
/// Up to the inner angle the intensity is constant. From there to the outer angle it falls to zero, by the smooth step
/// of the cosine (`t² (3 - 2 t)`). Samples of it are [`SampledLight::Punctual`](crate::SampledLight::Punctual).
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub struct SpotLight {
    position: Vec3,
    axis: Vec3,
    intensity: f32,
    inner: f32,
    outer: f32,
}

impl SpotLight {
    /// Returns a spot. Light travels along `axis`, of any length. `intensity` is the luminance of the radiant intensity
    /// on the axis: power per solid angle. `inner` and `outer` are the angles from the axis, in radians up to π/2,
    /// between which the intensity falls off.
    pub fn new(position: Vec3, axis: Vec3, intensity: f32, [inner, outer]: [f32; 2]) -> Self {
        Self { position, axis: axis.as_dvec3().normalize_or_zero().as_vec3(), intensity, inner, outer }
    }

    /// Returns the intensity in a unit direction in which light travels.
    #[must_use]
    pub fn intensity_towards(&self, direction: Vec3) -> f32 {
        self.intensity * self.falloff(direction.as_dvec3()) as f32
    }

    /// Returns the share of the intensity in a unit direction.
    fn falloff(&self, direction: DVec3) -> f64 {
        let [inner, outer] = [self.inner, self.outer].map(|angle| math::cos64(angle.into()));
        let cosine = self.axis.as_dvec3().dot(direction);
        if cosine <= outer {
            return 0.0;
        }
        let t = if cosine >= inner { 1.0 } else { (cosine - outer) / (inner - outer) };
        t * t * (3.0 - 2.0 * t)
    }

    /// Returns the directions in which light leaves.
    fn cap(&self) -> SphericalCap {
        let cos = math::cos64(self.outer.into());
        let sin = math::cos64(f64::from(self.outer) - core::f64::consts::FRAC_PI_2);
        SphericalCap { axis: self.axis.as_dvec3(), sin, cos: cos.max(0.0) }
    }
}

impl From<SpotLight> for super::Lamp {
    fn from(spot: SpotLight) -> Self {
        Self::Spot(spot)
    }
}

impl LampKind for SpotLight {
    const CODE: u32 = 3;

    fn to_values(self) -> [f32; VALUES] {
        let ([x, y, z], [i, j, k]) = (self.position.to_array(), self.axis.to_array());
        [x, y, z, i, j, k, self.intensity, self.inner, self.outer, 0.0]
    }

    fn from_values([x, y, z, i, j, k, intensity, inner, outer, _]: [f32; VALUES]) -> Self {
        Self { position: Vec3::new(x, y, z), axis: Vec3::new(i, j, k), intensity, inner, outer }
    }

    fn check(&self) -> Result<(), LampFault> {
        check_position("position", self.position, 0.0)?;
        check_axis("length of the axis", self.axis)?;
        check_weight("intensity", self.intensity)?;
        within("outer angle", self.outer, [1e-4, FRAC_PI_2], "from 1e-4 to π/2")?;
        within("inner angle", self.inner, [0.0, self.outer], "from 0 to the outer angle")
    }

    fn has_extent(&self) -> bool {
        false
    }

    fn weight(&self) -> f32 {
        self.intensity
    }

    /// The tree takes a light for a surface, whose intensity along its normal is radiance times area.
    fn area(&self, _profiles: Profiles<'_>) -> f32 {
        1.0
    }

    fn reach(&self, _profiles: Profiles<'_>) -> Reach {
        Reach {
            aabb: Aabb { min: self.position, max: self.position },
            normals: Cone::single(self.axis),
            emission: self.outer,
            two_sided: false,
            mean: self.position,
            variance: 0.0,
            normal: self.axis,
        }
    }

    fn view(&self, x: &ShadingPoint, _profiles: Profiles<'_>) -> Option<ShapeView> {
        PointView::new(self.position, x.position, |direction| self.falloff(direction)).map(ShapeView::Point)
    }

    fn is_crossed(&self, _origin: Vec3, _direction: DVec3) -> bool {
        false
    }

    fn emit(&self, _point: [Variate; 2], direction: [Variate; 2], _side: f64, _profiles: Profiles<'_>) -> EmittedRay {
        let cap = self.cap();
        let direction = cap.direction(direction.map(|u| u.value())).as_vec3();
        EmittedRay::from_point(self.position, direction, 1.0 / cap.solid_angle())
    }

    fn emission_pdf(&self, direction: Vec3, _profiles: Profiles<'_>) -> f64 {
        let (cap, direction) = (self.cap(), direction.as_dvec3());
        let (along, across) = (cap.axis.dot(direction), cap.axis.cross(direction).length());
        let is_inside = along >= cap.cos - DIRECTION_ROUNDING && across <= cap.sin + DIRECTION_ROUNDING;
        if is_inside { 1.0 / cap.solid_angle() } else { 0.0 }
    }
}
