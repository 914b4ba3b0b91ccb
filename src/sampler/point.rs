//! The lights as seen from one shading point: the one door to samples and densities.

use core::cell::{Ref, RefCell};

use glam::Vec3;

use super::finite::{to_finite, to_positive};
use crate::light::{LightLeaf, LightPoint, LightView, LightViewKind};
use crate::receiver::ShadingPoint;
use crate::record::{Hit, InstanceId, LightId, LightSample, SampledLight, TriangleId};
use crate::technique::{DistantDirection, Drawn, Mixed, Mixture, SkyDirection, Variates, Viewpoint};
use crate::tlas::Splitting;
use crate::visibility::RegionFactors;
use crate::warp::{Variate, seed};

/// Distance of the positions of samples of the environment. Chosen: beyond the largest coordinate of a light, 1e9, and
/// of a shading point, 1e15, and its square is a finite `f32`.
///
/// Larger: hosts that square the distance overflow. Smaller: the position could lie in front of something.
const ENVIRONMENT_DISTANCE: f32 = 1e15;

/// The lights as seen from one shading point: made by [`LightSampler::at`](crate::LightSampler::at).
///
/// What the calls at one point have in common is computed once, by the first of them: above all, which bright features
/// of the environment are visible through the portals. A sampler belongs to one point and one thread. It costs next to
/// nothing before its first call.
#[derive(Debug)]
#[must_use]
pub struct PointSampler<'a> {
    pub(super) at: Viewpoint<'a>,
    /// Completed in place by the first call: a mixture is large, and one that a function returns is copied.
    mixture: RefCell<Mixture>,
}

impl<'a> PointSampler<'a> {
    /// Returns the sampler of a viewpoint.
    ///
    /// To be called with a literal, and itself a literal: what goes through a variable is copied, and a sampler is
    /// large.
    #[inline(always)]
    pub(super) fn new(at: Viewpoint<'a>) -> Self {
        Self { mixture: RefCell::new(Mixture::of_trees()), at }
    }

    /// Returns the techniques at this point.
    #[inline(always)]
    pub(super) fn mixture(&self) -> Ref<'_, Mixture> {
        if self.at.scene.has_more_than_trees() {
            self.look_beside();
        }
        self.mixture.borrow()
    }

    /// Finds out what there is besides the trees, the first time it is called.
    #[inline(never)]
    fn look_beside(&self) {
        if let Ok(mut mixture) = self.mixture.try_borrow_mut() {
            mixture.look_beside(&self.at);
        }
    }

    /// Draws a point on the lights. `u` is uniform in `[0, 1)³`: the first number chooses the light, the other two the
    /// point on it, so that stratified pairs stay stratified. (Where all lights are a few triangles without textures,
    /// what the choice leaves of the first number chooses one of three turns of that point.)
    ///
    /// Returns `None` where nothing can arrive from the part of the lights that `u` leads to; such a `u` counts as a
    /// sample of zero. The densities of all points integrate to the probability of not getting `None`.
    #[must_use]
    pub fn sample(&self, u: [f32; 3]) -> Option<LightSample> {
        if self.at.has_few() {
            if let Some(sample) = self.at.sample_few(u) {
                return sample;
            }
        }
        let mixture = self.mixture();
        let mixed = mixture.one();
        let mut variates = Variates::new(u);
        if mixed.chooses_distant(&mut variates.choice) {
            return self.sample_distant(&mixed, &mut variates.choice, variates.point);
        }
        if mixed.chooses_sky(&mut variates.choice) {
            return self.sample_environment(&mixed, variates.point);
        }
        mixed.sample(&self.at, variates, |drawn, view| light_sample(&self.at, drawn, view))
    }

    /// Draws a direction of the environment as a light.
    fn sample_environment(&self, mixed: &Mixed<'_>, u: [Variate; 2]) -> Option<LightSample> {
        let SkyDirection { direction, pdf } = mixed.sample_sky(&self.at, u)?;
        let pdf = to_positive(pdf);
        Some(LightSample {
            light: SampledLight::Environment,
            position: self.at.x.position + direction * ENVIRONMENT_DISTANCE,
            normal: -direction,
            direction,
            distance: f32::INFINITY,
            pdf,
            pdf_area: pdf,
            pmf: to_positive(mixed.sky_pmf()),
        })
    }

    /// Draws a direction of a distant light.
    #[inline(never)]
    fn sample_distant(&self, mixed: &Mixed<'_>, choice: &mut Variate, u: [Variate; 2]) -> Option<LightSample> {
        let DistantDirection { light, direction, pmf, pdf } = mixed.sample_distant(&self.at, choice, u)?;
        let pdf = to_positive(pdf);
        Some(LightSample {
            light: self.at.scene.lights.extras().distants().get(light)?.sampled(),
            position: self.at.x.position + direction * ENVIRONMENT_DISTANCE,
            normal: -direction,
            direction,
            distance: f32::INFINITY,
            pdf,
            pdf_area: pdf,
            pmf: to_positive(pmf),
        })
    }

    /// Draws a point on a light that the tree has chosen.
    #[inline(always)]
    pub(super) fn sample_on(&self, chosen: (LightLeaf, f64), u: [Variate; 2]) -> Option<LightSample> {
        self.mixture().one().sample_on(&self.at, chosen, u, |drawn, view| light_sample(&self.at, drawn, view))
    }

    /// Moves the sampler to another shading point from which no bright feature is visible either.
    pub(super) fn move_to(&mut self, x: &ShadingPoint, visibility: Option<RegionFactors<'a>>) {
        self.at.x = *x;
        self.at.visibility = visibility;
    }

    /// Returns the density per solid angle with which [`Self::sample`] draws this point of this triangle. Zero where it
    /// cannot; never infinite.
    ///
    /// Where a ray can cross several portals, use [`Self::pdf_direction`].
    #[must_use]
    pub fn pdf(&self, hit: &Hit) -> f32 {
        if self.at.has_few() {
            let Some(leaf) = self.at.scene.lights.leaf_of_hit(hit) else { return 0.0 };
            if let Some([_, pdf]) = self.at.density_of_few(leaf, LightPoint::new(leaf, hit.barycentrics).point) {
                return to_finite(pdf);
            }
        }
        self.pdf_of_hit(hit, &self.mixture().one())
    }

    /// Returns the density per solid angle with which [`Self::sample`] draws the point that a ray in a unit direction
    /// meets of a light that is not made of triangles. Zero where it cannot, and for a light without an extent, which
    /// no ray meets; never infinite.
    ///
    /// The caller, whose own intersector has found the light, decides that the ray meets it: rounding may take a
    /// sampled direction past a small light. For a distant light with an extent, this is the density of a ray that
    /// leaves the scene in one of its directions.
    #[must_use]
    pub fn pdf_light(&self, light: LightId, direction: Vec3) -> f32 {
        self.pdf_of_lamp(light, direction, &self.mixture().one())
    }

    /// Returns the density per solid angle with which [`Self::sample`] draws this direction of the environment, where
    /// that is a light ([`environment_as_light`](crate::LightSamplerBuilder::environment_as_light)). Zero where it
    /// cannot; never infinite. `direction` need not have unit length.
    ///
    /// In a scene without portals and distant lights, this is the density of a ray that has left the scene. It counts
    /// the environment alone: where the ray can cross portals or lead to a distant light, use [`Self::pdf_direction`].
    #[must_use]
    pub fn pdf_environment(&self, direction: Vec3) -> f32 {
        to_finite(self.environment_density(direction, &self.mixture().one()))
    }

    /// Returns the probability with which the trees choose this triangle, in `[0, 1]`.
    ///
    /// Samples towards bright features of the environment that are visible through portals are not counted. Without
    /// any, this is the probability with which [`Self::sample`] chooses the triangle.
    #[must_use]
    pub fn pmf(&self, triangle: TriangleId) -> f32 {
        let leaf = self.at.scene.lights.leaf(triangle).filter(|leaf| self.at.receives(*leaf));
        leaf.map_or(0.0, |leaf| self.mixture().one().pmf(&self.at, LightLeaf::alone(leaf)) as f32)
    }

    /// Returns [`Self::pmf`] of a triangle of an instance, which is numbered within its object.
    #[must_use]
    pub fn pmf_within(&self, instance: InstanceId, triangle: TriangleId) -> f32 {
        let leaf = self.at.scene.lights.leaf_within(instance, triangle).filter(|leaf| self.at.receives(leaf.top));
        leaf.map_or(0.0, |leaf| self.mixture().one().pmf(&self.at, leaf) as f32)
    }

    /// Returns the probability with which [`Self::sample`] chooses this light, which is not made of triangles, in
    /// `[0, 1]`.
    #[must_use]
    pub fn pmf_light(&self, light: LightId) -> f32 {
        if let Some(light) = self.at.scene.lights.extras().distant_of(light) {
            return self.mixture().one().distant_pmf(&self.at, light) as f32;
        }
        let leaf = self.at.scene.lights.leaf_of_lamp(light).filter(|leaf| self.at.receives(*leaf));
        leaf.map_or(0.0, |leaf| self.mixture().one().pmf(&self.at, LightLeaf::alone(leaf)) as f32)
    }

    /// Estimates the irradiance at the shading point from all lights together, as if nothing were in between but what
    /// learned visibility knows of: radiance times the cosine, integrated over directions. At a point with a lobe, the
    /// receiver's weight stands in for the cosine; in a volume without one it is 1. Never NaN, and zero only where
    /// nothing can arrive.
    ///
    /// It is for a choice between these lights and others that the host samples by itself. It is the estimate that
    /// [`Self::sample`] is guided by, from moments of clusters: good to some ten percent at most points, and off by
    /// more next to a large light.
    #[must_use]
    pub fn irradiance(&self) -> f32 {
        to_finite(self.mixture().irradiance(&self.at).into())
    }

    /// Returns the density per solid angle with which [`Self::sample`] goes in a direction: the sum over all points of
    /// all lights that the ray from the shading point crosses, which the crate finds by its own traversal, the distant
    /// lights with an extent that it leads to, and the environment if it is a light. `direction` need not have unit
    /// length.
    #[must_use]
    pub fn pdf_direction(&self, direction: Vec3) -> f32 {
        let mixture = self.mixture();
        let mixed = mixture.one();
        let triangles = self.direction_density(direction, None, &mixed);
        let distant = self.distant_density(direction, None, &mixed);
        to_finite(triangles + self.environment_density(direction, &mixed) + distant)
    }

    /// Returns [`Self::pdf_direction`] of a sample's own direction.
    ///
    /// The sampled point counts with its own density whatever rounding does to the ray, so the result is never below
    /// `sample.pdf`. Only what else the ray crosses is followed down the trees, so this is faster as well. Where all
    /// lights lie side by side in one plane, or on the surface of one convex body and face into it, nothing else can be
    /// crossed, and the result is `sample.pdf`. The same holds for a light without an extent, whose `sample.pdf`
    /// is a probability.
    #[must_use]
    pub fn pdf_sample_direction(&self, sample: &LightSample) -> f32 {
        if !sample.has_extent() {
            return sample.pdf;
        }
        let mixture = self.mixture();
        let mixed = mixture.one();
        let own = self.at.scene.lights.leaf_of_sampled(&sample.light);
        let environment = match sample.light {
            SampledLight::Environment => 0.0,
            _ => self.environment_density(sample.direction, &mixed),
        };
        let is_alone = own.is_some() && self.at.scene.lights.is_crossed_once;
        let others = if is_alone { 0.0 } else { self.direction_density(sample.direction, own, &mixed) };
        let distant = self.distant_density(sample.direction, sample.light.id(), &mixed);
        to_finite(f64::from(sample.pdf) + others + environment + distant)
    }

    /// Draws one point from each part of the light tree that adaptive splitting visits (Conty Estevez and Kulla 2018,
    /// section 5.4), one towards a bright feature of the environment if any is visible through a portal, one direction
    /// of the environment if that is a light, and one of the distant lights if there are any, and adds them to
    /// `samples`.
    ///
    /// The estimate is the *sum* of `f / pdf` over the samples: `pdf` and `pdf_area` are expected densities, the
    /// expected number of samples per measure, and `pmf` is the expected number on that triangle. Nothing is allocated
    /// but by `samples` itself.
    pub fn sample_split(&self, u: [f32; 3], splitting: &Splitting, samples: &mut impl Extend<LightSample>) {
        let salt = seed(&u);
        // Every number gets a key of its own, which distinguishes the draws and the three dimensions.
        let variate = |draw: u32, i: usize| {
            let key = 4 * u64::from(draw) + i as u64;
            Variate::scrambled(u[i], key, salt ^ key)
        };
        let mixture = self.mixture();
        let mixed = &mixture.side_by_side(splitting);
        let mut visits = 0;
        self.at.scene.tlas.sample_split(
            &self.at,
            splitting,
            |draw| variate(draw, 0),
            |leaf, count| {
                let point = [variate(visits, 1), variate(visits, 2)];
                // Which triangle of an instance: by a key that no draw has.
                let key = 4 * u64::from(visits) + 3;
                let within = || Variate::scrambled(u[0], key, salt ^ key);
                let chosen = self.at.choose_within(leaf, count, within);
                samples.extend(chosen.and_then(|chosen| {
                    mixed.sample_on(&self.at, chosen, point, |drawn, view| light_sample(&self.at, drawn, view))
                }));
                visits += 1;
            },
        );
        // A draw that no part of the tree has.
        let last = u32::MAX >> 2;
        let numbers = Variates { choice: variate(last, 0), point: [variate(last, 1), variate(last, 2)] };
        samples.extend(mixed.sample_feature(&self.at, numbers, |drawn, view| light_sample(&self.at, drawn, view)));
        let last = last - 1;
        samples.extend(self.sample_environment(mixed, [variate(last, 1), variate(last, 2)]));
        let last = last - 1;
        samples.extend(self.sample_distant(mixed, &mut variate(last, 0), [variate(last, 1), variate(last, 2)]));
    }

    /// Returns the expected density per solid angle of the samples of [`Self::sample_split`] at a point of a triangle,
    /// for multiple importance sampling.
    #[must_use]
    pub fn pdf_split(&self, hit: &Hit, splitting: &Splitting) -> f32 {
        self.pdf_of_hit(hit, &self.mixture().side_by_side(splitting))
    }

    /// Returns the expected density per solid angle of the samples of [`Self::sample_split`] at the point that a ray in
    /// a unit direction meets of a light that is not made of triangles; see [`Self::pdf_light`].
    #[must_use]
    pub fn pdf_split_light(&self, light: LightId, direction: Vec3, splitting: &Splitting) -> f32 {
        self.pdf_of_lamp(light, direction, &self.mixture().side_by_side(splitting))
    }

    /// Returns the expected density per solid angle of the samples of [`Self::sample_split`] at a direction of the
    /// environment, where that is a light.
    #[must_use]
    pub fn pdf_split_environment(&self, direction: Vec3, splitting: &Splitting) -> f32 {
        to_finite(self.environment_density(direction, &self.mixture().side_by_side(splitting)))
    }

    /// Returns the expected density per solid angle of the samples of [`Self::sample_split`] in a direction: the sum
    /// over all points that the ray crosses, and the environment if it is a light.
    #[must_use]
    pub fn pdf_split_direction(&self, direction: Vec3, splitting: &Splitting) -> f32 {
        let mixture = self.mixture();
        let mixed = mixture.side_by_side(splitting);
        let triangles = self.direction_density(direction, None, &mixed);
        let distant = self.distant_density(direction, None, &mixed);
        to_finite(triangles + self.environment_density(direction, &mixed) + distant)
    }

    fn pdf_of_hit(&self, hit: &Hit, mixed: &Mixed<'_>) -> f32 {
        let Some(leaf) = self.at.scene.lights.leaf_of_hit(hit) else { return 0.0 };
        let view = &self.at.view(leaf);
        let Some(view) = view else { return 0.0 };
        to_finite(mixed.density(&self.at, LightPoint::new(leaf, hit.barycentrics), view))
    }

    fn pdf_of_lamp(&self, light: LightId, direction: Vec3, mixed: &Mixed<'_>) -> f32 {
        if let Some(light) = self.at.scene.lights.extras().distant_of(light) {
            return to_finite(mixed.distant_density(&self.at, light, direction));
        }
        let Some(point) = self.at.scene.lights.point_of_lamp(light, direction) else { return 0.0 };
        let view = &self.at.view(point.leaf);
        let Some(view) = view else { return 0.0 };
        to_finite(mixed.density(&self.at, point, view))
    }

    /// Density of a direction by the environment as a light.
    fn environment_density(&self, direction: Vec3, mixed: &Mixed<'_>) -> f64 {
        if self.at.scene.sky.is_none() {
            return 0.0;
        }
        let unit = direction.as_dvec3().normalize_or_zero().as_vec3();
        if unit == Vec3::ZERO { 0.0 } else { mixed.sky_density(&self.at, unit) }
    }

    /// Sum of the densities of a direction by the distant lights that it leads to, except one.
    #[inline(always)]
    fn distant_density(&self, direction: Vec3, except: Option<LightId>, mixed: &Mixed<'_>) -> f64 {
        if self.at.scene.lights.extras().is_empty() { 0.0 } else { self.sum_of_distant(direction, except, mixed) }
    }

    #[inline(never)]
    fn sum_of_distant(&self, direction: Vec3, except: Option<LightId>, mixed: &Mixed<'_>) -> f64 {
        let extras = self.at.scene.lights.extras();
        let unit = direction.as_dvec3().normalize_or_zero();
        let except = except.and_then(|id| extras.distant_of(id));
        let lights = extras.distants().iter().enumerate();
        let met = lights.filter(|(light, record)| Some(*light) != except && record.holds(unit));
        met.map(|(light, _)| mixed.distant_density(&self.at, light, unit.as_vec3())).sum()
    }

    /// Sum of the densities of all points along a ray, except those of one light.
    fn direction_density(&self, direction: Vec3, except: Option<LightLeaf>, mixed: &Mixed<'_>) -> f64 {
        let mut density = 0.0;
        self.at.scene.cross(
            self.at.x.position,
            direction,
            |leaf| Some(leaf) != except,
            |point| {
                if let Some(view) = &self.at.view(point.leaf) {
                    density += mixed.density(&self.at, point, view);
                }
            },
        );
        density
    }
}

/// Everything that a host needs to know of a point that was drawn.
#[inline(always)]
fn light_sample(at: &Viewpoint<'_>, drawn: &Drawn, view: &LightView<'_>) -> Option<LightSample> {
    let relative = drawn.relative;
    let distance = relative.length();
    let positive = drawn.pdf > 0.0 && distance > 0.0 && distance.is_finite();
    positive.then(|| LightSample {
        light: at.scene.lights.sampled(drawn.point),
        position: (at.x.position.as_dvec3() + relative).as_vec3(),
        normal: view.normal(relative),
        direction: view.direction(drawn.point.point, relative, distance),
        distance: distance as f32,
        pdf: to_positive(drawn.pdf),
        pdf_area: to_positive(drawn.pdf * view.solid_angle_per_area(relative)),
        pmf: to_positive(drawn.pmf),
    })
}
