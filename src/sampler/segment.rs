//! Stretches of rays in participating media.

use glam::Vec3;

use super::finite::{to_finite, to_positive};
use super::lights::{LightSampler, LightSamplerView};
use super::point::PointSampler;
use crate::light::LightsView;
use crate::receiver::{ALL_GROUPS, Receiver, ShadingPoint, shutter_time};
use crate::record::LightSample;
use crate::technique::{Distances, LightScene, MediumSegment};
use crate::tlas::Stretch;
use crate::warp::{Variate, seed};

/// Optical depth beyond which nothing arrives. *Proved*: a share of 1e-26 of the light is left. A smaller one would cut
/// off what can be seen.
const DEEPEST: f32 = 60.0;

/// A stretch of a ray in a participating medium that scatters light towards the start of the ray.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
#[must_use]
pub struct RaySegment {
    /// Where the stretch starts.
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
    /// Length, which may be infinite where the extinction is positive.
    pub length: f32,
    /// Extinction coefficient: the share of the light that is lost per length, for short lengths. 0 where all is to be
    /// seen.
    pub extinction: f32,
    /// How a direction is weighted at the points of the stretch: [`Receiver::Volume`], or a phase function.
    pub receiver: Receiver,
    /// Light groups that the points receive: see [`ShadingPoint::with_groups`].
    pub groups: u32,
    /// Time in the shutter interval.
    time: f32,
}

impl RaySegment {
    /// Returns a stretch of a ray from `origin` along `direction`, a vector of any length, in an isotropic medium.
    pub fn new(origin: Vec3, direction: Vec3, length: f32, extinction: f32) -> Self {
        let direction = direction.as_dvec3().normalize_or_zero().as_vec3();
        Self { origin, direction, length, extinction, receiver: Receiver::Volume, groups: ALL_GROUPS, time: 0.0 }
    }

    /// Sets how directions are weighted at the points of the stretch.
    pub const fn receiver(mut self, receiver: Receiver) -> Self {
        self.receiver = receiver;
        self
    }

    /// Sets the light groups that the points receive.
    pub const fn with_groups(mut self, groups: u32) -> Self {
        self.groups = groups;
        self
    }

    /// Sets the time at which light is gathered along the segment: see [`ShadingPoint::at_time`].
    pub fn at_time(mut self, time: f32) -> Self {
        self.time = shutter_time(time);
        self
    }

    /// Returns the shading point at a distance.
    #[must_use]
    pub fn point(&self, distance: f32) -> ShadingPoint {
        let x = ShadingPoint::new(self.origin + distance * self.direction, self.receiver);
        x.with_groups(self.groups).at_time(self.time)
    }

    /// The part of the segment from which anything arrives; `None` if there is none.
    fn medium(&self) -> Option<MediumSegment> {
        let is_medium = self.extinction >= 0.0 && self.extinction.is_finite() && self.direction != Vec3::ZERO;
        let length = self.length.min(DEEPEST / self.extinction);
        let is_stretch =
            self.length > 0.0 && length > 0.0 && length <= 1e15 && self.origin.abs().cmple(Vec3::splat(1e15)).all();
        (is_medium && is_stretch).then(|| MediumSegment {
            stretch: Stretch { origin: self.origin, direction: self.direction, length },
            extinction: self.extinction.into(),
        })
    }
}

/// A distance along a segment, and a sample of a light for the point there.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct SegmentSample {
    /// Distance from the start of the segment.
    pub distance: f32,
    /// Density of the distance per length. Finite and above zero.
    pub pdf_distance: f32,
    /// Sample of the lights for the point at this distance. Its densities are those given the distance: the density of
    /// both is the product with [`Self::pdf_distance`].
    pub light: LightSample,
}

/// The lights as seen from a stretch of a ray: made by [`LightSampler::along`].
///
/// A distance is chosen by what is expected to arrive there: near lights, by the angle along the ray (equiangular
/// sampling), where the environment shines in through portals, and by transmittance alone for the rest. Then a light is
/// chosen as from any point in a medium. Both densities are known for any distance and direction.
#[derive(Clone, Debug)]
#[must_use]
pub struct SegmentSampler<'a> {
    lights: LightSamplerView<'a>,
    segment: RaySegment,
    /// `None` where nothing can arrive.
    distances: Option<Distances>,
}

impl<'a> LightSamplerView<'a> {
    /// Returns the lights as seen from a stretch of a ray: see [`LightSampler::along`].
    pub fn along(&self, segment: &RaySegment) -> SegmentSampler<'a> {
        let medium = segment.medium();
        let lights = LightsView { time: segment.time, ..self.scene.lights };
        let scene = LightScene { lights, ..self.scene };
        let distances = medium.map(|medium| Distances::new(&scene, medium, segment.groups));
        SegmentSampler { lights: *self, segment: *segment, distances }
    }
}

impl LightSampler {
    /// Returns the lights as seen from a stretch of a ray in a participating medium, for points to be chosen on it.
    ///
    /// ```
    /// use fanlight::glam::Vec3;
    /// use fanlight::{LightSampler, RaySegment, SphereLight};
    ///
    /// let lights = LightSampler::builder().light(SphereLight::new(Vec3::new(3.0, 0.1, 0.0), 0.01, 1e4))?.build()?;
    /// let (scattering, extinction) = (0.1, 0.12);
    /// let along = lights.along(&RaySegment::new(Vec3::ZERO, Vec3::X, 8.0, extinction));
    /// let sample = along.sample([0.5, 0.3, 0.2, 0.9]).expect("the sphere is lit");
    /// // Near the sphere.
    /// assert!((sample.distance - 3.0).abs() < 0.2);
    /// let phase = 0.25 / core::f32::consts::PI;
    /// let transmittance = (-extinction * (sample.distance + sample.light.distance)).exp();
    /// let radiance = scattering * transmittance * phase * 1e4 / (sample.pdf_distance * sample.light.pdf);
    /// assert!(radiance > 0.0);
    /// # Ok::<(), fanlight::Error>(())
    /// ```
    pub fn along(&self, segment: &RaySegment) -> SegmentSampler<'_> {
        self.as_view().along(segment)
    }
}

impl<'a> SegmentSampler<'a> {
    /// Draws a distance and a light. `u` is uniform in `[0, 1)⁴`: the first number chooses the distance, the others the
    /// light as in [`PointSampler::sample`].
    ///
    /// Returns `None` where nothing arrives; that counts as a sample of zero.
    #[must_use]
    pub fn sample(&self, [u, choice, u1, u2]: [f32; 4]) -> Option<SegmentSample> {
        let (distance, pdf_distance) = self.sample_distance(u)?;
        let light = self.at(distance).sample([choice, u1, u2])?;
        Some(SegmentSample { distance, pdf_distance, light })
    }

    /// Draws a distance alone, with its density per length, for hosts that do more than one thing there. `u` is uniform
    /// in `[0, 1)`. `None` for an invalid segment: without a direction or a length, or with a length that is too large.
    #[must_use]
    pub fn sample_distance(&self, u: f32) -> Option<(f32, f32)> {
        let (distance, pdf) = self.distances.as_ref()?.sample(Variate::new(u, seed(&[u])));
        (pdf > 0.0).then(|| (distance, to_positive(pdf)))
    }

    /// Returns the density per length with which [`Self::sample`] chooses a distance, whatever it finds there. Zero
    /// outside of the segment.
    #[must_use]
    pub fn pdf_distance(&self, distance: f32) -> f32 {
        self.distances.as_ref().map_or(0.0, |distances| to_finite(distances.pdf(distance)))
    }

    /// Returns the density of a distance and a direction from the point there, per length and per solid angle: the
    /// product of [`Self::pdf_distance`] and [`PointSampler::pdf_direction`].
    #[must_use]
    pub fn pdf(&self, distance: f32, direction: Vec3) -> f32 {
        let pdf = self.distances.as_ref().map_or(0.0, |distances| distances.pdf(distance));
        if pdf == 0.0 { 0.0 } else { to_finite(pdf * f64::from(self.at(distance).pdf_direction(direction))) }
    }

    /// Returns the lights as seen from the point at a distance.
    pub fn at(&self, distance: f32) -> PointSampler<'a> {
        self.lights.at(&self.segment.point(distance))
    }
}
