//! A point that sends the same radiant intensity in all directions.

use core::f32::consts::PI;

use glam::{DVec3, Vec3};

use super::{LampFault, LampKind, Reach, ShapeView, ShapeViewKind, VALUES, check_position, check_weight};
use crate::geometry::{Aabb, Cone};
use crate::light::emitted::EmittedRay;
use crate::light::profiles::Profiles;
use crate::math;
use crate::receiver::{Receiver, ReceiverKind, ShadingPoint};
use crate::warp::Variate;
use crate::warp::spherical_cap::{self, SphericalCap};

/// What makes the intensity of a point compete with radiance times area: a sphere of this area over its radiance has
/// that intensity. *Proved*: the intensity of a sphere is its radiance times π r², its area is 4 π r².
const AREA: f32 = 4.0;

/// A point without an extent that sends light in all directions.
///
/// The irradiance from it is intensity times cosine over squared distance. Samples of it are
/// [`SampledLight::Punctual`](crate::SampledLight::Punctual).
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub struct PointLight {
    position: Vec3,
    intensity: f32,
}

impl PointLight {
    /// Returns a point light. `intensity` is the luminance of the radiant intensity: power per solid angle.
    pub const fn new(position: Vec3, intensity: f32) -> Self {
        Self { position, intensity }
    }
}

impl From<PointLight> for super::Lamp {
    fn from(point: PointLight) -> Self {
        Self::Point(point)
    }
}

impl LampKind for PointLight {
    const CODE: u32 = 2;

    fn to_values(self) -> [f32; VALUES] {
        let [x, y, z] = self.position.to_array();
        [x, y, z, self.intensity, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    }

    fn from_values([x, y, z, intensity, ..]: [f32; VALUES]) -> Self {
        Self { position: Vec3::new(x, y, z), intensity }
    }

    fn check(&self) -> Result<(), LampFault> {
        check_position("position", self.position, 0.0)?;
        check_weight("intensity", self.intensity)
    }

    fn has_extent(&self) -> bool {
        false
    }

    fn weight(&self) -> f32 {
        self.intensity
    }

    fn area(&self, _profiles: Profiles<'_>) -> f32 {
        AREA
    }

    fn reach(&self, _profiles: Profiles<'_>) -> Reach {
        Reach {
            aabb: Aabb { min: self.position, max: self.position },
            normals: Cone { axis: Vec3::Z, theta: PI },
            emission: PI,
            two_sided: false,
            mean: self.position,
            variance: 0.0,
            normal: Vec3::ZERO,
        }
    }

    fn view(&self, x: &ShadingPoint, _profiles: Profiles<'_>) -> Option<ShapeView> {
        PointView::new(self.position, x.position, |_| 1.0).map(ShapeView::Point)
    }

    fn is_crossed(&self, _origin: Vec3, _direction: DVec3) -> bool {
        false
    }

    fn emit(&self, _point: [Variate; 2], direction: [Variate; 2], _side: f64, profiles: Profiles<'_>) -> EmittedRay {
        let direction = spherical_cap::uniform_direction(direction.map(|u| u.value())).as_vec3();
        EmittedRay::from_point(self.position, direction, self.emission_pdf(direction, profiles))
    }

    fn emission_pdf(&self, _direction: Vec3, _profiles: Profiles<'_>) -> f64 {
        1.0 / SphericalCap::whole().solid_angle()
    }
}

/// A point with an intensity as seen from another one.
#[derive(Clone, Copy, Debug)]
pub(super) struct PointView {
    /// Relative to the other point.
    relative: DVec3,
    /// Unit vector to it.
    direction: DVec3,
    /// Intensity towards the other point if the weight of the light is 1.
    intensity: f64,
}

impl PointView {
    /// Returns the view of a light at `light` from `position`; `None` where nothing can arrive. `intensity` is that in
    /// a unit direction.
    pub(super) fn new(light: Vec3, position: Vec3, intensity: impl FnOnce(DVec3) -> f64) -> Option<Self> {
        let relative = light.as_dvec3() - position.as_dvec3();
        let direction = relative.try_normalize()?;
        let intensity = intensity(-direction);
        (intensity > 0.0).then_some(Self { relative, direction, intensity })
    }
}

impl ShapeViewKind for PointView {
    fn draw(&self, _u: [Variate; 2]) -> DVec3 {
        self.direction
    }

    fn pdf(&self, _direction: DVec3) -> f64 {
        1.0
    }

    fn point(&self, _direction: DVec3) -> DVec3 {
        self.relative
    }

    fn normal(&self, _point: DVec3) -> DVec3 {
        -self.direction
    }

    fn solid_angle_per_area(&self, _point: DVec3) -> f64 {
        1.0
    }

    fn highest(&self, normal: DVec3) -> [f64; 2] {
        [normal.dot(self.relative), normal.abs().dot(self.relative.abs())]
    }

    fn irradiance(&self, receiver: Receiver) -> f64 {
        let weight = f64::from(receiver.weight(self.direction.as_vec3()));
        let distance = math::sqrt64(self.relative.length_squared());
        // Twice divided: a square could vanish.
        self.intensity * weight / distance / distance
    }
}
