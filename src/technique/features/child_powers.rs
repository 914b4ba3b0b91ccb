//! How much of a bright feature each child of a cell shows: an estimate, by which children are chosen.
//!
//! In barycentric coordinates that count children along an edge, a block of texels is nearly a parallelogram, and every
//! child fills a strip of unit width along each of the three axes. So a block that is smaller than a child takes 24
//! overlaps of intervals instead of 64 polygons, and one that is larger one box for each child.

use glam::{DVec3, Vec3};

use super::opening::{Coverage, Opening};
use crate::blas::{ARITY, CHILD_CENTERS, CHILD_STRIPS, EDGE_CELLS};
use crate::env::{EnvironmentView, FeatureNode};
use crate::math::{at_least, at_most, sqrt};
use crate::simd::Kernel;

/// Children along one edge of a cell.
const EDGE: usize = EDGE_CELLS as usize;

/// Ratio of a node's to a child's extent up to which the node counts as one block. Affects the estimate alone.
/// *Chosen*.
///
/// Larger: the choice among children follows less of what varies in them. Smaller: a feature of many small blocks takes
/// more time.
const SMALL_NODE: f32 = 0.5;

/// Least half of a block's extent, in children. *Chosen*: coordinates along an edge are rounded by less than a tenth of
/// it where a child spans more than 1e-3 radians. Narrower children are smaller than any block.
///
/// Larger: blocks between two children count for both. Smaller: rounding decides which child has a small block.
const LEAST_EXTENT: f32 = 1e-3;

/// Least power that is estimated of a child through which the feature may be visible, relative to the largest one.
/// *Chosen*: what the estimate misses is a corner of a child or of a block.
///
/// Larger: more samples of children that show nothing. Smaller: what is missed is sampled seldom.
pub(super) const LEAST_POWER: f32 = 0.003;

/// The cell whose children are weighed, and the feature.
pub(super) struct ChildPowers<'a> {
    environment: &'a EnvironmentView<'a>,
    /// Node of the tree over the features.
    node: usize,
    /// Directions in which the cell is visible.
    opening: Opening,
    /// Vectors whose products with a direction are its coordinates along each axis, times that with `normal`.
    axes: [Vec3; 3],
    /// Normal of the cell, of a product of 1 with the direction to the cell's center.
    normal: Vec3,
}

impl<'a> ChildPowers<'a> {
    /// `corners` are the cell's, relative to the shading point.
    pub(super) fn new(environment: &'a EnvironmentView<'a>, node: usize, corners: [DVec3; 3]) -> Self {
        let [a, b, c] = corners;
        let axes = [b.cross(c), c.cross(a), a.cross(b)];
        let normal: DVec3 = axes.iter().sum();
        let center = corners.iter().sum::<DVec3>().normalize_or_zero();
        let scale = normal.dot(center).recip();
        let local = |v: DVec3| environment.local_direction(v.as_vec3());
        let axes = axes.map(|axis| local(axis * (scale * f64::from(EDGE_CELLS))));
        let opening = Opening::new(environment, corners);
        Self { environment, node, opening, axes, normal: local(normal * scale) }
    }

    /// Adds what each child shows of a parallelogram around a center with these sides. Of one that lies behind the
    /// plane of the cell, nothing is visible.
    #[inline(always)]
    fn add(&self, center: Vec3, sides: [Vec3; 2], power: f32, powers: &mut [f32; ARITY]) {
        let along = self.normal.dot(center);
        if along <= 0.0 {
            return;
        }
        let inverse = along.recip();
        let mut block = PowerBlock { places: [0.0; 3], sides: [[0.0; 2]; 3], power };
        for k in 0..3 {
            block.places[k] = self.axes[k].dot(center) * inverse;
            for (step, side) in block.sides[k].iter_mut().zip(sides) {
                *step = (self.axes[k].dot(side) - block.places[k] * self.normal.dot(side)) * inverse;
            }
        }
        block.add(powers);
    }

    /// A node as one block, if it is small compared with a child.
    #[inline(always)]
    fn as_block(&self, node: &FeatureNode) -> Option<(Vec3, [Vec3; 2])> {
        let axis = Vec3::from_array(node.axis);
        let per_radian = self.axes.iter().fold(0.0, |most: f32, axis| at_least(axis.length_squared(), most));
        let reach = node.reach();
        (reach * reach * per_radian <= SMALL_NODE * SMALL_NODE).then(|| {
            let side = 2.0 * node.sin_spread * axis.any_orthonormal_vector();
            (axis, [side, axis.cross(side)])
        })
    }
}

impl Kernel for ChildPowers<'_> {
    type Output = [f32; ARITY];

    #[inline(always)]
    fn run(self) -> [f32; ARITY] {
        let mut powers = [0.0; ARITY];
        let nodes = self.environment.feature_nodes();
        let (mut at, end) = (self.node, nodes[self.node].next as usize);
        while at < end {
            let node = &nodes[at];
            if self.opening.coverage(node) == Coverage::Nothing {
                at = node.next as usize;
            } else if let Some((center, sides)) = self.as_block(node) {
                self.add(center, sides, node.power, &mut powers);
                at = node.next as usize;
            } else {
                if self.environment.is_feature_leaf(at) {
                    for texel in self.environment.feature_texels(at).iter().filter(|texel| self.opening.meets(texel)) {
                        let (center, sides) = (Vec3::from_array(texel.center), texel.sides.map(Vec3::from_array));
                        self.add(center, sides, texel.power(), &mut powers);
                    }
                }
                at += 1;
            }
        }
        powers
    }
}

/// Area of a child where a strip has unit width.
const CHILD_AREA: f32 = 0.5;

/// A parallelogram of even brightness, by coordinates that count children along an edge.
struct PowerBlock {
    /// Center, along each axis.
    places: [f32; 3],
    /// Both sides, along each axis.
    sides: [[f32; 2]; 3],
    power: f32,
}

impl PowerBlock {
    /// Adds what each child shows.
    #[inline(always)]
    fn add(&self, powers: &mut [f32; ARITY]) {
        let [_, [s1, t1], [s2, t2]] = self.sides;
        let area = s1 * t2 - s2 * t1;
        if area.abs() > CHILD_AREA {
            self.gather(area, powers);
        } else {
            self.scatter(powers);
        }
    }

    /// Adds what each child shows of a block that is smaller: the product of what its three strips hold of the block's
    /// extents. It is above zero wherever the child shows anything.
    #[inline(always)]
    fn scatter(&self, powers: &mut [f32; ARITY]) {
        let mut shares = [[0.0; EDGE]; 3];
        for (axis, shares) in shares.iter_mut().enumerate() {
            let (place, [s, t]) = (self.places[axis], self.sides[axis]);
            let extent = at_least(0.5 * (s.abs() + t.abs()), LEAST_EXTENT);
            let (low, high, whole) = (place - extent, place + extent, at_most(2.0 * extent, 1.0).recip());
            for (strip, share) in shares.iter_mut().enumerate() {
                let start = strip as f32;
                *share = at_least(at_most(high, start + 1.0) - at_least(low, start), 0.0) * whole;
            }
        }
        for (power, [i, j, k]) in powers.iter_mut().zip(&CHILD_STRIPS) {
            *power += self.power * (shares[0][*i as usize] * shares[1][*j as usize] * shares[2][*k as usize]);
        }
    }

    /// Adds what each child shows of a block that is larger, of the given signed area: the child as a box along the
    /// block's sides that is spread as far as the child.
    #[inline(always)]
    fn gather(&self, area: f32, powers: &mut [f32; ARITY]) {
        let [_, place1, place2] = self.places;
        let [_, [s1, t1], [s2, t2]] = self.sides;
        let inverse = area.recip();
        // How the coordinates along both sides, from -1/2 to 1/2 within the block, grow along both axes.
        let (s_x, s_y, t_x, t_y) = (t2 * inverse, -t1 * inverse, -s2 * inverse, s1 * inverse);
        let (s_half, t_half) = (half_of_child(s_x, s_y), half_of_child(t_x, t_y));
        let (s_slope, t_slope) = (at_most(2.0 * s_half, 1.0).recip(), at_most(2.0 * t_half, 1.0).recip());
        let power = self.power * CHILD_AREA * inverse.abs();
        for (i, power_of_child) in powers.iter_mut().enumerate() {
            let (x, y) = (CHILD_CENTERS.b1[i] * EDGE as f32 - place1, CHILD_CENTERS.b2[i] * EDGE as f32 - place2);
            let s_share = (0.5 + s_half - (s_x * x + s_y * y).abs()) * s_slope;
            let t_share = (0.5 + t_half - (t_x * x + t_y * y).abs()) * t_slope;
            let share = at_most(at_least(s_share, 0.0), 1.0) * at_most(at_least(t_share, 0.0), 1.0);
            *power_of_child += power * share;
        }
    }
}

/// Half of the interval that is spread as far as a child whose edges are `x` and `y` long along a line. The variance of
/// a triangle is `(x² + y² - x y) / 18`, and that of an interval a third of the square of its half.
#[inline(always)]
fn half_of_child(x: f32, y: f32) -> f32 {
    at_least(sqrt((x * x + y * y - x * y) / 6.0), LEAST_EXTENT)
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec::Vec;

    /// What the children show of a parallelogram, by many points of it.
    fn by_points(block: &PowerBlock) -> Vec<f32> {
        const POINTS: usize = 400;
        let mut powers = alloc::vec![0.0; ARITY];
        for i in 0..POINTS * POINTS {
            let [s, t] = [i % POINTS, i / POINTS].map(|i| (i as f32 + 0.5) / POINTS as f32 - 0.5);
            let at = [0, 1, 2].map(|k| block.places[k] + s * block.sides[k][0] + t * block.sides[k][1]);
            if at.iter().all(|at| *at > 0.0) {
                let strips = at.map(|at| at as u8);
                let child = CHILD_STRIPS.iter().position(|child| *child == strips).expect("a child is there");
                powers[child] += block.power / (POINTS * POINTS) as f32;
            }
        }
        powers
    }

    fn block([place1, place2]: [f32; 2], [s1, s2]: [f32; 2], [t1, t2]: [f32; 2]) -> PowerBlock {
        let places = [EDGE as f32 - place1 - place2, place1, place2];
        PowerBlock { places, sides: [[-s1 - s2, -t1 - t2], [s1, t1], [s2, t2]], power: 3.0 }
    }

    /// The variance that choosing children by the estimate adds, relative to the squared mean, stays low for blocks of
    /// all sizes, though the estimate knows no shapes.
    #[test]
    fn children_are_chosen_by_about_what_they_show() {
        for size in [0.01, 0.1, 0.3, 0.6, 0.8, 1.0, 1.5, 3.0, 10.0] {
            for (place, turn) in [([2.3, 3.1], 0.0), ([4.0, 2.0], 0.4), ([0.2, 7.4], 1.1), ([1.0, 1.0], 2.0)] {
                let (sin, cos) = f32::sin_cos(turn);
                let block = block(place, [size * cos, size * sin], [-0.7 * size * sin, size * cos]);
                let mut estimate = [0.0; ARITY];
                block.add(&mut estimate);
                let least = LEAST_POWER * estimate.iter().fold(0.0, |most: f32, power| most.max(*power));
                let exact = by_points(&block);
                let sum: f32 = exact.iter().sum();
                let weights = estimate.map(|power| power.max(least));
                let second: f32 = exact.iter().zip(&weights).map(|(exact, weight)| exact * exact / weight).sum();
                let variance = second * weights.iter().sum::<f32>() / (sum * sum) - 1.0;
                assert!(variance < 0.5, "{size} {place:?} {turn}: {variance}");
            }
        }
    }
}
