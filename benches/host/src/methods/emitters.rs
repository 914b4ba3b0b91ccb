//! A triangle by its power or by chance, and any point of it.

use glam::Vec3;

use super::alias::AliasTable;
use super::{Proposal, Target};
use crate::bsdf::Vertex;
use crate::random::Pcg32;
use crate::world::{EmitterPoint, EmitterTriangle, World};

/// Points along each side of a triangle by which the mean of its texture is found: more give a better mean, and nothing
/// else depends on it.
const MEAN_POINTS: u16 = 256;

/// How a triangle is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Choice {
    /// In proportion to its power.
    Power,
    /// Each as often as the others.
    Uniform,
}

/// All triangles that emit light.
#[derive(Clone, Debug)]
pub(super) struct EmitterTable {
    triangles: Vec<EmitterTriangle>,
    table: AliasTable,
    /// Density per area, of the points of each triangle.
    density: Vec<f32>,
}

impl EmitterTable {
    /// Builds the table.
    pub(super) fn new(world: &World, choice: Choice) -> Self {
        let weight = |emitter: &EmitterTriangle| match choice {
            Choice::Power => f64::from(emitter.area * mean_radiance(world, emitter)),
            Choice::Uniform => 1.0,
        };
        let weights: Vec<f64> = world.emitters.iter().map(weight).collect();
        let total: f64 = weights.iter().sum();
        let density = weights.iter().zip(&world.emitters).map(|(w, e)| (w / total) as f32 / e.area).collect();
        Self { triangles: world.emitters.clone(), table: AliasTable::new(&weights), density }
    }

    /// Draws a point. `None` if its front is not seen.
    #[inline]
    pub(super) fn sample(&self, vertex: &Vertex, random: &mut Pcg32) -> Option<Proposal> {
        let number = self.table.sample(random.uniform());
        let [a, b, c] = self.triangles[number].corners;
        let [u, v] = random.uniform2();
        let root = u.sqrt();
        let barycentrics = [root * (1.0 - v), root * v];
        let position = a + barycentrics[0] * (b - a) + barycentrics[1] * (c - a);
        let direction = (position - vertex.position).normalize_or_zero();
        let point = EmitterPoint { triangle: number as u32, barycentrics, position };
        let pdf = self.pdf(vertex, &point, direction);
        (pdf > 0.0).then_some(Proposal { direction, target: Target::Emitter(point), pdf })
    }

    /// Returns the density per solid angle of a point. Zero if its front is not seen.
    #[inline]
    pub(super) fn pdf(&self, vertex: &Vertex, point: &EmitterPoint, direction: Vec3) -> f32 {
        let number = point.triangle as usize;
        let cosine = -self.triangles[number].normal.dot(direction);
        if cosine <= 0.0 {
            return 0.0;
        }
        self.density[number] * point.position.distance_squared(vertex.position) / cosine
    }
}

/// Returns the mean radiance of a triangle.
fn mean_radiance(world: &World, emitter: &EmitterTriangle) -> f32 {
    if matches!(world.scene.emitters[emitter.mesh as usize].radiance, crate::scene::Radiance::Constant(_)) {
        return world.radiance(emitter, [0.0; 2]);
    }
    let at = |i: u16| (f64::from(i) + 0.5) / f64::from(MEAN_POINTS);
    let mut sum = 0.0;
    for (u, v) in (0..MEAN_POINTS).flat_map(|i| (0..MEAN_POINTS).map(move |j| (at(i), at(j)))) {
        let root = u.sqrt();
        sum += f64::from(world.radiance(emitter, [(root * (1.0 - v)) as f32, (root * v) as f32]));
    }
    (sum / f64::from(MEAN_POINTS).powi(2)) as f32
}
