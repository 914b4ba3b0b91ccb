//! Directions in proportion to radiance times a weight that varies slowly over the sphere, such as the area that all
//! portals together turn towards a direction.

use core::f32::consts::FRAC_PI_2;

use super::descend::step;
use super::pyramid::{children, level_start};
use super::rotation::{to_local, to_world};
use super::view::EnvironmentView;
use crate::math;
use crate::warp::Variate;
use crate::warp::equal_area::{SPHERE, sphere_to_square, square_to_sphere};
use glam::{Vec2, Vec3};

/// Base-2 logarithm of the number of regions a side. *Measured* by the bench `instructions`, for the cost
/// alone, when walks went level by level: a call cost the same with 3.
///
/// Larger: the weight is followed more closely, but a table takes four times the memory and time for each step.
/// Smaller: the weight varies more within a region.
const WEIGHTED_DEPTH: u32 = 4;

/// Number of regions of all levels. *Proved*: a sum of powers of four.
const WEIGHTED_REGIONS: usize = level_start(WEIGHTED_DEPTH + 1);
/// Factor on the angle from a region's center to its corners, for edges that bend outwards. *Measured* by the unit test
/// `regions_stay_in_their_circles`, over all regions of all levels.
///
/// Larger: weights of darker regions are kept. Smaller: a region could be taken for dark that is not.
const REGION_REACH: f32 = 1.1;

/// A distribution of directions: the environment's, with another weight for each of up to 256 regions of equal solid
/// angle.
#[derive(Clone)]
pub(crate) struct DirectionDistribution {
    /// Mean radiance times weight of the regions, then sums over four regions of a finer level, laid out as the
    /// levels of a pyramid.
    sums: [f32; WEIGHTED_REGIONS],
    depth: u32,
}

crate::buffers::debug_counts!(DirectionDistribution, distribution => {
    depth: distribution.depth,
    sums: distribution.sums.len(),
});

impl DirectionDistribution {
    /// Weighs every region that is not black by a function of its central world direction and the angle around
    /// it that it reaches to. The weight is zero only where it is for the whole region.
    pub(crate) fn new(environment: &EnvironmentView<'_>, weight: impl Fn(Vec3, f32) -> f32) -> Self {
        let depth = WEIGHTED_DEPTH.min(environment.header.depth);
        let mut sums = [0.0; WEIGHTED_REGIONS];
        for region in 0..1_u32 << (2 * depth) {
            let (x, y) = (region & ((1 << depth) - 1), region >> depth);
            let mean = environment.mean_at(depth, x, y);
            if mean > 0.0 {
                let (center, reach) = circle(depth, x, y);
                let weight = weight(to_world(&environment.header.rotation, center), reach);
                // Positive whatever underflows.
                sums[level_start(depth) + region as usize] =
                    if weight > 0.0 { (mean * weight).max(f32::MIN_POSITIVE) } else { 0.0 };
            }
        }
        for level in (0..depth).rev() {
            for region in 0..1_u32 << (2 * level) {
                let (x, y) = (region & ((1 << level) - 1), region >> level);
                sums[level_start(level) + region as usize] = children(&sums, level, x, y).iter().sum();
            }
        }
        Self { sums, depth }
    }

    /// Integral of radiance times weight over the sphere.
    pub(crate) fn total(&self) -> f32 {
        self.sums[0] * SPHERE / (1_u32 << (2 * self.depth)) as f32
    }

    /// Draws a unit world direction. Returns it with its density per solid angle; `None` if all is black.
    pub(crate) fn sample(&self, environment: &EnvironmentView<'_>, mut u: [Variate; 2]) -> Option<(Vec3, f64)> {
        if self.sums[0] <= 0.0 {
            return None;
        }
        let mut region = [0, 0];
        for depth in 0..self.depth {
            region = step(children(&self.sums, depth, region[0], region[1]), region, &mut u);
        }
        let direction = environment.sample_below(self.depth, region, &mut u).direction;
        Some((direction, self.pdf(environment, direction)))
    }

    /// Density per solid angle with which [`Self::sample`] draws a unit world direction.
    pub(crate) fn pdf(&self, environment: &EnvironmentView<'_>, direction: Vec3) -> f64 {
        let radiance = f64::from(environment.radiance(direction));
        if radiance == 0.0 || self.sums[0] <= 0.0 {
            return 0.0;
        }
        let scale = (1_u32 << self.depth) as f32;
        let last = (1 << self.depth) - 1;
        let point = sphere_to_square(to_local(&environment.header.rotation, direction)) * scale;
        let (x, y) = ((point.x as u32).min(last), (point.y as u32).min(last));
        let region = f64::from(self.sums[level_start(self.depth) + ((y << self.depth) | x) as usize]);
        let mean = f64::from(environment.mean_at(self.depth, x, y));
        let solid_angle = f64::from(SPHERE) / f64::from(1_u32 << (2 * self.depth));
        region / f64::from(self.sums[0]) * radiance / (mean * solid_angle)
    }
}

/// Center of a region in the environment's frame, and the angle around it that the region reaches to.
fn circle(depth: u32, x: u32, y: u32) -> (Vec3, f32) {
    let side = 1.0 / (1_u32 << depth) as f32;
    let at = |i: f32, j: f32| square_to_sphere(Vec2::new((x as f32 + i) * side, (y as f32 + j) * side));
    let center = at(0.5, 0.5);
    let chord = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]
        .into_iter()
        .fold(0.0, |chord: f32, (i, j)| chord.max(at(i, j).distance(center)));
    (center, (REGION_REACH * 2.0 * math::asin((0.5 * chord).min(1.0))).min(FRAC_PI_2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::env::Environment;
    use crate::record::Filter;
    use crate::testing::Pcg32;
    use crate::warp::seed;
    use alloc::vec::Vec;

    fn environment(size: usize) -> Environment {
        let mut pcg = Pcg32::new(3, size as u64);
        let texels: Vec<f32> = (0..size * size).map(|_| pcg.next_f32().powi(8) * 50.0).collect();
        Environment::from_equal_area(size, &texels, Filter::Nearest).expect("valid texels")
    }

    #[test]
    fn samples_have_their_density_and_it_integrates_to_one() {
        for size in [2, 4, 8, 64] {
            let environment = environment(size);
            let view = environment.as_view();
            let directions = DirectionDistribution::new(&view, |direction, _| direction.z.max(0.0) + 0.01);
            let mut pcg = Pcg32::new(4, 4);
            for _ in 0..1000 {
                let u = [pcg.next_f32(), pcg.next_f32()];
                let salt = seed(&u);
                let variates = [Variate::new(u[0], salt), Variate::new(u[1], salt ^ 1)];
                let (direction, pdf) = directions.sample(&view, variates).expect("not black");
                assert_eq!(pdf, directions.pdf(&view, direction));
                assert!(pdf > 0.0);
            }
            let side = 1.0 / view.size() as f32;
            let centers = (0..view.size() * view.size()).map(|i| (i % view.size(), i / view.size()));
            let pdfs = centers.map(|(x, y)| {
                let point = Vec2::new((x as f32 + 0.5) * side, (y as f32 + 0.5) * side);
                directions.pdf(&view, square_to_sphere(point))
            });
            let integral = pdfs.sum::<f64>() * f64::from(view.texel_solid_angle());
            assert!((integral - 1.0).abs() < 1e-5, "{integral} with {size} texels a side");
        }
    }

    #[test]
    fn regions_stay_in_their_circles() {
        for depth in 1..=WEIGHTED_DEPTH {
            for region in 0..1_u32 << (2 * depth) {
                let (x, y) = (region & ((1 << depth) - 1), region >> depth);
                let (center, reach) = circle(depth, x, y);
                let side = 1.0 / (1_u32 << depth) as f32;
                for i in 0..=16_u16 {
                    for j in 0..=16_u16 {
                        let place = Vec2::new(f32::from(i), f32::from(j)) / 16.0;
                        let direction = square_to_sphere((Vec2::new(x as f32, y as f32) + place) * side);
                        assert!(reach >= FRAC_PI_2 || direction.distance(center) <= 2.0 * (0.5 * reach).sin());
                    }
                }
            }
        }
    }
}
