//! Averages of a texture over all cells of a triangle, down to its texels.

use super::cell::Cell;
use crate::scenes::Scene;

/// Places along a cell's edge that its average is taken of, less one.
const STEPS: u8 = 3;

/// Share of its neighborhood's maximum that a cell keeps in which nothing was found.
const LEAST: f64 = 1e-3;

/// Level by level; the root first.
pub(super) struct Averages(Vec<Vec<f32>>);

impl Averages {
    /// No texture.
    pub(super) fn constant(weight: f32) -> Self {
        Self(vec![vec![weight]])
    }

    /// The scene's image on a light.
    pub(super) fn new(scene: &Scene, light: usize) -> Self {
        let size = scene.image.as_ref().map_or(1, |image| image.size);
        let [a, b, c] = scene.lights[light].uvs;
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a)) / core::f64::consts::SQRT_2;
        let depth = (longest * size as f64).log2().ceil().max(0.0) as u32;
        let mut leaves = Vec::with_capacity(1 << (2 * depth));
        add_leaves(scene, light, &Cell::root(scene.lights[light].vertices.map(|v| v.as_vec3())), depth, &mut leaves);
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

    /// The average over a cell; below a leaf, the leaf's.
    pub(super) fn at(&self, cell: &Cell) -> f32 {
        let depth = (cell.depth as usize).min(self.0.len() - 1);
        self.0[depth][cell.index >> (2 * (cell.depth as usize - depth))]
    }

    pub(super) fn bytes(&self) -> usize {
        self.0.iter().map(|level| size_of_val(&level[..])).sum()
    }
}

fn add_leaves(scene: &Scene, light: usize, cell: &Cell, depth: u32, leaves: &mut Vec<f32>) {
    if cell.depth < depth {
        return cell.children().iter().for_each(|child| add_leaves(scene, light, child, depth, leaves));
    }
    let steps = i32::from(STEPS);
    let at = |i: i32, j: i32| scene.weight(light, cell.place([i, j].map(|k| f64::from(k) / f64::from(steps))));
    let (mut sum, mut count) = (0.0, 0.0);
    for i in 0..=steps {
        for j in 0..=steps - i {
            sum += at(i, j);
            count += 1.0;
        }
    }
    if sum == 0.0 {
        // What lies between the places must not be lost.
        let around = (-1..=steps + 2).flat_map(|i| (-1..=steps + 1 - i).map(move |j| (i, j)));
        sum = around.map(|(i, j)| at(i, j)).fold(0.0, f64::max) * LEAST;
    }
    leaves.push((sum / count) as f32);
}
