//! Light on its way out: points and directions in which photons leave emitters, or enter through portals.
//!
//! A photon's density is per area perpendicular to its direction and per solid angle, the measure in which radiance
//! is power. So the power that it carries is radiance (times transmittance) over density.

use core::f32::consts::PI;

use glam::Vec3;

use super::distant_rays::DistantRays;
use super::emission_sample::EmissionSample;
use super::finite::{to_finite, to_positive};
use super::lights::{LightSampler, LightSamplerView};
use crate::env::DirectionDistribution;
use crate::light::{EmissionStart, EmittedRay, LightKind, LightLeaf, LightPoint, LocalPoint, PlacedObject};
use crate::math;
use crate::receiver::shutter_time;
use crate::record::{Hit, LightId};
use crate::technique::LightScene;
use crate::tlas::{Beam, Outgoing};
use crate::warp::{Variate, pick_pair, seed};

/// Draws the rays in which light leaves all lights of a scene, for photon maps, light tracing and bidirectional
/// methods.
///
/// What does not depend on the direction it is seen from (emitters, and portals to a constant environment) is drawn by
/// its power, with cosine-distributed directions from surfaces, and uniform ones from lights without an extent. For
/// portals to an image, a direction is drawn by radiance times the area that all portals turn towards it, then a point
/// by transmittance and that area.
///
/// An environment that is a light itself ([`environment_as_light`](crate::LightSamplerBuilder::environment_as_light))
/// sends no photons here but through portals: where they would start depends on the extent of the host's scene. Neither
/// do distant lights, until [`within`](Self::within) says where the scene is.
///
/// Photons know of no light groups: all lights send them.
///
/// Made by [`LightSampler::emission`](crate::LightSampler::emission) in some microseconds; holds about 1.5 KB. Make it
/// again after the environment has been rotated.
#[derive(Clone, Debug)]
#[must_use]
pub struct Emission<'a> {
    scene: LightScene<'a>,
    directions: DirectionDistribution,
    /// Probabilities of a ray that does not depend on the direction, and of one from the environment's image, among all
    /// rays that are not of distant lights.
    local_shares: [f64; 2],
    /// The rays of distant lights, and their probability.
    distant: Option<(DistantRays, f64)>,
}

impl LightSampler {
    /// Prepares to draw rays of light that leave the lights: see [`LightSamplerView::emission`].
    pub fn emission(&self) -> Emission<'_> {
        self.as_view().emission()
    }
}

impl<'a> LightSamplerView<'a> {
    /// Prepares to draw rays of light.
    pub fn emission(&self) -> Emission<'a> {
        Emission::new(self.scene)
    }
}

impl<'a> Emission<'a> {
    fn new(scene: LightScene<'a>) -> Self {
        let directions = DirectionDistribution::new(&scene.environment, |direction, radius| {
            let (sin, cos) = math::sin_cos(radius);
            outgoing_of_all(&scene, &beam(&scene, -direction, [sin, cos]))
        });
        let diffuse = PI * outgoing_of_all(&scene, &Outgoing::Diffuse);
        let mean = scene.environment.mean_without_features();
        let is_image = !scene.environment.is_constant() && mean > 0.0;
        let through = if is_image { directions.total() / mean } else { 0.0 };
        let total = f64::from(diffuse) + f64::from(through);
        let share = |power: f32| if power > 0.0 { f64::from(power) / total } else { 0.0 };
        Self { scene, directions, local_shares: [share(diffuse), share(through)], distant: None }
    }

    /// Sets the time at which light leaves, in the shutter interval from 0 to 1; 0 until this sets it, and for NaN. A
    /// time outside of the interval counts as its nearer end. It matters only where lights move, and costs nothing: an
    /// [`Emission`] can be copied for each photon's time.
    pub fn at_time(mut self, time: f32) -> Self {
        self.scene.lights.time = shutter_time(time);
        self
    }

    /// Makes distant lights send photons as well: into a ball that holds all of the host's scene. Each starts in a disk
    /// that covers the ball, perpendicular to its direction.
    ///
    /// The density is per area perpendicular to the direction and, if the light has an extent, per solid angle. So the
    /// power of a ray is radiance over density, or irradiance over density for a light without an extent. Without
    /// distant lights, or with a radius that is not positive, nothing changes, and neither does it with a coordinate or a
    /// radius above 1e15; another ball takes the place of the one before.
    pub fn within(mut self, center: Vec3, radius: f32) -> Self {
        let Some(rays) = DistantRays::new(&self.scene.lights, center, radius) else { return self };
        let share = rays.power() / (rays.power() + self.power());
        self.distant = Some((rays, share));
        self
    }

    /// Returns the power of all lights but the distant ones.
    fn power(&self) -> f64 {
        let diffuse = PI * outgoing_of_all(&self.scene, &Outgoing::Diffuse);
        let [diffuse_share, through_share] = self.local_shares;
        let diffuse = f64::from(diffuse) * f64::from(self.scene.lights.energy);
        let mean = f64::from(self.scene.environment.mean_without_features());
        let through = f64::from(self.directions.total()) * f64::from(self.scene.lights.energy) / mean;
        let counted = |share: f64, power: f64| if share > 0.0 { power } else { 0.0 };
        counted(diffuse_share, diffuse) + counted(through_share, through)
    }

    /// Returns the probabilities of a ray that does not depend on the direction, and of one from the environment's
    /// image.
    fn shares(&self) -> [f64; 2] {
        let others = self.distant.as_ref().map_or(1.0, |(_, share)| 1.0 - share);
        self.local_shares.map(|share| share * others)
    }

    /// Draws a ray of light. `u` is uniform in `[0, 1)⁵`: the first number chooses the light, the next two the point on
    /// it, the last two the direction.
    ///
    /// Returns `None` where the drawn direction meets no side of a light that emits; such a `u` counts as a ray without
    /// power.
    #[must_use]
    pub fn sample(&self, u: [f32; 5]) -> Option<EmissionSample> {
        let [mut choice, b1, b2, d1, d2] = variates(u);
        if let Some((rays, share)) = &self.distant {
            // The difference before it is rounded: after, a small share of the other lights would be rounding alone.
            if pick_pair([*share as f32, (1.0 - *share) as f32], &mut choice) == 0 {
                return rays.sample(&self.scene.lights, *share, choice.value(), [b1, b2], [d1, d2]);
            }
        }
        if self.local_shares == [0.0; 2] {
            return None;
        }
        match pick_pair(self.local_shares.map(|share| share as f32), &mut choice) {
            0 => self.sample_diffuse(choice, [b1, b2], [d1, d2]),
            _ => {
                let (towards, pdf) = self.directions.sample(&self.scene.environment, [d1, d2])?;
                self.sample_beam(-towards, self.shares()[1] * pdf, choice, [b1, b2])
            }
        }
    }

    /// Draws a ray of light that comes through the portals in a given direction of travel, a unit vector: light of a
    /// source that is infinitely far away. The density is per area perpendicular to the direction.
    ///
    /// Returns `None` as [`Self::sample`] does.
    #[must_use]
    pub fn sample_distant(&self, direction: Vec3, u: [f32; 3]) -> Option<EmissionSample> {
        let [choice, b1, b2] = variates(u);
        self.sample_beam(direction, 1.0, choice, [b1, b2])
    }

    /// Returns the density with which [`Self::sample`] draws the ray that starts at a point of a light in a unit
    /// direction, in which light travels: per solid angle, and per area perpendicular to the direction. Zero where it
    /// cannot.
    #[must_use]
    pub fn pdf(&self, hit: &Hit, direction: Vec3) -> f32 {
        let density = self.scene.lights.leaf_of_hit(hit).map_or(0.0, |leaf| {
            let directions = self.directions.pdf(&self.scene.environment, -direction);
            self.density(LightPoint::new(leaf, hit.barycentrics), direction, directions)
        });
        to_finite(density)
    }

    /// Returns the density with which [`Self::sample`] draws a ray from a light that is not made of triangles, in a
    /// unit direction in which light travels: per solid angle and, if the light has an extent, per area perpendicular
    /// to the direction. Zero where it cannot. Which of its points the ray starts from makes no difference, if light
    /// leaves it in that direction.
    #[must_use]
    pub fn pdf_light(&self, light: LightId, direction: Vec3) -> f32 {
        if let (Some(place), Some((rays, share))) = (self.scene.lights.extras().distant_of(light), &self.distant) {
            let light = &self.scene.lights.extras().distants()[place];
            return if light.sends(direction) { to_finite(share * rays.pdf(light)) } else { 0.0 };
        }
        let leaf = self.scene.lights.leaf_of_lamp(light).map(LightLeaf::alone);
        let density = |leaf| self.density(LightPoint { leaf, point: LocalPoint::NONE }, direction, 0.0);
        to_finite(leaf.map_or(0.0, density))
    }

    /// Returns the density with which [`Self::sample`] draws a ray that arrives at a point from a unit direction
    /// `towards` the light, whichever light it started from: the sum over all points that the line crosses. In the
    /// measure of [`Self::pdf`]; times the cosine at a surface it is a density per area of that surface.
    #[must_use]
    pub fn pdf_ray(&self, position: Vec3, towards: Vec3) -> f32 {
        to_finite(self.ray_density(position, towards, None) + self.distant_density(position, towards, None))
    }

    /// Returns [`Self::pdf_ray`] of a ray that [`Self::sample`] has drawn, at the point where it has landed.
    ///
    /// The point that the ray started from counts with its own density whatever rounding does to the line, so the
    /// result is never below `ray.pdf`. A ray that starts at a triangle's edge could miss it on the way back. For a ray
    /// from a light without an extent the result is `ray.pdf`.
    #[must_use]
    pub fn pdf_sample_ray(&self, ray: &EmissionSample, landed: Vec3) -> f32 {
        if !ray.has_extent() {
            return ray.pdf;
        }
        let own = self.scene.lights.leaf_of_sampled(&ray.light);
        let distant = ray.light.id().and_then(|id| self.scene.lights.extras().distant_of(id));
        let others =
            self.ray_density(landed, -ray.direction, own) + self.distant_density(landed, -ray.direction, distant);
        to_finite(f64::from(ray.pdf) + others)
    }

    /// Sum of the densities of a line by distant lights, except one.
    fn distant_density(&self, position: Vec3, towards: Vec3, except: Option<usize>) -> f64 {
        let Some((rays, share)) = &self.distant else { return 0.0 };
        share * rays.line_pdf(&self.scene.lights, position, towards, except)
    }

    /// Sum of the densities of all points along a line, except those of one light.
    fn ray_density(&self, position: Vec3, towards: Vec3, except: Option<LightLeaf>) -> f64 {
        let directions = self.directions.pdf(&self.scene.environment, towards);
        let mut density = 0.0;
        self.scene.cross(
            position,
            towards,
            |leaf| Some(leaf) != except,
            |point| density += self.density(point, -towards, directions),
        );
        density
    }

    /// Returns the density, per area perpendicular to the unit direction of travel, with which [`Self::sample_distant`]
    /// draws a point of a portal. Zero where it cannot.
    #[must_use]
    pub fn pdf_distant(&self, direction: Vec3, hit: &Hit) -> f32 {
        let leaf = self.scene.lights.leaf_of_hit(hit);
        to_finite(leaf.map_or(0.0, |leaf| self.beam_density(LightPoint::new(leaf, hit.barycentrics), direction)))
    }

    fn density(&self, point: LightPoint, direction: Vec3, directions: f64) -> f64 {
        if is_directional(&self.scene, point.leaf) {
            self.shares()[1] * directions * self.beam_density(point, direction)
        } else {
            self.diffuse_density(point, direction)
        }
    }

    fn sample_diffuse(&self, mut u: Variate, point: [Variate; 2], direction: [Variate; 2]) -> Option<EmissionSample> {
        let (leaf, pmf) = self.scene.sample_outgoing(&Outgoing::Diffuse, &mut u)?;
        let EmittedRay { point, position, normal, direction, pdf } =
            self.scene.lights.emit(leaf, point, direction, u.value())?;
        (pdf > 0.0).then(|| EmissionSample {
            light: self.scene.lights.sampled(LightPoint { leaf, point }),
            position: position.as_vec3(),
            normal,
            direction,
            pdf: to_positive(self.shares()[0] * pmf * pdf),
            pmf: to_positive(pmf),
        })
    }

    fn diffuse_density(&self, point: LightPoint, direction: Vec3) -> f64 {
        match self.scene.lights.emission_pdf(point, direction) {
            0.0 => 0.0,
            pdf => self.shares()[0] * self.scene.pmf_outgoing(point.leaf, &Outgoing::Diffuse) * pdf,
        }
    }

    fn sample_beam(
        &self,
        direction: Vec3,
        direction_pdf: f64,
        mut u: Variate,
        point: [Variate; 2],
    ) -> Option<EmissionSample> {
        let beam = beam(&self.scene, direction, [0.0, 1.0]);
        let (leaf, pmf) = self.scene.sample_outgoing(&beam, &mut u)?;
        let start = self.scene.lights.sample_start(leaf, point)?;
        let cosine = self.beam_cosine(leaf, &start, direction)?;
        let point = LightPoint { leaf, point: LocalPoint::on_triangle(start.point) };
        Some(EmissionSample {
            light: self.scene.lights.sampled(point),
            position: start.position.as_vec3(),
            normal: start.normal,
            direction,
            pdf: to_positive(direction_pdf * pmf * start.pdf_area / cosine),
            pmf: to_positive(pmf),
        })
    }

    fn beam_density(&self, LightPoint { leaf, point }: LightPoint, direction: Vec3) -> f64 {
        let Some(start) = self.scene.lights.start_at(leaf, point) else { return 0.0 };
        let Some(cosine) = self.beam_cosine(leaf, &start, direction) else { return 0.0 };
        let beam = beam(&self.scene, direction, [0.0, 1.0]);
        self.scene.pmf_outgoing(leaf, &beam) * start.pdf_area / cosine
    }

    /// Area perpendicular to a beam per area of a portal; `None` for what the beam does not pass.
    fn beam_cosine(&self, leaf: LightLeaf, start: &EmissionStart, direction: Vec3) -> Option<f64> {
        if !self.scene.lights.is_portal(leaf) {
            return None;
        }
        let cosine = start.normal.as_dvec3().dot(direction.as_dvec3());
        let cosine = if start.two_sided { cosine.abs() } else { cosine };
        (cosine > 0.0).then_some(cosine)
    }
}

/// What comes through portals in a cone of directions of travel, of which sine and cosine of the half angle are given.
fn beam(scene: &LightScene<'_>, direction: Vec3, spread: [f32; 2]) -> Outgoing {
    Outgoing::Beam(Beam { direction, spread, portals_apart: !scene.environment.is_constant() })
}

/// What all lights send out, in units of the sum of their energies.
fn outgoing_of_all(scene: &LightScene<'_>, outgoing: &Outgoing) -> f32 {
    let of_one = || if scene.lights.len() == 1 { outgoing_of_one(scene, outgoing) } else { 0.0 };
    scene.tlas.outgoing(outgoing).unwrap_or_else(of_one)
}

/// What the only light sends out, in units of its energy.
fn outgoing_of_one(scene: &LightScene<'_>, outgoing: &Outgoing) -> f32 {
    if let Some(placed) = scene.lights.instance(0) {
        return outgoing_of_instance(scene, &placed, outgoing);
    }
    let (light, is_directional) = (scene.lights.light(0), is_directional(scene, LightLeaf::alone(0)));
    match outgoing {
        Outgoing::Diffuse => f32::from(u8::from(!is_directional)),
        Outgoing::Beam(beam) if is_directional || !beam.portals_apart => {
            let (bounds, moments) = light.bounds(false, |_| 1.0);
            let cone = if light.is_moving() { math::sin_cos(bounds.normals.theta).into() } else { [0.0, 1.0] };
            beam.projection(bounds.normals.axis, cone, moments.normal, bounds.two_sided)
        }
        Outgoing::Beam(_) => 0.0,
    }
}

/// What the only instance sends out, in units of its energy.
fn outgoing_of_instance(scene: &LightScene<'_>, placed: &PlacedObject<'_>, outgoing: &Outgoing) -> f32 {
    let [flux, portal] = placed.shares(scene.environment.mean_without_features());
    let is_image = !scene.environment.is_constant();
    match outgoing {
        Outgoing::Diffuse => {
            if is_image {
                flux
            } else {
                flux + portal
            }
        }
        Outgoing::Beam(beam) => {
            let (bounds, moments) = placed.bounds(false, |_| 1.0);
            let (sin, cos) = math::sin_cos(bounds.normals.theta);
            let projection = beam.projection(bounds.normals.axis, [sin, cos], moments.normal, bounds.two_sided);
            projection * if beam.portals_apart { portal } else { flux + portal }
        }
    }
}

/// Whether what a light sends depends on the direction it is seen from.
fn is_directional(scene: &LightScene<'_>, leaf: LightLeaf) -> bool {
    scene.lights.is_portal(leaf) && !scene.environment.is_constant()
}

/// One variate for each number of a sample.
fn variates<const D: usize>(u: [f32; D]) -> [Variate; D] {
    let salt = seed(&u);
    core::array::from_fn(|i| Variate::new(u[i], salt ^ i as u64))
}
