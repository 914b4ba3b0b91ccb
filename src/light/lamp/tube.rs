//! The surface of a cylinder of constant radiance, sampled by the solid angle that it fills.
//!
//! Across the tube's axis, the directions to it fill an angle that is the same all along. In each of these directions,
//! what is seen of the tube is a stretch of a line parallel to the axis, whose solid angle is uniform in the sine of
//! the latitude (Archimedes). So an angle is drawn uniformly, then a sine. The density is that of both, and nearly
//! uniform except next to the tube.

use core::f32::consts::PI;

use glam::{DVec3, Vec3};

use super::{
    LEAST_LAMP_LENGTH, LampFault, LampKind, Reach, ShapeView, ShapeViewKind, VALUES, check_length, check_position,
    check_weight, irradiance_of_directions, within,
};
use crate::geometry::{Aabb, Cone};
use crate::light::POSITION_LIMIT;
use crate::light::emitted::{EmittedRay, cosine_ray, per_direction};
use crate::light::profiles::Profiles;
use crate::math;
use crate::receiver::{Receiver, ShadingPoint};
use crate::warp::Variate;

/// A tube: the round surface of a cylinder, which sends the same radiance from all of its outside.
///
/// The ends and the inside are dark.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub struct TubeLight {
    ends: [Vec3; 2],
    radius: f32,
    radiance: f32,
}

impl TubeLight {
    /// Returns a tube around the line between two points. `radiance` is the luminance of what each point of the surface
    /// sends in each direction, as of a mesh.
    pub const fn new(ends: [Vec3; 2], radius: f32, radiance: f32) -> Self {
        Self { ends, radius, radiance }
    }

    /// Returns the length.
    fn length(&self) -> f32 {
        math::sqrt64((self.ends[1].as_dvec3() - self.ends[0].as_dvec3()).length_squared()) as f32
    }

    /// Returns the unit vector along the axis.
    fn axis(&self) -> DVec3 {
        (self.ends[1].as_dvec3() - self.ends[0].as_dvec3()).normalize_or_zero()
    }

    /// Returns the area of the surface.
    fn surface(&self) -> f32 {
        2.0 * PI * self.radius * self.length()
    }
}

impl From<TubeLight> for super::Lamp {
    fn from(tube: TubeLight) -> Self {
        Self::Tube(tube)
    }
}

impl LampKind for TubeLight {
    const CODE: u32 = 5;

    fn to_values(self) -> [f32; VALUES] {
        let [[a, b, c], [d, e, f]] = self.ends.map(|end| end.to_array());
        [a, b, c, d, e, f, self.radius, self.radiance, 0.0, 0.0]
    }

    fn from_values([a, b, c, d, e, f, radius, radiance, ..]: [f32; VALUES]) -> Self {
        Self { ends: [Vec3::new(a, b, c), Vec3::new(d, e, f)], radius, radiance }
    }

    fn check(&self) -> Result<(), LampFault> {
        check_length("radius", self.radius)?;
        self.ends.iter().try_for_each(|end| check_position("end", *end, self.radius))?;
        within("length", self.length(), [LEAST_LAMP_LENGTH, 4.0 * POSITION_LIMIT], "at least 1e-15")?;
        check_weight("radiance", self.radiance)
    }

    fn weight(&self) -> f32 {
        self.radiance
    }

    fn area(&self, _profiles: Profiles<'_>) -> f32 {
        self.surface()
    }

    fn reach(&self, _profiles: Profiles<'_>) -> Reach {
        let half = self.axis().as_vec3().to_array().map(|n| self.radius * math::sqrt((1.0 - n * n).max(0.0)));
        // Rounding of the axis leaves a little more.
        let half = Vec3::from_array(half) + 1e-3 * self.radius;
        let ends = Aabb::around(&self.ends);
        let length = self.length();
        Reach {
            aabb: Aabb { min: ends.min - half, max: ends.max + half },
            normals: Cone { axis: Vec3::Z, theta: PI },
            emission: PI,
            two_sided: false,
            mean: 0.5 * self.ends[0] + 0.5 * self.ends[1],
            variance: length * length * (1.0 / 12.0) + self.radius * self.radius,
            normal: Vec3::ZERO,
        }
    }

    fn view(&self, x: &ShadingPoint, _profiles: Profiles<'_>) -> Option<ShapeView> {
        let [start, end] = self.ends.map(|end| end.as_dvec3() - x.position.as_dvec3());
        TubeView::new([start, end], self.axis(), self.radius.into()).map(ShapeView::Tube)
    }

    fn is_crossed(&self, origin: Vec3, direction: DVec3) -> bool {
        let [start, end] = self.ends.map(|end| end.as_dvec3() - origin.as_dvec3());
        let Some(view) = TubeView::new([start, end], self.axis(), self.radius.into()) else { return false };
        let Across { length, offset, .. } = view.across(direction);
        if !(length > 0.0 && direction.dot(view.frame[0]) > 0.0 && offset <= view.radius) {
            return false;
        }
        let height = view.distance_across(direction) * direction.dot(view.frame[2]) / length;
        height >= view.heights[0] && height <= view.heights[1]
    }

    fn emit(&self, point: [Variate; 2], direction: [Variate; 2], _side: f64, profiles: Profiles<'_>) -> EmittedRay {
        let [u1, u2] = point.map(|u| u.value());
        let (sin, cos) = math::sin_cos(core::f32::consts::TAU * u2 as f32);
        let axis = self.axis();
        let (s, t) = axis.any_orthonormal_pair();
        let normal = s * f64::from(cos) + t * f64::from(sin);
        let along = self.ends[0].as_dvec3().lerp(self.ends[1].as_dvec3(), u1);
        let pdf = self.emission_pdf(normal.as_vec3(), profiles);
        cosine_ray(along + f64::from(self.radius) * normal, normal.as_vec3(), false, direction, pdf)
    }

    fn emission_pdf(&self, _direction: Vec3, _profiles: Profiles<'_>) -> f64 {
        per_direction(false) / f64::from(self.surface())
    }
}

/// A tube as seen from a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct TubeView {
    /// Unit vectors: to the axis, across both others, and along the axis, so that more of the tube is on its positive
    /// side.
    frame: [DVec3; 3],
    /// Distance of the axis.
    distance: f64,
    radius: f64,
    /// Heights of the ends along the axis.
    heights: [f64; 2],
    /// Half of the angle across the axis.
    half_angle: f64,
}

/// A direction across the axis.
struct Across {
    /// Length of what is left of a unit direction.
    length: f64,
    /// Cosine to the axis.
    cos: f64,
    /// Distance at which the line passes the axis.
    offset: f64,
}

impl TubeView {
    /// Returns the view of a tube with these ends relative to the point, unless the point is inside or beyond an end.
    fn new([start, end]: [DVec3; 2], axis: DVec3, radius: f64) -> Option<Self> {
        let heights = [start.dot(axis), end.dot(axis)];
        let across = start - axis * heights[0];
        let distance = math::sqrt64(across.length_squared());
        if !(distance > radius) {
            return None;
        }
        let (along, heights) =
            if heights[0] + heights[1] >= 0.0 { (axis, heights) } else { (-axis, [-heights[1], -heights[0]]) };
        let towards = across / distance;
        let half_angle = math::asin((radius / distance) as f32).into();
        Some(Self { frame: [towards, along.cross(towards), along], distance, radius, heights, half_angle })
    }

    fn across(&self, direction: DVec3) -> Across {
        let [x, y] = [self.frame[0].dot(direction), self.frame[1].dot(direction)];
        let length = math::sqrt64(x * x + y * y);
        if length > 0.0 {
            Across { length, cos: x / length, offset: self.distance * (y / length).abs() }
        } else {
            Across { length, cos: 1.0, offset: 0.0 }
        }
    }

    /// Returns the distance of the tube across its axis in a direction.
    fn distance_across(&self, direction: DVec3) -> f64 {
        let Across { cos, offset, .. } = self.across(direction);
        self.surface_distance(cos, offset)
    }

    fn surface_distance(&self, cos: f64, offset: f64) -> f64 {
        let half_chord2 = ((self.radius - offset) * (self.radius + offset)).max(0.0);
        let beyond = (self.distance - self.radius) * (self.distance + self.radius);
        beyond / (self.distance * cos.max(0.0) + math::sqrt64(half_chord2))
    }

    /// Returns one less the sines of the latitudes of both ends, at this distance across the axis. The first one is
    /// larger.
    fn latitudes(&self, distance: f64) -> [f64; 2] {
        self.heights.map(|height| {
            let length = math::sqrt64(height * height + distance * distance);
            if height > 0.0 { distance * distance / (length * (length + height)) } else { 1.0 - height / length }
        })
    }
}

impl ShapeViewKind for TubeView {
    fn draw(&self, u: [Variate; 2]) -> DVec3 {
        let [u1, u2] = u.map(|u| u.value());
        let (sin, cos) = math::sin_cos(((2.0 * u2 - 1.0) * self.half_angle) as f32);
        let (sin, cos) = (f64::from(sin), f64::from(cos));
        let [low, high] = self.latitudes(self.surface_distance(cos, self.distance * sin.abs()));
        // One less the sine of the latitude.
        let height = low + u1 * (high - low);
        let radius = math::sqrt64((height * (2.0 - height)).max(0.0));
        let [towards, aside, along] = self.frame;
        (towards * cos + aside * sin) * radius + along * (1.0 - height)
    }

    fn pdf(&self, direction: DVec3) -> f64 {
        let [low, high] = self.latitudes(self.distance_across(direction));
        0.5 / (self.half_angle * (low - high))
    }

    fn point(&self, direction: DVec3) -> DVec3 {
        let length = self.across(direction).length;
        let distance = self.distance_across(direction);
        if length > 0.0 { direction * (distance / length) } else { DVec3::ZERO }
    }

    fn normal(&self, point: DVec3) -> DVec3 {
        let [towards, _, along] = self.frame;
        (point - along * along.dot(point) - towards * self.distance).normalize_or(-towards)
    }

    fn highest(&self, normal: DVec3) -> [f64; 2] {
        let [towards, _, along] = self.frame;
        let cosine = normal.dot(along);
        let reach = self.radius * math::sqrt64((1.0 - cosine * cosine).max(0.0));
        let ends = self.heights.map(|height| cosine * height);
        let highest = normal.dot(towards) * self.distance + ends[0].max(ends[1]) + reach;
        let size = self.heights[0].abs().max(self.heights[1].abs());
        [highest, 2.0 * (self.distance + self.radius + size)]
    }

    fn irradiance(&self, receiver: Receiver) -> f64 {
        let distance = self.distance - self.radius;
        let [low, high] = self.latitudes(distance);
        let solid_angle = 2.0 * self.half_angle * (low - high);
        let height = 0.5 * (low + high);
        let [towards, _, along] = self.frame;
        let axis = towards * math::sqrt64((height * (2.0 - height)).max(0.0)) + along * (1.0 - height);
        let sin_reach = (0.5 * (low - high)).max(self.radius / self.distance);
        irradiance_of_directions(receiver, axis, sin_reach, solid_angle)
    }
}
