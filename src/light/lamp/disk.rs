//! A disk of constant radiance, sampled by the solid angle that it fills.

use core::f32::consts::PI;

use glam::{DVec3, Vec3};

use super::{
    LampFault, LampKind, Reach, ShapeView, ShapeViewKind, VALUES, check_axis, check_length, check_position,
    check_weight, irradiance_of_directions,
};
use crate::geometry::{Aabb, Cone};
use crate::light::Sides;
use crate::light::emitted::{EmittedRay, cosine_ray, per_direction};
use crate::light::profiles::Profiles;
use crate::math;
use crate::receiver::{Receiver, ShadingPoint};
use crate::warp::Variate;
use crate::warp::spherical_ellipse::SphericalEllipse;

/// A flat disk that sends the same radiance from all of its surface.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub struct DiskLight {
    center: Vec3,
    normal: Vec3,
    radius: f32,
    radiance: f32,
    two_sided: bool,
}

impl DiskLight {
    /// Returns a disk. Light leaves the side that `normal`, of any length, points to. `radiance` is the luminance of
    /// what each point sends in each direction, as of a mesh.
    pub fn new(center: Vec3, normal: Vec3, radius: f32, radiance: f32) -> Self {
        let normal = normal.as_dvec3().normalize_or_zero().as_vec3();
        Self { center, normal, radius, radiance, two_sided: false }
    }

    /// Sets the sides that light leaves from: the front alone, which is the default, or both.
    pub const fn sides(mut self, sides: Sides) -> Self {
        self.two_sided = matches!(sides, Sides::Two);
        self
    }

    /// Returns the area of one side.
    fn surface(&self) -> f32 {
        PI * self.radius * self.radius
    }

    /// Returns the unit normal in double precision.
    fn exact_normal(&self) -> DVec3 {
        self.normal.as_dvec3().normalize_or_zero()
    }
}

impl From<DiskLight> for super::Lamp {
    fn from(disk: DiskLight) -> Self {
        Self::Disk(disk)
    }
}

impl LampKind for DiskLight {
    const CODE: u32 = 4;

    fn to_values(self) -> [f32; VALUES] {
        let ([x, y, z], [i, j, k]) = (self.center.to_array(), self.normal.to_array());
        [x, y, z, i, j, k, self.radius, self.radiance, f32::from(u8::from(self.two_sided)), 0.0]
    }

    fn from_values([x, y, z, i, j, k, radius, radiance, two_sided, _]: [f32; VALUES]) -> Self {
        let (center, normal) = (Vec3::new(x, y, z), Vec3::new(i, j, k));
        Self { center, normal, radius, radiance, two_sided: two_sided > 0.0 }
    }

    fn check(&self) -> Result<(), LampFault> {
        check_axis("length of the normal", self.normal)?;
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
        let half = self.normal.to_array().map(|n| self.radius * math::sqrt((1.0 - n * n).max(0.0)));
        // Rounding of the normal leaves a little more.
        let half = Vec3::from_array(half) + 1e-6 * self.radius;
        Reach {
            aabb: Aabb { min: self.center - half, max: self.center + half },
            normals: Cone::single(self.normal),
            emission: core::f32::consts::FRAC_PI_2,
            two_sided: self.two_sided,
            mean: self.center,
            variance: 0.5 * self.radius * self.radius,
            normal: self.normal,
        }
    }

    fn view(&self, x: &ShadingPoint, _profiles: Profiles<'_>) -> Option<ShapeView> {
        let (center, normal) = (self.center.as_dvec3() - x.position.as_dvec3(), self.exact_normal());
        let side = -normal.dot(center);
        let is_seen = side > 0.0 || (side < 0.0 && self.two_sided);
        is_seen.then(|| ShapeView::Disk(DiskView::new(center, normal, self.radius.into())))
    }

    fn is_crossed(&self, origin: Vec3, direction: DVec3) -> bool {
        let (center, normal) = (self.center.as_dvec3() - origin.as_dvec3(), self.exact_normal());
        let (height, along) = (normal.dot(center), normal.dot(direction));
        let is_seen = height < 0.0 || (height > 0.0 && self.two_sided);
        let distance = height / along;
        let radius2 = f64::from(self.radius) * f64::from(self.radius);
        is_seen && distance > 0.0 && (distance * direction - center).length_squared() <= radius2
    }

    fn emit(&self, point: [Variate; 2], direction: [Variate; 2], side: f64, _profiles: Profiles<'_>) -> EmittedRay {
        let [u1, u2] = point.map(|u| u.value());
        let (sin, cos) = math::sin_cos(core::f32::consts::TAU * u2 as f32);
        let (s, t) = self.exact_normal().any_orthonormal_pair();
        let radius = f64::from(self.radius) * math::sqrt64(u1);
        let position = self.center.as_dvec3() + radius * (s * f64::from(cos) + t * f64::from(sin));
        let pdf = per_direction(self.two_sided) / f64::from(self.surface());
        cosine_ray(position, self.normal, self.two_sided && side < 0.5, direction, pdf)
    }

    fn emission_pdf(&self, direction: Vec3, _profiles: Profiles<'_>) -> f64 {
        let leaves = self.two_sided || self.normal.dot(direction) > 0.0;
        if leaves { per_direction(self.two_sided) / f64::from(self.surface()) } else { 0.0 }
    }
}

/// Least distance of a disk's center from the line through the point along its normal, relative to the distance of the
/// center. *Proved*: rounding of 1e-16 turns a direction found from a smaller one by more than 1e-6. A larger one would
/// move disks.
const LEAST_ASIDE: f64 = 1e-10;

/// A disk as seen from a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct DiskView {
    /// Relative to the point.
    center: DVec3,
    /// Unit normal of the front side.
    normal: DVec3,
    radius: f64,
    /// Distance of the point from the plane.
    height: f64,
    /// Distance of the farthest point of the disk.
    farthest: f64,
    /// Directions to the disk.
    cone: SphericalEllipse,
}

impl DiskView {
    /// Returns the view of a disk whose plane does not hold the point.
    ///
    /// In the plane through the point, the normal and the center, the disk spans from ρ - r to ρ + r at the distance h.
    /// The axis of its cone of directions halves that angle, and meets the disk at m (angle bisector theorem). What is
    /// not written as a difference of like numbers stays exact next to the disk and far from it.
    fn new(center: DVec3, normal: DVec3, radius: f64) -> Self {
        let down = normal * normal.dot(center).signum();
        let height = normal.dot(center).abs();
        let aside = center - down * height;
        let rho = math::sqrt64(aside.length_squared());
        // What is left of a vector along the normal is rounding, and points anywhere.
        let is_aside = rho > LEAST_ASIDE * math::sqrt64(center.length_squared());
        let (rho, outward) = if is_aside { (rho, aside / rho) } else { (0.0, normal.any_orthonormal_vector()) };
        let distance = |x: f64| math::sqrt64(x * x + height * height);
        let (near, far) = (distance(rho - radius), distance(rho + radius));
        // (near + far)² - 4 r², halved.
        let beyond = (rho - radius) * (rho + radius);
        let height2 = height * height;
        let excess = height2
            + if beyond >= 0.0 {
                beyond + near * far
            } else {
                height2 * (2.0 * (rho * rho + radius * radius) + height2) / (near * far - beyond)
            };
        let sum2 = (near + far) * (near + far);
        let middle = rho * (2.0 * excess / sum2);
        let to_middle = distance(middle);
        let q = 4.0 * rho * radius / sum2;
        let half_chord = radius * math::sqrt64((1.0 - q * q).max(0.0));
        let axis = (outward * middle + down * height) / to_middle;
        let inward = (outward * height - down * middle) / to_middle;
        let cone = SphericalEllipse {
            axes: [down.cross(outward), inward, axis],
            tangents: [half_chord / to_middle, 2.0 * radius * height / excess],
        };
        Self { center, normal, radius, height, farthest: far, cone }
    }
}

impl ShapeViewKind for DiskView {
    fn draw(&self, u: [Variate; 2]) -> DVec3 {
        self.cone.direction(u.map(|u| u.value()))
    }

    fn pdf(&self, direction: DVec3) -> f64 {
        self.cone.pdf(direction)
    }

    fn point(&self, direction: DVec3) -> DVec3 {
        let distance = self.height / self.normal.dot(direction).abs();
        direction * if distance < self.farthest { distance } else { self.farthest }
    }

    fn normal(&self, _point: DVec3) -> DVec3 {
        self.normal
    }

    fn highest(&self, normal: DVec3) -> [f64; 2] {
        let cosine = normal.dot(self.normal);
        let reach = self.radius * math::sqrt64((1.0 - cosine * cosine).max(0.0));
        [normal.dot(self.center) + reach, normal.abs().dot(self.center.abs()) + self.radius]
    }

    fn irradiance(&self, receiver: Receiver) -> f64 {
        irradiance_of_directions(receiver, self.cone.axes[2], self.cone.sin_reach(), self.cone.solid_angle())
    }
}
