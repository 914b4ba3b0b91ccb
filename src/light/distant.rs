//! Distant lights as a sampler keeps them: in no tree, as they have no place, but in groups of like directions.
//!
//! What a distant light sends to a shading point is known without noise: its irradiance times the receiver's weight of
//! its direction, or of all directions of its cap. Up to [`MOST_GROUPS`] lights are a group each, and are weighed one
//! by one. Of more lights, each group holds neighbors in direction, and is weighed as a whole first.

use alloc::vec::Vec;
use core::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec3, Vec3};

use super::distant_record::{DistantGroup, DistantRecord};
use super::{DistantLight, Lamp, irradiance_of_cap};
use crate::error::Error;
use crate::math;
use crate::receiver::{Receiver, ReceiverKind};
use crate::record::{LightId, SampledLight};
use crate::warp::equal_area::sphere_to_square;
use crate::warp::projected_cap::ProjectedCap;
use crate::warp::spherical_cap::SphericalCap;

/// Most groups. *Format*: bytes hold no more. Chosen as a budget of time for each shading point.
///
/// Larger: shading points weigh more lights one by one. Smaller: of few lights already, some share a group.
pub(crate) const MOST_GROUPS: usize = 32;

/// Least share of what a cap sends if all of it is above the horizon, kept by a cap of which anything is. *Chosen*: it
/// stands in for what rounding may take from the difference of like numbers.
///
/// Larger: samples where the light is all but set. Smaller: rounding shows there.
const LEAST_CAP_SHARE: f64 = 1e-9;

/// Rounding of a direction to single precision. *Proved*: a component is off by at most 6e-8. A larger one gives
/// densities to directions beside a light.
const DIRECTION_ROUNDING: f64 = 2e-7;

/// Steps of the square of all directions in which lights are sorted, a side. Affects which lights share a group.
/// *Chosen*.
const SORTING_STEPS: f32 = 1024.0;

/// A distant light as seen from a shading point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DistantView {
    receiver: Receiver,
    cap: SphericalCap,
    /// The part of the cap above the horizon, if there is one.
    projected: Option<ProjectedCap>,
    /// Whether the light has an extent.
    has_extent: bool,
}

impl DistantRecord {
    /// Returns the record of a light with this number and in these light groups.
    pub(super) fn new(light: &DistantLight, number: u32, groups: u32) -> Self {
        let (axis, irradiance, radius) = light.numbers();
        Self { axis: axis.to_array(), irradiance, radius, number, groups }
    }

    fn light(&self) -> DistantLight {
        DistantLight::new(Vec3::from_array(self.axis), self.irradiance).angular_radius(self.radius)
    }

    /// Number among all lights that are not made of triangles.
    pub(super) fn number(&self) -> u32 {
        self.number
    }

    /// Irradiance on a surface that faces the light.
    pub(crate) fn irradiance(&self) -> f32 {
        self.irradiance
    }

    /// Unit vector in which light travels.
    pub(crate) fn axis(&self) -> Vec3 {
        Vec3::from_array(self.axis)
    }

    /// Whether the light has an extent.
    pub(crate) fn has_extent(&self) -> bool {
        self.radius > 0.0
    }

    /// Returns what a host gets to know of a sample of this light.
    pub(crate) fn sampled(&self) -> SampledLight {
        let id = LightId(self.number);
        if self.has_extent() { SampledLight::Shape(id) } else { SampledLight::Punctual(id) }
    }

    /// Directions to the light.
    pub(crate) fn cap(&self) -> SphericalCap {
        let axis = -self.axis().as_dvec3().normalize_or_zero();
        let radius = f64::from(self.radius).min(PI);
        let (sin, cos) = (math::cos64(radius - FRAC_PI_2).max(0.0), math::cos64(radius));
        SphericalCap { axis, sin, cos }
    }

    /// Whether a direction from a shading point leads to the light. Never to one without an extent.
    pub(crate) fn holds(&self, direction: DVec3) -> bool {
        self.has_extent() && {
            let SphericalCap { axis, sin, cos } = self.cap();
            let (along, across) = (axis.dot(direction), math::sqrt64(axis.cross(direction).length_squared()));
            // The sine tells narrow caps apart, the cosine wide ones.
            if cos > 0.0 { along > 0.0 && across <= sin } else { along >= cos }
        }
    }

    /// Whether light travels in a unit direction that may have been rounded.
    pub(crate) fn sends(&self, direction: Vec3) -> bool {
        let SphericalCap { axis, sin, cos } = self.cap();
        let toward = -direction.as_dvec3();
        let (along, across) = (axis.dot(toward), math::sqrt64(axis.cross(toward).length_squared()));
        if cos > 0.0 { along > 0.0 && across <= sin + DIRECTION_ROUNDING } else { along >= cos - DIRECTION_ROUNDING }
    }

    /// Estimates the irradiance at a receiver. Zero only if nothing can arrive; exact but for lobes.
    pub(crate) fn weigh(&self, receiver: Receiver) -> f32 {
        let irradiance = f64::from(self.irradiance);
        if irradiance == 0.0 {
            return 0.0;
        }
        let weight = if self.has_extent() {
            let cap = self.cap();
            let facing = if cap.cos > 0.0 { PI * cap.sin * cap.sin } else { PI };
            weigh_cap(receiver, &cap) / facing
        } else {
            f64::from(receiver.weight(-self.axis()))
        };
        if weight > 0.0 { (irradiance * weight).clamp(f64::from(f32::MIN_POSITIVE), 1e35) as f32 } else { 0.0 }
    }

    /// Returns the light as seen from a shading point.
    pub(crate) fn view(&self, receiver: Receiver) -> DistantView {
        let cap = self.cap();
        let normal = receiver.normal().as_dvec3().try_normalize();
        let normal = normal.filter(|_| receiver.has_horizon() && self.has_extent());
        let projected = normal.and_then(|normal| ProjectedCap::new(&cap, normal));
        DistantView { receiver, cap, projected, has_extent: self.has_extent() }
    }

    fn is_valid(&self) -> bool {
        Lamp::from(self.light()).check().is_ok() && (self.axis().length_squared() - 1.0).abs() < 2e-3
    }
}

impl DistantView {
    /// Draws a unit direction to the light. `None` below the horizon.
    pub(crate) fn draw(&self, u: [f64; 2]) -> Option<Vec3> {
        let direction = if !self.has_extent {
            self.cap.axis
        } else {
            self.projected.as_ref().map_or_else(|| self.cap.direction(u), |projected| projected.direction(u))
        };
        Some(direction.as_vec3()).filter(|direction| !self.is_below_horizon(*direction))
    }

    /// Returns the density per solid angle with which [`Self::draw`] draws a direction that leads to the light; 1 for a
    /// light without an extent.
    pub(crate) fn pdf(&self, direction: Vec3) -> f64 {
        if self.is_below_horizon(direction) {
            return 0.0;
        }
        if !self.has_extent {
            return 1.0;
        }
        let uniform = || 1.0 / self.cap.solid_angle();
        let pdf = self.projected.as_ref().map_or_else(uniform, |projected| projected.pdf(direction.as_dvec3()));
        if pdf > 0.0 && pdf.is_finite() { pdf } else { 0.0 }
    }

    fn is_below_horizon(&self, direction: Vec3) -> bool {
        self.receiver.has_horizon() && !(self.receiver.normal().dot(direction) > 0.0)
    }
}

/// Integral of a receiver's weight over the directions of a cap. Zero only if all weights are; exact but for lobes.
fn weigh_cap(receiver: Receiver, cap: &SphericalCap) -> f64 {
    let normal = receiver.normal().as_dvec3().normalize_or_zero();
    match receiver {
        Receiver::Surface(_) => cosine_over_cap(cap, normal),
        Receiver::Transmissive(_) => cosine_over_cap(cap, normal) + cosine_over_cap(cap, -normal),
        Receiver::Volume => cap.solid_angle(),
        Receiver::Glossy(_) | Receiver::Scattering(_) | Receiver::Microfacet(_) => {
            let estimate = irradiance_of_cap(receiver, cap);
            let is_lit = !receiver.has_horizon() || cap.cos < 0.0 || normal.dot(cap.axis) > -cap.sin;
            if is_lit { estimate.max(LEAST_CAP_SHARE * cap.solid_angle()) } else { 0.0 }
        }
    }
}

/// Integral of the cosine to a unit normal, clamped at zero, over the directions of a cap: what is below the horizon is
/// cut off (Snyder 1996, "Area light sources for real-time graphics"; here in the form of Lagarde and de Rousiers 2014,
/// "Moving Frostbite to physically based rendering", section 4.7).
fn cosine_over_cap(cap: &SphericalCap, normal: DVec3) -> f64 {
    if cap.cos < 0.0 {
        // The hemisphere without the rest of the sphere.
        let rest = SphericalCap { axis: -cap.axis, sin: cap.sin, cos: -cap.cos };
        return (PI - cosine_over_cap(&rest, normal)).max(LEAST_CAP_SHARE);
    }
    let (sin, cos) = (cap.sin, cap.cos);
    let height = cap.axis.dot(normal).clamp(-1.0, 1.0);
    if height >= sin {
        return PI * sin * sin * height;
    }
    if height <= -sin {
        return 0.0;
    }
    let aside = math::sqrt64(1.0 - height * height);
    // Cosine of the half angle of the rim that is below the horizon.
    let y = (-cos * height / (sin * aside)).clamp(-1.0, 1.0);
    let root = aside * math::sqrt64(1.0 - y * y);
    let arc = FRAC_PI_2 - math::asin64(y);
    let sum = sin * (sin * height * arc - cos * root) + math::atan2_64(root * sin, cos);
    sum.max(LEAST_CAP_SHARE * sin * sin)
}

impl DistantGroup {
    /// Lights of the group, by their places among all.
    pub(crate) fn lights(&self) -> core::ops::Range<usize> {
        let first = self.first as usize;
        first..first + self.count as usize
    }

    /// Estimates the irradiance from a group of several lights. Zero only if nothing can arrive.
    pub(crate) fn weigh(&self, receiver: Receiver) -> f32 {
        let mean = if self.sin_reach > 1.0 {
            1.0
        } else {
            receiver.mean_over_cone(Vec3::from_array(self.axis), self.sin_reach.max(f32::MIN_POSITIVE))
        };
        math::only_if(mean > 0.0, (self.irradiance * mean).clamp(f32::MIN_POSITIVE, 1e35))
    }

    /// Sums up lights from a place on.
    fn of(lights: &[DistantRecord], first: usize) -> Self {
        let toward = |light: &DistantRecord| -light.axis().as_dvec3();
        let sum: DVec3 = lights.iter().map(|light| f64::from(light.irradiance) * toward(light)).sum();
        let axis = sum.try_normalize().unwrap_or_else(|| lights.first().map_or(DVec3::Z, toward));
        let angle = |light: &DistantRecord| {
            let toward = toward(light);
            let across = math::sqrt64(axis.cross(toward).length_squared());
            // Rounding of the axis to single precision is granted.
            math::atan2_64(across, axis.dot(toward)) + f64::from(light.radius) + 1e-6
        };
        let reach = lights.iter().map(angle).fold(0.0, f64::max);
        let irradiance: f64 = lights.iter().map(|light| f64::from(light.irradiance)).sum();
        Self {
            axis: axis.as_vec3().to_array(),
            sin_reach: if reach < FRAC_PI_2 { math::cos64(reach - FRAC_PI_2) as f32 } else { 2.0 },
            irradiance: irradiance.min(1e35) as f32,
            first: first as u32,
            count: lights.len() as u32,
            groups: lights.iter().fold(0, |groups, light| groups | light.groups),
        }
    }
}

/// Sorts lights so that neighbors in direction follow each other, and divides them into groups.
pub(super) fn arrange(lights: &mut [DistantRecord]) -> Vec<DistantGroup> {
    if lights.len() > MOST_GROUPS {
        let place = |light: &DistantRecord| {
            let square = sphere_to_square(-light.axis()) * SORTING_STEPS;
            let [x, y] = [square.x as u32, square.y as u32];
            // Along a curve that fills the square: the bits of both are interleaved.
            (0..11).fold(0, |code, bit| code | (x >> bit & 1) << (2 * bit) | (y >> bit & 1) << (2 * bit + 1))
        };
        lights.sort_by_key(|light| (place(light), light.number));
    }
    groups_of(lights)
}

/// Divides lights, in their order, into groups.
pub(super) fn groups_of(lights: &[DistantRecord]) -> Vec<DistantGroup> {
    let size = lights.len().div_ceil(MOST_GROUPS).max(1);
    lights.chunks(size).enumerate().map(|(i, chunk)| DistantGroup::of(chunk, i * size)).collect()
}

/// Checks lights that come from outside.
pub(super) fn validate(lights: &[DistantRecord], groups: &[DistantGroup]) -> Result<(), Error> {
    if let Some(light) = lights.iter().position(|light| !light.is_valid()) {
        return Err(Error::bytes("distant light", light, 0, 0));
    }
    let mut next = 0_usize;
    for (i, group) in groups.iter().enumerate() {
        let axis = Vec3::from_array(group.axis);
        let is_sound = group.first as usize == next
            && group.count > 0
            && (axis.length_squared() - 1.0).abs() < 2e-3
            && (0.0..=2.0).contains(&group.sin_reach)
            && (0.0..=1e35).contains(&group.irradiance);
        if !is_sound {
            return Err(Error::bytes("group of distant lights", i, group.first, next));
        }
        next = next.saturating_add(group.count as usize);
    }
    Error::unless_equal("number of groups of distant lights", groups.len().min(MOST_GROUPS), groups.len())?;
    Error::unless_equal("number of distant lights", next, lights.len())
}

impl super::Extras<'_> {
    /// Returns the place of a distant light among all; `None` for any other light, and one that emits nothing.
    #[inline]
    pub(crate) fn distant_of(self, id: LightId) -> Option<usize> {
        if self.is_empty() { None } else { self.distants().iter().position(|light| light.number == id.0) }
    }
}
