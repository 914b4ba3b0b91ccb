//! A sphere of constant radiance, sampled by the cone that it fills: by its solid angle, or by the cosine over a
//! surface.

use core::f32::consts::PI;

use glam::{DVec3, Vec3};

use super::{
    LampFault, LampKind, Reach, ShapeView, ShapeViewKind, VALUES, check_length, check_position, check_weight,
    irradiance_of_cap,
};
use crate::geometry::{Aabb, Cone};
use crate::light::Sides;
use crate::light::emitted::{EmittedRay, cosine_ray, per_direction};
use crate::light::profiles::Profiles;
use crate::math;
use crate::receiver::{Receiver, ReceiverKind, ShadingPoint};
use crate::warp::Variate;
use crate::warp::projected_cap::ProjectedCap;
use crate::warp::spherical_cap::{self, SphericalCap};

/// A sphere that sends the same radiance from all of its surface.
///
/// Light leaves the outside. Inside the sphere it is dark, unless the sphere has two sides: then its inside sends as
/// well, and directions are uniform there.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub struct SphereLight {
    center: Vec3,
    radius: f32,
    radiance: f32,
    two_sided: bool,
}

impl SphereLight {
    /// Returns a sphere. `radiance` is the luminance of what each point sends in each direction, as of a mesh.
    pub const fn new(center: Vec3, radius: f32, radiance: f32) -> Self {
        Self { center, radius, radiance, two_sided: false }
    }

    /// Sets the sides that light leaves from: the outside alone, which is the default, or the inside as well.
    pub const fn sides(mut self, sides: Sides) -> Self {
        self.two_sided = matches!(sides, Sides::Two);
        self
    }

    /// Returns the area of the surface.
    fn surface(&self) -> f32 {
        4.0 * PI * self.radius * self.radius
    }
}

impl From<SphereLight> for super::Lamp {
    fn from(sphere: SphereLight) -> Self {
        Self::Sphere(sphere)
    }
}

impl LampKind for SphereLight {
    const CODE: u32 = 1;

    fn to_values(self) -> [f32; VALUES] {
        let [x, y, z] = self.center.to_array();
        [x, y, z, self.radius, self.radiance, f32::from(u8::from(self.two_sided)), 0.0, 0.0, 0.0, 0.0]
    }

    fn from_values([x, y, z, radius, radiance, two_sided, ..]: [f32; VALUES]) -> Self {
        Self { center: Vec3::new(x, y, z), radius, radiance, two_sided: two_sided > 0.0 }
    }

    fn check(&self) -> Result<(), LampFault> {
        check_length("radius", self.radius)?;
        check_position("center", self.center, self.radius)?;
        check_weight("radiance", self.radiance)
    }

    fn weight(&self) -> f32 {
        self.radiance
    }

    fn area(&self, _profiles: Profiles<'_>) -> f32 {
        self.surface()
    }

    fn reach(&self, _profiles: Profiles<'_>) -> Reach {
        let half = Vec3::splat(self.radius);
        Reach {
            aabb: Aabb { min: self.center - half, max: self.center + half },
            normals: Cone { axis: Vec3::Z, theta: PI },
            emission: PI,
            // Without a normal there is no other side.
            two_sided: false,
            // From outside, a sphere sends what a point at its center would.
            mean: self.center,
            variance: 0.0,
            normal: Vec3::ZERO,
        }
    }

    fn view(&self, x: &ShadingPoint, _profiles: Profiles<'_>) -> Option<ShapeView> {
        let center = self.center.as_dvec3() - x.position.as_dvec3();
        let (distance, radius) = (math::sqrt64(center.length_squared()), f64::from(self.radius));
        let beyond = (distance - radius) * (distance + radius);
        let is_outside = beyond > 0.0;
        if !is_outside && !self.two_sided {
            return None;
        }
        let cap = if is_outside {
            let sin = radius / distance;
            SphericalCap { axis: center / distance, sin, cos: math::sqrt64(beyond) / distance }
        } else {
            SphericalCap::whole()
        };
        let normal = x.receiver.normal().as_dvec3().try_normalize();
        let projected = normal.filter(|_| x.receiver.has_horizon()).and_then(|normal| ProjectedCap::new(&cap, normal));
        Some(ShapeView::Sphere(SphereView { center, radius, beyond, cap, projected }))
    }

    fn is_crossed(&self, origin: Vec3, direction: DVec3) -> bool {
        let center = self.center.as_dvec3() - origin.as_dvec3();
        let radius2 = f64::from(self.radius) * f64::from(self.radius);
        if center.length_squared() > radius2 {
            center.dot(direction) > 0.0 && center.cross(direction).length_squared() <= radius2
        } else {
            self.two_sided
        }
    }

    fn emit(&self, point: [Variate; 2], direction: [Variate; 2], side: f64, profiles: Profiles<'_>) -> EmittedRay {
        let normal = spherical_cap::uniform_direction(point.map(|u| u.value()));
        let position = self.center.as_dvec3() + f64::from(self.radius) * normal;
        let pdf = self.emission_pdf(normal.as_vec3(), profiles);
        cosine_ray(position, normal.as_vec3(), self.two_sided && side < 0.5, direction, pdf)
    }

    fn emission_pdf(&self, _direction: Vec3, _profiles: Profiles<'_>) -> f64 {
        per_direction(self.two_sided) / f64::from(self.surface())
    }
}

/// A sphere as seen from a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct SphereView {
    /// Relative to the point.
    center: DVec3,
    radius: f64,
    /// Squared distance of the center beyond that of the surface: negative inside.
    beyond: f64,
    /// Directions to the sphere.
    cap: SphericalCap,
    /// The part of them above the horizon, if there is one.
    projected: Option<ProjectedCap>,
}

impl ShapeViewKind for SphereView {
    fn draw(&self, u: [Variate; 2]) -> DVec3 {
        let u = u.map(|u| u.value());
        self.projected.as_ref().map_or_else(|| self.cap.direction(u), |projected| projected.direction(u))
    }

    fn pdf(&self, direction: DVec3) -> f64 {
        self.projected.as_ref().map_or_else(|| 1.0 / self.cap.solid_angle(), |projected| projected.pdf(direction))
    }

    fn point(&self, direction: DVec3) -> DVec3 {
        let along = self.center.dot(direction);
        let half_chord = math::sqrt64((along * along - self.beyond).max(0.0));
        // Where a difference of two like numbers would be, the product of both solutions stands in.
        let distance = if self.beyond > 0.0 { self.beyond / (along + half_chord) } else { along + half_chord };
        direction * distance.max(0.0)
    }

    fn normal(&self, point: DVec3) -> DVec3 {
        // A sphere that is smaller than rounding may have any normal that faces the point.
        (point - self.center).normalize_or(-point.normalize_or_zero())
    }

    fn highest(&self, normal: DVec3) -> [f64; 2] {
        [normal.dot(self.center) + self.radius, normal.abs().dot(self.center.abs()) + self.radius]
    }

    fn irradiance(&self, receiver: Receiver) -> f64 {
        irradiance_of_cap(receiver, &self.cap)
    }
}
