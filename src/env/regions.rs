//! The environment as 64 regions of equal solid angle, each summed up in a few numbers: how much it sends, from where,
//! and how far that is spread.
//!
//! The regions are the texels of one coarse level of the pyramid. A region is weighed as a cone around the direction in
//! which its light is centered: a sun in a region is found where it stands, not in the middle of the region.

use alloc::boxed::Box;

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

use super::MAX_RADIANCE;
use super::rotation::to_local;
use super::view::{EnvironmentView, texel_at};
use crate::error::Error;
use crate::math;
use crate::warp::equal_area::{SPHERE, sphere_to_square, square_to_sphere};
use crate::warp::{Variate, pick_wide};

/// Base-2 logarithm of the number of regions a side. *Format*: the arrays of [`RegionMoments`] have this length.
///
/// Larger: weights that follow the receiver's cosine more closely, each step of four times the cost. Smaller: more
/// samples below the horizon.
pub(crate) const REGION_DEPTH: u32 = 3;

/// Number of regions a side. *Format*, as [`REGION_DEPTH`].
const REGIONS_A_SIDE: usize = 1 << REGION_DEPTH;

/// Number of regions. *Format*, as [`REGION_DEPTH`].
pub(crate) const REGIONS: usize = REGIONS_A_SIDE * REGIONS_A_SIDE;

/// Least and largest depth of the level whose texels are summed up. Chosen, not swept.
///
/// Larger: building takes longer, up to 65536 texels. Smaller: a sun is centered less exactly.
const SUMMED_DEPTHS: (u32, u32) = (6, 8);

/// Angle from the center of a texel to its corners, in sides of the square. *Measured* by the unit test
/// `texels_stay_in_their_cones`, over all levels that are asked, and rounded up by 3 %.
///
/// Larger: more of what is below the horizon keeps a weight. Smaller: light could be taken for dark.
const TEXEL_REACH: f32 = 4.6;

/// Factor on sines of cones, for normals that are not quite of unit length. *Proved*: these are within 1e-3, and
/// rounding is far below.
///
/// Larger: more regions keep a weight below the horizon. Smaller: light at the horizon could be lost.
const REACH_SLACK: f32 = 1.005;

/// Share of the light of a region, apart from bright features, that the region keeps as a weight wherever it is not
/// certainly below the horizon. Chosen, not swept.
///
/// Larger: more samples in regions that the horizon has all but taken. Smaller: more noise from what is left of them.
const LEAST_REGION_SHARE: f32 = 0.01;

/// Least spread. Chosen, not swept: half a texel of the deepest level that is summed up.
///
/// Larger: a sun at the horizon is blurred. Smaller: at zero, a cone has no mean.
const LEAST_SPREAD: f32 = 0.005;

/// What each region sends, by arrays that a loop over all regions reads as vectors. Directions are those of the
/// environment's frame, so that a rotation changes nothing.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct RegionMoments {
    /// Components of the unit direction in which the light of a region is centered.
    pub(crate) axes: [[f32; REGIONS]; 3],
    /// Integral of the radiance over the region. Zero only if the region is black.
    pub(crate) flux: [f32; REGIONS],
    /// Sine of the radius of an evenly bright disk whose light is spread as that of the region.
    pub(crate) spread: [f32; REGIONS],
    /// Sine of the radius of a cone around the axis that holds everything lit in the region.
    pub(crate) reach: [f32; REGIONS],
    /// Weight that the region keeps wherever the cone is not below the horizon. Positive where the flux is.
    pub(crate) least: [f32; REGIONS],
}

crate::buffers::debug_counts!(RegionMoments, moments => {
    regions: moments.flux.len(),
    lit: moments.flux.iter().filter(|flux| **flux > 0.0).count(),
});

const _: () = assert!(size_of::<RegionMoments>() == 1792);

impl RegionMoments {
    /// Sums up the regions of an environment.
    pub(crate) fn new(environment: &EnvironmentView<'_>) -> Box<Self> {
        let mut moments = Box::new(Self::zeroed());
        for region in 0..REGIONS {
            moments.sum_up(environment, region);
        }
        moments
    }

    fn sum_up(&mut self, environment: &EnvironmentView<'_>, region: usize) {
        let depth = environment.header.depth.clamp(SUMMED_DEPTHS.0, SUMMED_DEPTHS.1);
        let below = depth - REGION_DEPTH;
        let (x, y) = (region as u32 % (1 << REGION_DEPTH), region as u32 >> REGION_DEPTH);
        let texels = || {
            let rows = (y << below)..((y + 1) << below);
            let columns = (x << below)..((x + 1) << below);
            rows.flat_map(move |j| columns.clone().map(move |i| [i, j]))
        };
        let mean = environment.mean_in(REGION_DEPTH, [x, y]);
        self.spread[region] = LEAST_SPREAD;
        if mean <= 0.0 {
            return;
        }
        // Relative to the mean, so that no square overflows.
        let mut sum = Vec3::ZERO.as_dvec3();
        let mut weight = 0.0;
        for texel in texels() {
            let radiance = f64::from(environment.mean_in(depth, texel)) / f64::from(mean);
            sum += radiance * center(depth, texel).as_dvec3();
            weight += radiance;
        }
        let length = sum.length() / weight;
        let axis = sum.normalize().as_vec3();
        let is_lit = |texel: &[u32; 2]| environment.mean_in(depth, *texel) > 0.0;
        let chord =
            texels().filter(is_lit).fold(0.0, |chord: f32, texel| chord.max(center(depth, texel).distance(axis)));
        let angle = 2.0 * math::asin((0.5 * chord).min(1.0)) + texel_reach(depth);
        let solid_angle = SPHERE / REGIONS as f32;
        for (component, value) in self.axes.iter_mut().zip(axis.to_array()) {
            component[region] = value;
        }
        self.flux[region] = mean * solid_angle;
        // A disk of the radius R has 1 - |mean direction|² = R² / 2.
        let spread = math::sqrt(2.0 * (1.0 - length * length).clamp(0.0, 0.5) as f32);
        self.spread[region] = spread.clamp(LEAST_SPREAD, 1.0);
        self.reach[region] = (REACH_SLACK * math::sin_cos(angle).0).min(1.0);
        // The filter reaches beyond the region, so that it is positive and not more than what the region may hold.
        let rest = environment.filtered_in(REGION_DEPTH, [x, y]).min(mean);
        self.least[region] = (LEAST_REGION_SHARE * rest * solid_angle).max(f32::MIN_POSITIVE);
    }

    /// Direction in which the light of a region is centered.
    #[inline]
    pub(crate) fn axis(&self, region: usize) -> Vec3 {
        Vec3::from_array(self.axes.map(|axis| axis[region]))
    }

    /// Checks that all sums and products of sampling are finite.
    ///
    /// # Errors
    ///
    /// If a number is out of its range.
    pub(crate) fn validate(&self) -> Result<(), Error> {
        let check = |what, values: &[f32; REGIONS], low: f32, high: f32| {
            let wrong = values.iter().position(|value| !(low..=high).contains(value));
            wrong.map_or(Ok(()), |i| Err(Error::bytes(what, i, values[i].to_bits(), high.to_bits())))
        };
        for axis in &self.axes {
            check("axis of a region", axis, -1.0, 1.0)?;
        }
        let flux = MAX_RADIANCE * SPHERE;
        check("flux of a region", &self.flux, 0.0, flux)?;
        check("least weight of a region", &self.least, 0.0, flux)?;
        check("spread of a region", &self.spread, 0.0, 1.0)?;
        check("reach of a region", &self.reach, 0.0, 1.0)
    }
}

impl EnvironmentView<'_> {
    /// Returns the mean of a texel of any level: of one below the finest, that of the texel that holds it.
    #[inline]
    pub(crate) fn mean_in(&self, depth: u32, [x, y]: [u32; 2]) -> f32 {
        let below = depth.saturating_sub(self.header.depth);
        self.mean_at(depth - below, x >> below, y >> below)
    }

    /// Returns the filtered mean of a texel as [`mean_in`](Self::mean_in) does.
    fn filtered_in(&self, depth: u32, [x, y]: [u32; 2]) -> f32 {
        let below = depth.saturating_sub(self.header.depth);
        self.filtered_at(depth - below, x >> below, y >> below)
    }

    /// Returns the texel of a level that a unit world direction falls into.
    #[inline]
    pub(crate) fn texel_in(&self, depth: u32, direction: Vec3) -> [u32; 2] {
        let texel = texel_at(depth, sphere_to_square(to_local(&self.header.rotation, direction)));
        [texel & ((1 << depth) - 1), texel >> depth]
    }
}

/// Number of a region by its texel.
#[inline]
pub(crate) fn region_at([x, y]: [u32; 2]) -> usize {
    ((y << REGION_DEPTH) | x) as usize
}

/// Returns a cone that holds a texel of a level: its axis, in the environment's frame, and the sine of its radius.
#[inline]
pub(crate) fn texel_cone(depth: u32, texel: [u32; 2]) -> (Vec3, f32) {
    // An angle is above its sine.
    (center(depth, texel), REACH_SLACK * texel_reach(depth))
}

/// Returns the solid angle of a texel of a level.
#[inline]
pub(crate) fn texel_solid_angle(depth: u32) -> f64 {
    f64::from(SPHERE) / f64::from(1_u32 << (2 * depth))
}

/// Bound of the angle from the center of a texel to any of its directions.
#[inline]
fn texel_reach(depth: u32) -> f32 {
    TEXEL_REACH / (1_u32 << depth) as f32
}

/// Direction of the center of a texel, in the environment's frame.
#[inline]
fn center(depth: u32, [x, y]: [u32; 2]) -> Vec3 {
    let side = 1.0 / (1_u32 << depth) as f32;
    square_to_sphere(Vec2::new((x as f32 + 0.5) * side, (y as f32 + 0.5) * side))
}

/// Weights of all regions, and their sums over each column of the square that they form.
pub(crate) struct RegionSums {
    weights: [f32; REGIONS],
    /// Sums of columns rather than rows: a sum of rows is a sum of vectors.
    columns: [f32; REGIONS_A_SIDE],
    total: f32,
}

crate::buffers::debug_counts!(RegionSums, sums => {
    regions: sums.weights.len(),
    total: sums.total,
});

impl RegionSums {
    /// No weight at all.
    pub(crate) const ZERO: Self = Self { weights: [0.0; REGIONS], columns: [0.0; REGIONS_A_SIDE], total: 0.0 };

    /// Weights of all regions, to be changed in place before they are [summed up](Self::sum_up): what is returned by
    /// value would be copied.
    #[inline(always)]
    pub(crate) fn weights_mut(&mut self) -> &mut [f32; REGIONS] {
        &mut self.weights
    }

    /// Sums up the weights.
    #[inline(always)]
    pub(crate) fn sum_up(&mut self) {
        let mut columns = [0.0; REGIONS_A_SIDE];
        for row in self.weights.chunks_exact(REGIONS_A_SIDE) {
            for i in 0..REGIONS_A_SIDE {
                columns[i] += row[i];
            }
        }
        let [a, b, c, d, e, f, g, h] = columns;
        self.total = ((a + e) + (b + f)) + ((c + g) + (d + h));
        self.columns = columns;
    }

    /// Sum over all regions.
    #[inline]
    pub(crate) fn total(&self) -> f32 {
        self.total
    }

    /// Weight of one region.
    #[inline]
    pub(crate) fn weight(&self, region: usize) -> f32 {
        self.weights[region]
    }

    /// Chooses a region in proportion to its weight: the first variate the column, the second one the region of the
    /// column.
    #[inline]
    pub(crate) fn pick(&self, u: &mut [Variate; 2]) -> [u32; 2] {
        let column = pick_wide(&self.columns, &mut u[0]).map_or(0, |(column, _)| column);
        let weights: [f32; REGIONS_A_SIDE] = core::array::from_fn(|row| self.weights[row * REGIONS_A_SIDE + column]);
        let row = pick_wide(&weights, &mut u[1]).map_or(0, |(row, _)| row);
        [column as u32, row as u32]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::env::Environment;
    use crate::record::Filter;
    use crate::testing::Pcg32;
    use alloc::vec::Vec;

    /// Corners of a texel and points along its edges, in units of its side.
    fn rim() -> impl Iterator<Item = Vec2> {
        (0..=8_u16).flat_map(|i| {
            let t = f32::from(i) / 8.0;
            [Vec2::new(t, 0.0), Vec2::new(t, 1.0), Vec2::new(0.0, t), Vec2::new(1.0, t)]
        })
    }

    #[test]
    fn texels_stay_in_their_cones() {
        for depth in REGION_DEPTH + 1..=8 {
            let side = 1.0 / (1_u32 << depth) as f32;
            let mut worst = 0.0_f32;
            for y in 0..1_u32 << depth {
                for x in 0..1_u32 << depth {
                    let center = center(depth, [x, y]);
                    for place in rim() {
                        let direction = square_to_sphere((Vec2::new(x as f32, y as f32) + place) * side);
                        worst = worst.max(2.0 * math::asin(0.5 * direction.distance(center)) / side);
                    }
                }
            }
            std::println!("depth {depth}: {worst} sides");
            assert!(worst <= TEXEL_REACH, "{worst} sides at depth {depth}");
        }
    }

    #[test]
    fn regions_are_summed_up() {
        let mut pcg = Pcg32::new(9, 1);
        let mut texels: Vec<f32> = (0..64 * 64).map(|_| pcg.next_f32()).collect();
        texels[20 * 64 + 11] = 1e6;
        (32..40).for_each(|y| texels[y * 64..y * 64 + 8].fill(0.0));
        let environment = Environment::from_equal_area(64, &texels, Filter::Nearest).expect("valid texels");
        let moments = RegionMoments::new(&environment.as_view());
        let flux: f64 = moments.flux.iter().map(|&flux| f64::from(flux)).sum();
        assert!((flux / (f64::from(environment.mean()) * f64::from(SPHERE)) - 1.0).abs() < 1e-5);
        moments.validate().expect("valid");
        // The region of the sun is centered at the sun, with next to no spread.
        let sun = region_at([11 / 8, 20 / 8]);
        assert!(moments.axis(sun).distance(center(6, [11, 20])) < 1e-3 && moments.spread[sun] < 0.05);
        // A black region is nothing.
        let black = region_at([0, 4]);
        assert_eq!([moments.flux[black], moments.least[black], moments.reach[black]], [0.0; 3]);
    }
}
