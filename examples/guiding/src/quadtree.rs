//! A density of directions that follows weighted samples: a quadtree over the unit square, as in Müller, Gross and
//! Novák (2017).

use core::f32::consts::{PI, TAU};

use fanlight::glam::{Vec2, Vec3, vec2};

/// A cell with more than this share of the weight is divided. *Chosen.*
const SHARE: f32 = 0.02;
/// The part of a cell's share that its quarters get alike, so that a few lucky samples do not starve the rest.
/// *Chosen.*
const EVEN: f32 = 0.1;
/// Cells are divided so often at most: down to a sixteenth of a degree. *Chosen.*
const DEPTH: u32 = 10;

/// A direction as a point of the unit square, which keeps areas, and its weight.
pub(crate) type Weighted = (Vec2, f32);

/// The point of the unit square that stands for a direction.
pub(crate) fn to_square(direction: Vec3) -> Vec2 {
    let turn = direction.y.atan2(direction.x) / TAU;
    vec2(turn.rem_euclid(1.0), 0.5 + 0.5 * direction.z).min(Vec2::splat(1.0 - f32::EPSILON))
}

fn to_direction(point: Vec2) -> Vec3 {
    let height = 2.0 * point.y - 1.0;
    (Vec2::from_angle(TAU * point.x) * (1.0 - height * height).max(0.0).sqrt()).extend(height)
}

/// Shares of four quarters of a cell, and the nodes of those that are divided.
struct Node {
    shares: [f32; 4],
    children: [Option<usize>; 4],
}

/// A density of directions.
pub(crate) struct Quadtree(Vec<Node>);

impl Quadtree {
    /// Fits the density to samples. `None` if they have no weight.
    pub(crate) fn fit(samples: Vec<Weighted>) -> Option<Self> {
        let total: f32 = samples.iter().map(|sample| sample.1).sum();
        let mut tree = Self(Vec::new());
        (total > 0.0).then(|| {
            tree.add(samples, SHARE * total, DEPTH);
            tree
        })
    }

    /// Divides a cell. Returns the number of its node.
    fn add(&mut self, samples: Vec<Weighted>, least: f32, depth: u32) -> usize {
        let mut quarters = [(); 4].map(|()| Vec::new());
        for (point, weight) in samples {
            let (quarter, point) = step(point);
            quarters[quarter].push((point, weight));
        }
        let weights = quarters.each_ref().map(|quarter| quarter.iter().map(|sample| sample.1).sum::<f32>());
        let total: f32 = weights.iter().sum();
        let index = self.0.len();
        self.0.push(Node {
            shares: weights.map(|weight| 0.25 * EVEN + (1.0 - EVEN) * weight / total),
            children: [None; 4],
        });
        for (i, quarter) in quarters.into_iter().enumerate() {
            if weights[i] > least && depth > 1 {
                self.0[index].children[i] = Some(self.add(quarter, least, depth - 1));
            }
        }
        index
    }

    /// Draws a direction.
    pub(crate) fn sample(&self, [mut choice, u, v]: [f32; 3]) -> Vec3 {
        let (mut low, mut size, mut index) = (Vec2::ZERO, 1.0, Some(0));
        while let Some(node) = index.map(|index| &self.0[index]) {
            let mut quarter = 0;
            while quarter < 3 && choice >= node.shares[quarter] {
                choice -= node.shares[quarter];
                quarter += 1;
            }
            choice = (choice / node.shares[quarter]).min(1.0 - f32::EPSILON);
            size *= 0.5;
            low += size * vec2((quarter % 2) as f32, (quarter / 2) as f32);
            index = node.children[quarter];
        }
        to_direction(low + size * vec2(u, v))
    }

    /// Density per solid angle of a direction.
    pub(crate) fn pdf(&self, direction: Vec3) -> f32 {
        let (mut point, mut pdf, mut index) = (to_square(direction), 0.25 / PI, Some(0));
        while let Some(node) = index.map(|index| &self.0[index]) {
            let (quarter, rest) = step(point);
            pdf *= 4.0 * node.shares[quarter];
            (point, index) = (rest, node.children[quarter]);
        }
        pdf
    }
}

/// The quarter that holds a point, and the point within it.
fn step(point: Vec2) -> (usize, Vec2) {
    let is_upper = point.cmpge(Vec2::splat(0.5));
    let quarter = usize::from(is_upper.x) + 2 * usize::from(is_upper.y);
    (quarter, 2.0 * point - Vec2::select(is_upper, Vec2::ONE, Vec2::ZERO))
}
