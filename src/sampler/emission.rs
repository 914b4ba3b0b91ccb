//! Light on its way out: points and directions in which photons leave emitters, or enter through portals.
//!
//! A photon's density is per area perpendicular to its direction and per solid angle, the measure in which radiance
//! is power. So the power that it carries is radiance (times transmittance) over density.

use core::f32::consts::{FRAC_1_PI, PI, TAU};

use glam::{DVec3, Vec3};

use super::lights::{LightSampler, LightSamplerView};
use super::sample::{to_finite, to_positive};
use crate::blas::{self, CellTarget, CellWeight, Draw, Follow, Guide, Lattice, LatticeCell};
use crate::env::Directions;
use crate::geometry;
use crate::light::LightTriangle;
use crate::math;
use crate::record::Hit;
use crate::tlas::{Beam, Outgoing};
use crate::warp::{Variate, pick_pair, seed};

/// A ray of light that leaves an emitter or enters through a portal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmissionSample {
    /// Where on the lights the ray starts.
    pub hit: Hit,
    /// World position of that point.
    pub position: Vec3,
    /// Unit normal of the triangle's front side.
    pub normal: Vec3,
    /// Unit direction in which the light travels.
    pub direction: Vec3,
    /// Density of the ray, finite and above zero: per area perpendicular to `direction` and, unless the direction was
    /// given, per solid angle.
    ///
    /// It counts this triangle alone; [`Emission::pdf_ray`] counts all that the ray passes.
    pub pdf: f32,
    /// Probability of having chosen the triangle, given the direction for a portal. In `(0, 1]`.
    pub pmf: f32,
}

/// Draws the rays in which light leaves all lights of a scene, for photon maps, light tracing and bidirectional
/// methods.
///
/// What does not depend on the direction it is seen from (emitters, and portals to a constant environment) is drawn by
/// its power, with cosine-distributed directions. For portals to an image, a direction is drawn by radiance times the
/// area that all portals turn towards it, then a point by transmittance and that area.
///
/// Made by [`LightSampler::emission`] in some microseconds; holds about 1.5 KB.
#[derive(Clone, Debug)]
pub struct Emission<'a, const N: usize = 16> {
    lights: LightSamplerView<'a, N>,
    directions: Directions,
    /// Probabilities of a ray that does not depend on the direction, and of one from the environment's image.
    shares: [f64; 2],
}

/// A cell of the texture is as good as any other of the same average.
struct Everywhere;

impl CellTarget for Everywhere {
    type Cell = ();

    fn whole(&self) {}

    fn child(&self, (): &(), _index: usize) {}

    #[inline]
    fn weigh(&self, _at: LatticeCell, (): &mut ()) -> CellWeight {
        CellWeight { weight: 1.0, is_final: true }
    }
}

impl<const N: usize> LightSampler<N> {
    /// See [`LightSamplerView::emission`].
    pub fn emission(&self) -> Emission<'_, N> {
        self.as_view().emission()
    }
}

impl<'a, const N: usize> LightSamplerView<'a, N> {
    /// Prepares to draw rays of light. To be made anew once the environment was turned.
    pub fn emission(&self) -> Emission<'a, N> {
        let directions = Directions::new(&self.environment, |direction, radius| {
            let (sin, cos) = math::sin_cos(radius);
            self.outgoing(&self.beam(-direction, [sin, cos]))
        });
        let diffuse = PI * self.outgoing(&Outgoing::Diffuse);
        let mean = self.environment.mean_without_suns();
        let is_image = !self.environment.is_constant() && mean > 0.0;
        let through = if is_image { directions.total() / mean } else { 0.0 };
        let total = f64::from(diffuse) + f64::from(through);
        let share = |power: f32| if power > 0.0 { f64::from(power) / total } else { 0.0 };
        Emission { lights: *self, directions, shares: [share(diffuse), share(through)] }
    }

    fn beam(&self, direction: Vec3, spread: [f32; 2]) -> Outgoing {
        Outgoing::Beam(Beam { direction, spread, portals_apart: !self.environment.is_constant() })
    }

    /// What all lights send out, in units of the sum of their energies.
    fn outgoing(&self, outgoing: &Outgoing) -> f32 {
        self.tlas.outgoing(outgoing).unwrap_or_else(|| match (self.triangles, outgoing) {
            ([light], Outgoing::Diffuse) => f32::from(u8::from(!self.is_directional(light))),
            ([light], Outgoing::Beam(beam)) if self.is_directional(light) || !beam.portals_apart => {
                let normal = light.triangle().normal_and_area().map_or(Vec3::ZERO, |(normal, _)| normal);
                beam.projection(normal, [0.0, 1.0], normal, light.is_two_sided())
            }
            _ => 0.0,
        })
    }

    /// Whether what a light sends depends on the direction it is seen from.
    fn is_directional(&self, light: &LightTriangle) -> bool {
        light.is_portal() && !self.environment.is_constant()
    }
}

impl<const N: usize> Emission<'_, N> {
    /// Draws a ray of light. `u` is uniform in `[0, 1)⁵`: the first chooses the triangle, the next two the point on it,
    /// the last two the direction.
    ///
    /// `None` where the drawn direction meets no side of a light that sends; such a `u` counts as a ray without power.
    pub fn sample(&self, u: [f32; 5]) -> Option<EmissionSample> {
        if self.shares == [0.0; 2] {
            return None;
        }
        let [mut choice, b1, b2, d1, d2] = variates(u);
        match pick_pair(self.shares.map(|share| share as f32), &mut choice) {
            0 => self.sample_diffuse(choice, [b1, b2], [d1, d2]),
            _ => {
                let (towards, pdf) = self.directions.sample(&self.lights.environment, [d1, d2])?;
                self.sample_beam(-towards, self.shares[1] * pdf, choice, [b1, b2])
            }
        }
    }

    /// Draws a ray of light that comes through the portals in a given direction of travel, a unit vector: light of a
    /// source that is infinitely far away. The density is per area perpendicular to the direction.
    ///
    /// `None` as for [`Self::sample`].
    pub fn sample_distant(&self, direction: Vec3, u: [f32; 3]) -> Option<EmissionSample> {
        let [choice, b1, b2] = variates(u);
        self.sample_beam(direction, 1.0, choice, [b1, b2])
    }

    /// Density with which [`Self::sample`] draws the ray that starts at a point of a light in a unit direction, in
    /// which light travels: per solid angle, and per area perpendicular to the direction. Zero where it cannot.
    pub fn pdf(&self, hit: &Hit, direction: Vec3) -> f32 {
        let density = self.lights.leaf(hit.triangle).map_or(0.0, |leaf| {
            let directions = self.directions.pdf(&self.lights.environment, -direction);
            self.density(leaf, Lattice::from_barycentrics(hit.barycentrics), direction, directions)
        });
        to_finite(density)
    }

    /// Density with which [`Self::sample`] draws a ray that arrives at a point from a unit direction `towards` the
    /// light, whichever light it started from: the sum over all points that the line crosses. In the measure
    /// of [`Self::pdf`]; times the cosine at a surface it is a density per area of that surface.
    pub fn pdf_ray(&self, position: Vec3, towards: Vec3) -> f32 {
        let directions = self.directions.pdf(&self.lights.environment, towards);
        let mut density = 0.0;
        self.lights.tlas.cross(position, towards, |leaf| {
            let vertices = self.lights.triangles[leaf as usize].triangle().exactly_relative_to(position);
            if let Some(hit) = geometry::intersect(vertices, towards) {
                density += self.density(leaf, Lattice::from_barycentrics(hit), -towards, directions);
            }
        });
        to_finite(density)
    }

    /// Density, per area perpendicular to the unit direction of travel, with which [`Self::sample_distant`] draws a
    /// point of a portal. Zero where it cannot.
    pub fn pdf_distant(&self, direction: Vec3, hit: &Hit) -> f32 {
        let density = self
            .lights
            .leaf(hit.triangle)
            .map_or(0.0, |leaf| self.beam_density(leaf, Lattice::from_barycentrics(hit.barycentrics), direction));
        to_finite(density)
    }

    fn density(&self, leaf: u32, place: Lattice, direction: Vec3, directions: f64) -> f64 {
        if self.lights.is_directional(&self.lights.triangles[leaf as usize]) {
            self.shares[1] * directions * self.beam_density(leaf, place, direction)
        } else {
            self.diffuse_density(leaf, place, direction)
        }
    }

    fn sample_diffuse(&self, mut u: Variate, point: [Variate; 2], direction: [Variate; 2]) -> Option<EmissionSample> {
        let (leaf, pmf) = self.lights.tlas.sample_outgoing(&Outgoing::Diffuse, &mut u)?;
        let start = self.start(leaf, &mut Draw::new(point), Draw::point)?;
        let side = if start.two_sided && u.value() < 0.5 { -start.normal } else { start.normal };
        let pdf = self.shares[0] * pmf * start.pdf_area * per_direction(start.two_sided);
        Some(self.ray(leaf, &start, cosine_direction(side, direction), pdf, pmf))
    }

    fn diffuse_density(&self, leaf: u32, place: Lattice, direction: Vec3) -> f64 {
        let Some(start) = self.start(leaf, &mut Follow::new(place), |_, _| place) else { return 0.0 };
        if !start.two_sided && start.normal.dot(direction) <= 0.0 {
            return 0.0;
        }
        let pmf = self.lights.tlas.pmf_outgoing(leaf, &Outgoing::Diffuse);
        self.shares[0] * pmf * start.pdf_area * per_direction(start.two_sided)
    }

    fn sample_beam(
        &self,
        direction: Vec3,
        direction_pdf: f64,
        mut u: Variate,
        point: [Variate; 2],
    ) -> Option<EmissionSample> {
        let (leaf, pmf) = self.lights.tlas.sample_outgoing(&self.lights.beam(direction, [0.0, 1.0]), &mut u)?;
        let start = self.start(leaf, &mut Draw::new(point), Draw::point)?;
        let cosine = self.beam_cosine(leaf, &start, direction)?;
        Some(self.ray(leaf, &start, direction, direction_pdf * pmf * start.pdf_area / cosine, pmf))
    }

    fn beam_density(&self, leaf: u32, place: Lattice, direction: Vec3) -> f64 {
        let Some(start) = self.start(leaf, &mut Follow::new(place), |_, _| place) else { return 0.0 };
        let Some(cosine) = self.beam_cosine(leaf, &start, direction) else { return 0.0 };
        self.lights.tlas.pmf_outgoing(leaf, &self.lights.beam(direction, [0.0, 1.0])) * start.pdf_area / cosine
    }

    /// Area perpendicular to a beam per area of a portal; `None` for what the beam does not pass.
    fn beam_cosine(&self, leaf: u32, start: &Start, direction: Vec3) -> Option<f64> {
        if !self.lights.triangles[leaf as usize].is_portal() {
            return None;
        }
        let cosine = start.normal.as_dvec3().dot(direction.as_dvec3());
        let cosine = if start.two_sided { cosine.abs() } else { cosine };
        (cosine > 0.0).then_some(cosine)
    }

    /// A point of a triangle by the averages of its texture, as a guide leads.
    fn start<G: Guide>(&self, leaf: u32, guide: &mut G, point: impl Fn(&G, LatticeCell) -> Lattice) -> Option<Start> {
        let light = &self.lights.triangles[leaf as usize];
        if self.lights.scale(light) == 0.0 {
            return None;
        }
        let triangle = light.triangle();
        let (normal, area) = triangle.normal_and_area()?;
        let (cell, pmf) = blas::descend(self.lights.cells, light.root, &Everywhere, guide)?;
        let place = point(guide, cell);
        let [b1, b2] = place.to_barycentrics().map(f64::from);
        let [v0, v1, v2] = triangle.exactly_relative_to(Vec3::ZERO);
        Some(Start {
            place,
            position: v0 * (1.0 - b1 - b2) + v1 * b1 + v2 * b2,
            normal,
            two_sided: light.is_two_sided(),
            pdf_area: pmf / (f64::from(area) * f64::from(cell.area())),
        })
    }

    fn ray(&self, leaf: u32, start: &Start, direction: Vec3, pdf: f64, pmf: f64) -> EmissionSample {
        EmissionSample {
            hit: Hit { triangle: self.lights.id(leaf), barycentrics: start.place.to_barycentrics() },
            position: start.position.as_vec3(),
            normal: start.normal,
            direction,
            pdf: to_positive(pdf),
            pmf: to_positive(pmf),
        }
    }
}

/// Where a ray starts.
struct Start {
    place: Lattice,
    position: DVec3,
    normal: Vec3,
    two_sided: bool,
    pdf_area: f64,
}

/// One variate for each number of a sample.
fn variates<const D: usize>(u: [f32; D]) -> [Variate; D] {
    let salt = seed(&u);
    core::array::from_fn(|i| Variate::new(u[i], salt ^ i as u64))
}

/// Density of cosine-distributed directions over the cosine: from one side, or evenly from two.
fn per_direction(two_sided: bool) -> f64 {
    f64::from(if two_sided { 0.5 * FRAC_1_PI } else { FRAC_1_PI })
}

/// A direction around a unit normal with a density of its cosine over π (Malley's method; pbrt, section A.5.3).
fn cosine_direction(normal: Vec3, u: [Variate; 2]) -> Vec3 {
    let [u1, u2] = u.map(|u| u.value_f32());
    let (sin_phi, cos_phi) = math::sin_cos(TAU * u2);
    let radius = math::sqrt(u1);
    // Never quite in the plane.
    let height = math::sqrt(1.0 - u1).max(f32::EPSILON);
    let (s, t) = normal.any_orthonormal_pair();
    (s * (radius * cos_phi) + t * (radius * sin_phi) + normal * height).normalize()
}
