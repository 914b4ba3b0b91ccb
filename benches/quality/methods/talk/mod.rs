//! The published method for portals (Ogaki 2020, "Generalized Light Portals"), kept as it was presented, whatever
//! becomes of the crate: a wide tree over triangles by the conservative term of Conty Estevez and Kulla, below it a
//! tree of arity 4 over the barycentric domain by the extremely conservative term, and in both the environment by a
//! single lookup of a 3x3-filtered level. The descent ends where a triangle covers a single pixel of the environment,
//! or one that is constant.

mod averages;
mod cell;
mod pyramid;

use ::fanlight::{Receiver, ShadingPoint};
use glam::{DVec3, Vec3};

use super::arvo::{barycentrics, crosses};
use super::binary_tree::BinaryTree;
use super::light_bounds::LightBounds;
use super::power::scene_bounds;
use super::triangle::{area_density, front, uniform};
use super::wide_tree::{WideTree, pick};
use super::{Drawn, Method};
use crate::scenes::{Scene, Weight};
use averages::Averages;
use cell::{Cell, follow};
use pyramid::Pyramid;

/// Deepest subdivision: where a point touches a portal, no cell is ever as small as a pixel.
const MAX_DEPTH: u32 = 24;

/// Share of the choices in a triangle that the texture alone decides on. It is no part of the talk, and in its favour:
/// a bright pixel that the lookup misses costs a hundredth of the variance that it does without.
const DEFENSIVE: f32 = 0.02;

pub(crate) struct Talk<'a> {
    scene: &'a Scene,
    pyramid: Pyramid,
    tree: WideTree,
    /// Averages of the texture on each triangle.
    averages: Vec<Averages>,
    triangles: Vec<[Vec3; 3]>,
    /// Whether a ray can cross several portals.
    layered: bool,
}

impl<'a> Talk<'a> {
    pub(crate) fn new(scene: &'a Scene) -> Self {
        let sky = scene.sky.as_ref().expect("the workload has openings");
        let averages = |light: usize| match scene.lights[light].weight {
            Weight::Image => Averages::new(scene, light),
            Weight::Constant(weight) => Averages::constant(weight),
        };
        Self {
            scene,
            pyramid: Pyramid::new(&sky.texels),
            tree: WideTree::new(&BinaryTree::new(&scene_bounds(scene))),
            averages: (0..scene.lights.len()).map(averages).collect(),
            triangles: scene.lights.iter().map(|light| light.vertices.map(|v| v.as_vec3())).collect(),
            layered: scene.walls.len() > 1,
        }
    }

    /// A cluster's conservative term times the average radiance in the solid angle of its box.
    fn importance(&self, bounds: &LightBounds, x: &ShadingPoint) -> f32 {
        match bounds.one_sided_importance(x) {
            0.0 => 0.0,
            importance => {
                let offset = bounds.center() - x.position;
                let (distance2, radius2) = (offset.length_squared(), 0.25 * (bounds.max - bounds.min).length_squared());
                let cosine = (1.0 - radius2 / distance2).max(0.0).sqrt();
                let solid_angle = if distance2 > radius2 { core::f32::consts::TAU * (1.0 - cosine) } else { 12.6 };
                importance * self.pyramid.look_up(offset / distance2.sqrt(), solid_angle).value
            }
        }
    }

    fn relative(&self, light: usize, x: &ShadingPoint) -> [Vec3; 3] {
        self.triangles[light].map(|v| v - x.position)
    }

    /// From a triangle to a cell of it; `choose` gets the weights of four children. Returns the cell and its
    /// probability.
    fn descend(
        &self,
        light: usize,
        x: &ShadingPoint,
        mut choose: impl FnMut(&[f32; 4], f32) -> usize,
    ) -> Option<(Cell, f64)> {
        let Receiver::Surface(normal) = x.receiver else { panic!("all workloads have opaque surfaces") };
        let averages = &self.averages[light];
        let mut cell = Cell::root(self.relative(light, x));
        let mut pmf = 1.0;
        let mut is_done = averages.is_leaf(&cell) && self.worth(&cell, normal).1;
        while !is_done && cell.depth < MAX_DEPTH {
            let children = cell.children();
            let worths = children.map(|child| self.worth(&child, normal));
            let textures = children.map(|child| averages.at(&child));
            let weights = defended(core::array::from_fn(|i| textures[i] * worths[i].0), textures);
            let total: f32 = weights.iter().sum();
            if !(total > 0.0) {
                return None;
            }
            let chosen = choose(&weights, total);
            pmf *= f64::from(weights[chosen] / total);
            cell = children[chosen];
            is_done = averages.is_leaf(&cell) && worths[chosen].1;
        }
        Some((cell, pmf))
    }

    /// The extremely conservative term times the average radiance, and whether there is nothing left to tell apart.
    fn worth(&self, cell: &Cell, normal: Vec3) -> (f32, bool) {
        let footprint = cell.footprint();
        let seen = self.pyramid.look_up(footprint.direction, footprint.solid_angle);
        let cosines = (1.0 + normal.dot(footprint.direction)) * (1.0 + footprint.cosine);
        let is_done = seen.is_constant || footprint.solid_angle <= pyramid::TEXEL_SOLID_ANGLE;
        (cosines.max(f32::MIN_POSITIVE) * seen.value / footprint.distance2, is_done)
    }

    /// Density per solid angle of a point on a triangle that is chosen.
    fn density(&self, light: usize, x: &ShadingPoint, place: [f64; 2], direction: DVec3) -> f64 {
        let mut local = [1.0 - place[0] - place[1], place[0], place[1]];
        let Some((cell, pmf)) = self.descend(light, x, |_, _| follow(&mut local)) else { return 0.0 };
        pmf * area_density(&self.relative(light, x).map(Vec3::as_dvec3), direction) * cell.parts()
    }

    /// Sum of the densities of all triangles along a direction.
    fn direction_density(&self, x: &ShadingPoint, direction: DVec3) -> f64 {
        let density = |light: usize| {
            let vertices = self.relative(light, x).map(Vec3::as_dvec3);
            if !front(&vertices) || !crosses(&vertices, direction) {
                return 0.0;
            }
            let pmf = self.tree.pmf(light, |bounds| self.importance(bounds, x));
            pmf * self.density(light, x, barycentrics(&vertices, direction), direction)
        };
        (0..self.triangles.len()).map(density).sum()
    }
}

impl Method for Talk<'_> {
    fn sample(&self, x: &ShadingPoint, u: [f32; 3]) -> Option<Drawn> {
        let (light, light_pmf) = self.tree.sample(f64::from(u[0]), |bounds| self.importance(bounds, x))?;
        let vertices = self.relative(light, x).map(Vec3::as_dvec3);
        if !front(&vertices) {
            return None;
        }
        // Up to 24 choices between four: more bits than one of the numbers has.
        let mut rest = f64::from(u[1]) + f64::from(u[0]) * (1.0 / 16_777_216.0);
        let (cell, pmf) = self.descend(light, x, |weights, total| pick(weights, total, &mut rest))?;
        let place = cell.place(uniform([rest, f64::from(u[2])]));
        let [a, b, c] = vertices;
        let direction = (a + (b - a) * place[0] + (c - a) * place[1]).normalize();
        let pdf = if self.layered {
            self.direction_density(x, direction)
        } else {
            light_pmf * pmf * area_density(&vertices, direction) * cell.parts()
        };
        let barycentrics = place.map(|b| b as f32);
        (pdf > 0.0).then(|| Drawn { light, barycentrics, direction: direction.as_vec3(), pdf, radiance: None })
    }

    fn pdf(&self, x: &ShadingPoint, drawn: &Drawn) -> f64 {
        let direction = drawn.direction.as_dvec3();
        if self.layered {
            return self.direction_density(x, direction);
        }
        let pmf = self.tree.pmf(drawn.light, |bounds| self.importance(bounds, x));
        pmf * self.density(drawn.light, x, drawn.barycentrics.map(f64::from), direction)
    }

    fn pmfs(&self, x: &ShadingPoint, wanted: &dyn Fn(usize) -> bool) -> Option<Vec<f64>> {
        let pmf = |light: usize| self.tree.pmf(light, |bounds| self.importance(bounds, x));
        Some((0..self.scene.lights.len()).map(|light| if wanted(light) { pmf(light) } else { 0.0 }).collect())
    }

    fn bytes(&self) -> usize {
        let averages: usize = self.averages.iter().map(Averages::bytes).sum();
        averages + self.tree.bytes() + self.pyramid.bytes() + size_of_val(&self.triangles[..])
    }
}

/// Weights with a share of the texture's own among them.
fn defended(weights: [f32; 4], textures: [f32; 4]) -> [f32; 4] {
    let sum = |values: &[f32; 4]| values.iter().sum::<f32>();
    let defence = DEFENSIVE / (1.0 - DEFENSIVE) * sum(&weights) / sum(&textures).max(f32::MIN_POSITIVE);
    core::array::from_fn(|i| weights[i] + defence * textures[i])
}
