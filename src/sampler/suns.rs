//! The environment's suns through the portals: a second technique next to the trees, and the balance of both.
//!
//! Whether a sun is seen through a portal is found by a few rays, exactly for a sun that is small and a portal that is
//! not. What the suns send is then known, the trees know about what the rest sends, and a sample chooses between them
//! in proportion. A density is the mixture of both.

use core::f32::consts::PI;

use glam::Vec3;

use super::at::PointSampler;
use super::lights::LightSamplerView;
use crate::blas::{self, Lattice, Shape};
use crate::env::MAX_SUNS;
use crate::geometry;
use crate::record::{Receiver, ShadingPoint};
use crate::warp::{Variate, pick, sum};

/// Least probability of the trees where they may find anything.
const LEAST_TREES: f32 = 0.02;
/// Largest estimate of an irradiance, so that sums stay finite.
const BRIGHTEST: f32 = 1e35;

/// Where a ray first crosses a portal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Crossing {
    pub(super) leaf: u32,
    pub(super) place: Lattice,
    distance: f64,
}

/// How often each technique is used at one shading point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Techniques {
    /// What each sun, and last what the trees are worth.
    weights: [f32; MAX_SUNS + 1],
    /// Probability of the trees; 1 if they are used anyway.
    pub(super) trees: f64,
    /// Probability of a sun per weight; 0 if none is seen.
    per_weight: f64,
}

/// A technique that was chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Technique {
    Trees,
    Sun(usize),
}

impl Techniques {
    /// The trees alone.
    const TREES: Self = Self { weights: [0.0; MAX_SUNS + 1], trees: 1.0, per_weight: 0.0 };

    /// Whether no sun is seen.
    #[inline]
    pub(super) fn is_trees(&self) -> bool {
        self.per_weight == 0.0
    }

    /// Probability of one sun.
    #[inline]
    fn sun(&self, sun: usize) -> f64 {
        f64::from(self.weights[sun]) * self.per_weight
    }

    /// Chooses one technique.
    #[inline]
    pub(super) fn choose(&self, u: &mut Variate) -> Technique {
        if self.is_trees() {
            return Technique::Trees;
        }
        match pick(&self.weights, sum(&self.weights), u) {
            MAX_SUNS => Technique::Trees,
            sun => Technique::Sun(sun),
        }
    }

    /// The trees in any case, and one of the suns next to them.
    pub(super) fn side_by_side(self) -> Self {
        if self.is_trees() {
            return self;
        }
        Self { trees: 1.0, per_weight: 1.0 / sum(&self.weights[..MAX_SUNS]), ..self }
    }

    /// Chooses among the suns alone, if any is seen.
    pub(super) fn choose_sun(&self, u: &mut Variate) -> Option<usize> {
        let suns = &self.weights[..MAX_SUNS];
        (!self.is_trees()).then(|| pick(suns, sum(suns), u))
    }
}

impl<const N: usize, const M: usize> LightSamplerView<'_, N, M> {
    /// What each technique is worth at a shading point.
    #[inline]
    pub(super) fn techniques(&self, x: &ShadingPoint) -> Techniques {
        if self.environment.suns().is_empty() || !self.has_portals() {
            return Techniques::TREES;
        }
        self.weigh(x)
    }

    fn weigh(&self, x: &ShadingPoint) -> Techniques {
        let mut weights = [0.0; MAX_SUNS + 1];
        for (sun, weight) in weights[..self.environment.suns().len()].iter_mut().enumerate() {
            *weight = self.sun_irradiance(sun, x);
        }
        let suns: f32 = weights.iter().sum();
        if !(suns > 0.0 && suns < BRIGHTEST) {
            return Techniques::TREES;
        }
        let trees = self.irradiance_by_trees(x);
        if trees > 0.0 {
            weights[MAX_SUNS] = trees.max(LEAST_TREES * suns).min(BRIGHTEST);
        }
        let total = sum(&weights);
        Techniques { weights, trees: f64::from(weights[MAX_SUNS]) / total, per_weight: 1.0 / total }
    }

    /// Estimate of the irradiance from all that the trees hold. Zero only if there is none.
    fn irradiance_by_trees(&self, x: &ShadingPoint) -> f32 {
        if let [light] = self.triangles {
            let Some(lit) = self.lit(0, x) else { return 0.0 };
            return PI * light.root.average * self.scale(light) * lit.worth(&blas::Cell::root(lit.vertices)).weight;
        }
        self.energy * self.tlas.irradiance(x, &self.scene(x))
    }

    /// Irradiance from a sun through the portals, by its centre and four points around it.
    fn sun_irradiance(&self, sun: usize, x: &ShadingPoint) -> f32 {
        let axis = self.environment.sun_axis(sun);
        let sun = self.environment.suns()[sun];
        if let Receiver::Surface(normal) = x.receiver
            && normal.dot(axis) <= -sun.sin_radius
        {
            return 0.0;
        }
        let (s, t) = axis.any_orthonormal_pair();
        let offset = RIM * sun.sin_radius;
        let directions = [axis, axis + s * offset, axis - s * offset, axis + t * offset, axis - t * offset];
        let seen = |direction: Vec3| {
            let transmittance = self.crossing(x, direction).map_or(0.0, |crossing| {
                let light = &self.triangles[crossing.leaf as usize];
                self.scale(light) * blas::average(self.cells, light.root, crossing.place)
            });
            transmittance * x.cosine(direction.normalize_or_zero())
        };
        sun.power * 0.2 * directions.into_iter().map(seen).sum::<f32>()
    }

    /// The first portal along a ray that lets anything through to `x`.
    pub(super) fn crossing(&self, x: &ShadingPoint, direction: Vec3) -> Option<Crossing> {
        let mut first: Option<Crossing> = None;
        self.tlas.cross(x.position, direction, |leaf| {
            let light = &self.triangles[leaf as usize];
            if !light.is_portal() || self.scale(light) == 0.0 || !light.is_visible(x) {
                return;
            }
            let vertices = light.triangle().exactly_relative_to(x.position);
            let Some(hit) = geometry::intersect(vertices, direction) else { return };
            let [b1, b2] = hit.map(f64::from);
            let distance = (vertices[0] * (1.0 - b1 - b2) + vertices[1] * b1 + vertices[2] * b2).length();
            // Of equal ones the least leaf, so that it does not matter in which order they are visited.
            let nearer = first.is_none_or(|first| (distance, leaf) < (first.distance, first.leaf));
            if nearer {
                first = Some(Crossing { leaf, place: Lattice::from_barycentrics(hit), distance });
            }
        });
        first
    }
}

impl<const N: usize, const M: usize> PointSampler<'_, N, M> {
    /// Density per solid angle of a direction by the suns, unless it first crosses a portal in one leaf.
    pub(super) fn sun_density(&self, direction: Vec3, except: Option<u32>) -> f64 {
        self.sun_density_if(direction, |leaf| Some(leaf) != except)
    }

    /// Density per solid angle of a direction by the suns, if it first crosses a portal in this leaf.
    pub(super) fn sun_density_at(&self, direction: Vec3, leaf: u32) -> f64 {
        self.sun_density_if(direction, |first| first == leaf)
    }

    #[inline]
    fn sun_density_if(&self, direction: Vec3, counts: impl Fn(u32) -> bool) -> f64 {
        if self.techniques.is_trees() {
            return 0.0;
        }
        let Some((sun, pdf)) = self.lights.environment.sun_at(direction) else { return 0.0 };
        let chosen = self.techniques.sun(sun);
        if chosen == 0.0 {
            return 0.0;
        }
        let crossing = self.lights.crossing(&self.x, direction);
        if crossing.is_some_and(|crossing| counts(crossing.leaf)) { chosen * f64::from(pdf) } else { 0.0 }
    }
}

/// How far from a sun's centre, in radii, it is looked at: half of its area lies within.
const RIM: f32 = 0.7;
