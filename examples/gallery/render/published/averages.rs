//! Averages of the radiance over the cells of a triangle.

use glam::Vec2;

use super::super::material::Material;
use super::super::model::Model;
use super::super::sky::LUMINANCE;
use super::cell::Cell;

/// Places that a leaf is looked up at, along an edge.
const STEPS: u16 = 3;
/// What a leaf has at least of what is found around it.
const LEAST: f32 = 0.01;

/// The average over every cell of every level, the coarsest first. Leaves are about as large as texels.
pub(super) struct Averages(Vec<Vec<f32>>);

impl Averages {
    pub(super) fn new(model: &Model, material: &Material, [a, b, c]: [Vec2; 3]) -> Self {
        let size = material
            .emission_map
            .map_or(Vec2::ONE, |map| Vec2::new(model.bitmaps[map].width as f32, model.bitmaps[map].height as f32));
        let edge = |p: Vec2, q: Vec2| ((q - p) * size).length();
        let longest = edge(a, b).max(edge(b, c)).max(edge(c, a)) / core::f32::consts::SQRT_2;
        let depth = longest.log2().ceil().clamp(0.0, 10.0) as u32;
        let radiance = |[s, t]: [f64; 2]| {
            let uv = a + s as f32 * (b - a) + t as f32 * (c - a);
            LUMINANCE.dot(material.emission_at(&model.bitmaps, uv))
        };
        let mut leaves = Vec::with_capacity(1 << (2 * depth));
        add_leaves(&radiance, &Cell::root([glam::Vec3::ZERO; 3]), depth, &mut leaves);
        let mut levels = vec![leaves];
        for _ in 0..depth {
            let below = &levels[levels.len() - 1];
            levels.push(below.chunks_exact(4).map(|four| 0.25 * four.iter().sum::<f32>()).collect());
        }
        levels.reverse();
        Self(levels)
    }

    pub(super) fn is_leaf(&self, cell: &Cell) -> bool {
        cell.depth as usize >= self.0.len() - 1
    }

    pub(super) fn at(&self, cell: &Cell) -> f32 {
        self.0[cell.depth as usize][cell.index]
    }
}

fn add_leaves(radiance: &impl Fn([f64; 2]) -> f32, cell: &Cell, depth: u32, leaves: &mut Vec<f32>) {
    if cell.depth < depth {
        return cell.children().iter().for_each(|child| add_leaves(radiance, child, depth, leaves));
    }
    let steps = i32::from(STEPS);
    let at = |i: i32, j: i32| radiance(cell.place([i, j].map(|k| f64::from(k) / f64::from(steps))));
    let inside: Vec<f32> =
        (0..=steps).flat_map(|i| (0..=steps - i).map(move |j| (i, j))).map(|(i, j)| at(i, j)).collect();
    let mean = inside.iter().sum::<f32>() / inside.len() as f32;
    // What lies between the places must not be lost.
    let around = || (-1..=steps + 2).flat_map(|i| (-1..=steps + 1 - i).map(move |j| (i, j)));
    leaves.push(if mean > 0.0 { mean } else { around().map(|(i, j)| at(i, j)).fold(0.0, f32::max) * LEAST });
}
