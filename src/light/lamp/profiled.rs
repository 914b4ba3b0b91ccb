//! A point that sends radiant intensity by a profile.

use core::f32::consts::PI;

use glam::{DVec3, Vec3};

use super::point::PointView;
use super::{LampFault, LampKind, Reach, ShapeView, VALUES, check_axis, check_position, check_weight, within};
use crate::geometry::{Aabb, Cone};
use crate::light::emitted::EmittedRay;
use crate::light::profile::{Profile, angles_of_direction};
use crate::light::profiles::Profiles;
use crate::light::projection::Projection;
use crate::math;
use crate::receiver::ShadingPoint;
use crate::record::ProfileId;
use crate::warp::Variate;

/// What makes the mean intensity of a profile compete with radiance times area. *Proved*: that of a point of the same
/// intensity in all directions, whose power is the same; a surface of that power has the same radiance times area.
const AREA: f32 = 4.0;

/// Largest vertical angle, in radians, up to which a light counts as one that sends into a cone. *Chosen*: what is
/// wider is no cone for a node of the tree, whose cones end at a right angle less 0.08.
///
/// Larger: wide lights are taken for surfaces. Smaller: fewer lights are culled by their cones.
const WIDEST_PROFILE_CONE: f32 = 1.45;

/// Mean cosine between the normal of a Lambertian surface and the directions in which its light leaves. *Proved*: the
/// integral of 2 cos² θ sin θ from 0 to π/2.
const LAMBERTIAN_COSINE: f64 = 2.0 / 3.0;

/// Length of the mean normal of a light that is no cone and sends to one side. *Chosen*: what it sends to the other
/// side counts for as much as a hundredth in a cluster, and what it sends across for a tenth.
///
/// Larger: what little goes the other way is rare in clusters. Smaller: clusters are taken for even.
const LONGEST_MEAN_NORMAL: f32 = 0.9;

/// Length below which a mean normal counts as zero. *Chosen*: it does not vanish in the 255 steps of a node.
const SHORTEST_MEAN_NORMAL: f32 = 0.02;

/// A point without an extent whose intensity is given by a [`Profile`], such as that of a luminaire.
///
/// Samples of it are [`SampledLight::Punctual`](crate::SampledLight::Punctual), and the tree knows the exact intensity
/// towards the shading point.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub struct ProfileLight {
    position: Vec3,
    axis: Vec3,
    roll: f32,
    scale: f32,
    profile: u32,
}

impl ProfileLight {
    /// Returns a light. `axis`, of any length, is the direction of the profile's vertical angle 0: in photometry mostly
    /// straight down. `scale` is what the intensities of the profile are multiplied by.
    pub fn new(position: Vec3, axis: Vec3, profile: ProfileId, scale: f32) -> Self {
        let axis = axis.as_dvec3().normalize_or_zero().as_vec3();
        Self { position, axis, roll: 0.0, scale, profile: profile.index() }
    }

    /// Turns the light around its axis, so that horizontal angle 0 is in the direction of `zero` as far as it is
    /// perpendicular to the axis. Horizontal angles grow counter-clockwise around the axis. Without this, horizontal
    /// angle 0 is anywhere.
    pub fn facing(mut self, zero: Vec3) -> Self {
        let (s, t) = self.axis.as_dvec3().any_orthonormal_pair();
        self.roll = math::atan2_64(zero.as_dvec3().dot(t), zero.as_dvec3().dot(s)) as f32;
        self
    }

    /// Returns the intensity in a unit direction in which light travels, by the light's profile.
    #[must_use]
    pub fn intensity_towards(&self, profile: &Profile<'_>, direction: Vec3) -> f32 {
        self.scale * profile.intensity(angles_of_direction(self.local(direction.as_dvec3())))
    }

    /// Returns the intensity in a unit direction in which light travels, by the light's projection.
    #[must_use]
    pub fn intensity_through(&self, projection: &Projection<'_>, direction: Vec3) -> f32 {
        self.scale * projection.intensity_towards(self.local(direction.as_dvec3()))
    }

    /// Returns the number of the profile.
    pub(super) fn profile(&self) -> ProfileId {
        ProfileId(self.profile)
    }

    /// Unit vectors in the directions of horizontal angle 0, of a right horizontal angle, and of vertical angle 0.
    fn frame(&self) -> [DVec3; 3] {
        let axis = self.axis.as_dvec3();
        let (s, t) = axis.any_orthonormal_pair();
        let (sin, cos) =
            (math::cos64(f64::from(self.roll) - core::f64::consts::FRAC_PI_2), math::cos64(self.roll.into()));
        [s * cos + t * sin, t * cos - s * sin, axis]
    }

    /// The mean normal of a surface whose light has this mean cosine with the axis; zero for what prefers no side.
    fn mean_normal(&self, mean_cosine: f64) -> Vec3 {
        let length = (mean_cosine / LAMBERTIAN_COSINE).clamp(-1.0, 1.0) as f32 * LONGEST_MEAN_NORMAL;
        if length.abs() < SHORTEST_MEAN_NORMAL { Vec3::ZERO } else { length * self.axis }
    }

    /// A direction in the frame of the light.
    fn local(&self, direction: DVec3) -> [f64; 3] {
        self.frame().map(|axis| axis.dot(direction))
    }
}

impl From<ProfileLight> for super::Lamp {
    fn from(light: ProfileLight) -> Self {
        Self::Profile(light)
    }
}

impl LampKind for ProfileLight {
    const CODE: u32 = 7;

    fn to_values(self) -> [f32; VALUES] {
        let ([x, y, z], [i, j, k]) = (self.position.to_array(), self.axis.to_array());
        [x, y, z, i, j, k, self.roll, self.scale, f32::from_bits(self.profile), 0.0]
    }

    fn from_values([x, y, z, i, j, k, roll, scale, profile, _]: [f32; VALUES]) -> Self {
        Self { position: Vec3::new(x, y, z), axis: Vec3::new(i, j, k), roll, scale, profile: profile.to_bits() }
    }

    fn check(&self) -> Result<(), LampFault> {
        check_position("position", self.position, 0.0)?;
        check_axis("length of the axis", self.axis)?;
        check_weight("scale", self.scale)?;
        within("angle around the axis", self.roll, [-4.0, 4.0], "finite")
    }

    fn has_extent(&self) -> bool {
        false
    }

    fn weight(&self) -> f32 {
        self.scale
    }

    fn area(&self, profiles: Profiles<'_>) -> f32 {
        AREA * profiles.get(self.profile).map_or(0.0, |table| table.mean)
    }

    fn reach(&self, profiles: Profiles<'_>) -> Reach {
        let table = profiles.get(self.profile);
        let emission = table.as_ref().map_or(PI, |table| table.reach);
        let is_focused = emission < WIDEST_PROFILE_CONE;
        let normal = match table {
            _ if is_focused => self.axis,
            Some(table) => self.mean_normal(table.mean_cosine()),
            None => Vec3::ZERO,
        };
        Reach {
            aabb: Aabb { min: self.position, max: self.position },
            normals: if is_focused { Cone::single(self.axis) } else { Cone { axis: Vec3::Z, theta: PI } },
            emission: if is_focused { emission } else { PI },
            // What sends in all directions reports its exact intensity if it has two sides or a mean normal.
            two_sided: !is_focused && normal == Vec3::ZERO,
            mean: self.position,
            variance: 0.0,
            normal,
        }
    }

    fn view(&self, x: &ShadingPoint, profiles: Profiles<'_>) -> Option<ShapeView> {
        let table = profiles.get(self.profile)?;
        let intensity = |direction| table.intensity(self.local(direction)).into();
        PointView::new(self.position, x.position, intensity).map(ShapeView::Point)
    }

    fn is_crossed(&self, _origin: Vec3, _direction: DVec3) -> bool {
        false
    }

    fn emit(&self, _point: [Variate; 2], direction: [Variate; 2], _side: f64, profiles: Profiles<'_>) -> EmittedRay {
        let [x, y, z] =
            profiles.get(self.profile).map_or([0.0, 0.0, 1.0], |table| table.sample(direction.map(|u| u.value())));
        let [right, front, axis] = self.frame();
        let direction = (right * x + front * y + axis * z).as_vec3();
        EmittedRay::from_point(self.position, direction, self.emission_pdf(direction, profiles))
    }

    fn emission_pdf(&self, direction: Vec3, profiles: Profiles<'_>) -> f64 {
        profiles.get(self.profile).map_or(0.0, |table| table.pdf(self.local(direction.as_dvec3())))
    }
}
