//! The environment's suns through the portals: a second technique next to the trees, and the balance of both.
//!
//! For every shading point, the portals that a sun is seen through are found, and how much of it each shows. What the
//! suns send is then known, the trees know about what the rest sends, and a sample chooses between them in proportion.
//! A density is the mixture of both; the sun's part belongs to the point of the portal like that of the trees.

use core::f32::consts::PI;

use glam::Vec3;

use super::at::PointSampler;
use super::lights::LightSamplerView;
use super::techniques::{ANY, MAX_SEEN, Pairs, Seen, Techniques};
use crate::blas::{CellTarget, Lattice, LatticeCell};
use crate::env::Sun;
use crate::geometry;
use crate::light::{Lit, Sunlit};
use crate::math;
use crate::record::{Receiver, ShadingPoint};
use crate::warp::Variate;

impl<const N: usize> LightSamplerView<'_, N> {
    /// Whether suns may be seen through portals.
    #[inline]
    pub(super) fn has_suns(&self) -> bool {
        !self.environment.suns().is_empty() && self.has_portals()
    }

    /// What each technique is worth at a shading point, and the weights of the tree's first choice if that took them.
    pub(super) fn weigh(&self, x: &ShadingPoint) -> (Techniques, Option<[f32; N]>) {
        let mut pairs = Pairs::NONE;
        for sun in 0..self.environment.suns().len() {
            self.find(sun, x, &mut pairs);
        }
        let mut weights = None;
        let techniques = Techniques::balance(pairs, || {
            weights = self.tlas.first_weights(x, &self.scene(x));
            weights.map_or_else(|| self.irradiance_from_one(x), |weights| self.energy * weights.iter().sum::<f32>())
        });
        (techniques, weights)
    }

    /// Estimate of the irradiance from the only triangle. Zero only if there is none.
    fn irradiance_from_one(&self, x: &ShadingPoint) -> f32 {
        let [light] = self.triangles else { return 0.0 };
        let Some(lit) = self.lit(0, x) else { return 0.0 };
        PI * light.root.average * self.scale(light) * lit.weigh(LatticeCell::whole(), &mut lit.whole()).weight
    }

    /// Appends the portals that a sun is seen through.
    fn find(&self, sun: usize, x: &ShadingPoint, pairs: &mut Pairs) {
        let axis = self.environment.sun_axis(sun);
        let Sun { sin_radius, power, .. } = self.environment.suns()[sun];
        let cosine = mean_cosine(x.receiver, axis, sin_radius);
        if cosine == 0.0 {
            return;
        }
        let start = pairs.len();
        // Every sun after this one keeps a place.
        let end = MAX_SEEN - (self.environment.suns().len() - 1 - sun);
        let mut more = 0.0;
        let cone = [sin_radius, math::sqrt((1.0 - sin_radius * sin_radius).max(0.0))];
        self.tlas.meet(x.position, axis, cone, |leaf| {
            let light = &self.triangles[leaf as usize];
            let scale = self.scale(light);
            if !light.is_portal() || scale == 0.0 {
                return;
            }
            if more > 0.0 {
                more += 1.0;
                return;
            }
            let Some(lit) = self.lit(leaf, x) else { return };
            pairs.note(lit.is_close());
            self.sunlit(&lit, sun).visit(self.cells, light.root, &mut |part, through| {
                if pairs.len() < end {
                    pairs.push(leaf, sun, part, through * scale * cosine);
                } else {
                    more += 1.0;
                }
            });
        });
        if more > 0.0 {
            let all = pairs.irradiance(start) * (1.0 + more / (end - start) as f32);
            pairs.merge(start, sun, all.min(power * cosine));
        }
    }

    fn sunlit<'s>(&'s self, lit: &'s Lit<'s>, sun: usize) -> Sunlit<'s> {
        Sunlit { lit, environment: self.environment, sun }
    }

    /// Of the portals that a ray crosses the one with the least number, and where.
    fn least_crossed(&self, x: &ShadingPoint, direction: Vec3) -> Option<(u32, Lattice)> {
        let mut least: Option<(u32, Lattice)> = None;
        self.tlas.cross(x.position, direction, |leaf| {
            let light = &self.triangles[leaf as usize];
            if !light.is_portal()
                || self.scale(light) == 0.0
                || least.is_some_and(|(least, _)| least < leaf)
                || !light.is_visible(x)
            {
                return;
            }
            if let Some(hit) = geometry::intersect(light.triangle().exactly_relative_to(x.position), direction) {
                least = Some((leaf, Lattice::from_barycentrics(hit)));
            }
        });
        least
    }
}

impl<const N: usize> PointSampler<'_, N> {
    /// Draws a point on a portal towards a sun, by its place in the list.
    pub(super) fn sun_point(&self, index: usize, u: [Variate; 2]) -> Option<(u32, Lattice)> {
        let Seen { leaf, sun, part } = self.techniques.suns()?.seen(index);
        let (lights, sun) = (&self.lights, sun as usize);
        if leaf == ANY {
            return lights.least_crossed(&self.x, lights.environment.sample_sun(sun, u));
        }
        let lit = lights.lit(leaf, &self.x)?;
        Some((leaf, lights.sunlit(&lit, sun).sample(lights.cells, part, u)?))
    }

    /// Density per solid angle of a point of a portal by the suns.
    #[inline]
    pub(super) fn sun_pdf(&self, leaf: u32, place: Lattice, lit: &Lit<'_>) -> f64 {
        let Some(pairs) = self.techniques.suns() else { return 0.0 };
        self.techniques.per_weight * self.sun_pdf_of(pairs, leaf, place, lit)
    }

    /// The same, with weights for probabilities.
    fn sun_pdf_of(&self, pairs: &Pairs, leaf: u32, place: Lattice, lit: &Lit<'_>) -> f64 {
        let direction = lit.point(place).normalize_or_zero().as_vec3();
        let environment = &self.lights.environment;
        let mut pdf = 0.0;
        for sun in 0..environment.suns().len() {
            let excess = f64::from(environment.sun_excess(sun, direction));
            if excess == 0.0 {
                continue;
            }
            for (seen, weight) in pairs.of_sun(sun) {
                if seen.leaf == ANY || (seen.leaf == leaf && seen.part.domain.holds(place)) {
                    pdf += f64::from(weight) * excess * self.sun_pdf_per_excess(seen, leaf, place, lit, direction);
                }
            }
        }
        pdf
    }

    /// Density per solid angle of a point of a portal by one sun, over the sun's excess there.
    fn sun_pdf_per_excess(&self, seen: Seen, leaf: u32, place: Lattice, lit: &Lit<'_>, direction: Vec3) -> f64 {
        let (lights, sun) = (&self.lights, seen.sun as usize);
        if seen.leaf == ANY {
            let is_least = lights.least_crossed(&self.x, direction).is_some_and(|(least, _)| least == leaf);
            return if is_least { 1.0 / f64::from(lights.environment.suns()[sun].power) } else { 0.0 };
        }
        lights.sunlit(lit, sun).pdf_per_excess(lights.cells, seen.part, place)
    }
}

/// Mean weight of the directions of a cone. Zero only if all of them are below the horizon.
fn mean_cosine(receiver: Receiver, axis: Vec3, sin_radius: f32) -> f32 {
    match receiver {
        Receiver::Surface(normal) => {
            let (cosine, above) = (normal.dot(axis), normal.dot(axis) + sin_radius);
            if cosine >= sin_radius { cosine } else { above.max(0.0) * above.max(0.0) / (4.0 * sin_radius) }
        }
        Receiver::Transmissive(normal) => normal.dot(axis).abs().max(0.5 * sin_radius),
        Receiver::Volume => 1.0,
    }
}
