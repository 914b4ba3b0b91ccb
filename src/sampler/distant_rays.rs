//! Photons of distant lights: through a disk that covers a ball, perpendicular to their direction.

use core::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use super::emission_sample::EmissionSample;
use super::finite::to_positive;
use crate::light::{DistantRecord, FARTHEST_POINT, LightsView};
use crate::math;
use crate::warp::Variate;

/// The ball that distant lights send photons into.
#[derive(Clone, Copy, Debug)]
pub(super) struct DistantRays {
    center: DVec3,
    radius: f64,
    /// Sum of the irradiances of all distant lights.
    irradiance: f64,
}

impl DistantRays {
    /// Returns the rays into a ball; `None` where nothing is sent, or for a ball that is invalid or so large or far away
    /// that positions around it would overflow.
    pub(super) fn new(lights: &LightsView<'_>, center: Vec3, radius: f32) -> Option<Self> {
        let irradiance = lights.extras().distants().iter().map(|light| f64::from(light.irradiance())).sum();
        // NaN fails.
        let is_near = center.abs().cmple(Vec3::splat(FARTHEST_POINT)).all();
        let is_ball = radius > 0.0 && radius <= FARTHEST_POINT && is_near;
        (irradiance > 0.0 && is_ball).then_some(Self { center: center.as_dvec3(), radius: radius.into(), irradiance })
    }

    /// Returns the power of all distant lights.
    pub(super) fn power(&self) -> f64 {
        self.irradiance * self.area()
    }

    fn area(&self) -> f64 {
        PI * self.radius * self.radius
    }

    /// Draws a ray, with a density that is multiplied by a share.
    pub(super) fn sample(
        &self,
        lights: &LightsView<'_>,
        share: f64,
        choice: f64,
        point: [Variate; 2],
        direction: [Variate; 2],
    ) -> Option<EmissionSample> {
        let target = choice * self.irradiance;
        let mut below = 0.0;
        let is_chosen = |light: &&DistantRecord| {
            below += f64::from(light.irradiance());
            target < below
        };
        let light = lights.extras().distants().iter().find(is_chosen)?;
        let axis = if light.has_extent() {
            -light.cap().direction(direction.map(|u| u.value())).as_vec3()
        } else {
            light.axis()
        };
        let [u1, u2] = point.map(|u| u.value());
        let (sin, cos) = math::sin_cos((TAU * u2) as f32);
        let (s, t) = axis.as_dvec3().any_orthonormal_pair();
        let across = math::sqrt64(u1) * self.radius;
        let position = self.center - self.radius * axis.as_dvec3() + across * (f64::from(cos) * s + f64::from(sin) * t);
        let pmf = f64::from(light.irradiance()) / self.irradiance;
        Some(EmissionSample {
            light: light.sampled(),
            position: position.as_vec3(),
            normal: axis,
            direction: axis,
            pdf: to_positive(share * self.pdf(light)),
            pmf: to_positive(pmf),
        })
    }

    /// Returns the density with which [`Self::sample`] draws a ray of a light through the ball: per area perpendicular
    /// to it and, if the light has an extent, per solid angle.
    pub(super) fn pdf(&self, light: &DistantRecord) -> f64 {
        let pmf = f64::from(light.irradiance()) / self.irradiance;
        let per_direction = if light.has_extent() { 1.0 / light.cap().solid_angle() } else { 1.0 };
        pmf * per_direction / self.area()
    }

    /// Returns the density of a line through a point in a unit direction towards the lights: the sum over all that have
    /// an extent and that it leads to, but one.
    pub(super) fn line_pdf(
        &self,
        lights: &LightsView<'_>,
        position: Vec3,
        towards: Vec3,
        except: Option<usize>,
    ) -> f64 {
        let towards = towards.as_dvec3().normalize_or_zero();
        let beside = (position.as_dvec3() - self.center).cross(towards).length_squared();
        if beside > self.radius * self.radius {
            return 0.0;
        }
        let met = lights
            .extras()
            .distants()
            .iter()
            .enumerate()
            .filter(|(i, light)| Some(*i) != except && light.holds(towards));
        met.map(|(_, light)| self.pdf(light)).sum()
    }
}
