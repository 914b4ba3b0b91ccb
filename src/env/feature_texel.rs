//! A block of texels of a bright feature: where it lies among the directions, and how far the map bends it.

use bytemuck::{Pod, Zeroable};
use glam::Vec2;

use crate::warp::equal_area::{SPHERE, square_to_sphere};

/// Slack of a texel's margin for rounding, in radians. *Proved*: covers the errors of the map (2.5e-7), of the
/// rotation and of a plane's normal (2e-7 each).
///
/// Larger: more directions that miss the opening. Smaller: a visible direction could be lost.
const TEXEL_ROUNDING: f32 = 1e-6;

/// Places along each side of a texel at which the departure from the parallelogram is measured. *Measured* with
/// [`BETWEEN_PLACES`] by the unit test below, against 65 places.
///
/// More: a slower build. Fewer: the departure between the places is less certain.
const DEPARTURE_PLACES: u32 = 9;

/// Factor on the measured departure, for what lies between the places. *Measured* by the unit test
/// below, against 65 places.
///
/// Larger: more directions that miss the opening. Smaller: a visible direction could be lost.
const BETWEEN_PLACES: f32 = 1.25;

/// A square block of texels of a bright feature, often of a single one.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct FeatureTexel {
    /// Morton code of the block in its level of the image: interleaved bits of the column and of the row.
    pub(crate) code: u32,
    /// Base-2 logarithm of the number of such blocks along a side of the image.
    pub(crate) level: u32,
    /// Mean radiance above the cap.
    pub(crate) excess: f32,
    /// Radiance at which the feature's texels are capped in the rest of the image.
    pub(crate) cap: f32,
    /// Bound on the distance between a direction in the block and the parallelogram's.
    pub(crate) margin: f32,
    /// Half of the parallelogram's longer diagonal, plus the margin.
    pub(crate) radius: f32,
    /// Direction of the center, in the environment's frame.
    pub(crate) center: [f32; 3],
    /// Sides of the parallelogram.
    pub(crate) sides: [[f32; 3]; 2],
}

const _: () = assert!(size_of::<FeatureTexel>() == 60);

impl FeatureTexel {
    /// Builds a block of the level with `2^level` blocks a side.
    pub(super) fn new(level: u32, code: u32, excess: f32, cap: f32) -> Self {
        let side = 1.0 / (1_u32 << level) as f32;
        let [x, y] = from_morton(code);
        let corner = Vec2::new(x as f32, y as f32);
        let direction = |x: f32, y: f32| square_to_sphere((corner + Vec2::new(x, y)) * side);
        let center = direction(0.5, 0.5);
        let sides = [direction(1.0, 0.5) - direction(0.0, 0.5), direction(0.5, 1.0) - direction(0.5, 0.0)];
        let mut departure = 0.0f32;
        for i in 0..DEPARTURE_PLACES * DEPARTURE_PLACES {
            let [x, y] = [i % DEPARTURE_PLACES, i / DEPARTURE_PLACES].map(|i| i as f32 / (DEPARTURE_PLACES - 1) as f32);
            let flat = center + sides[0] * (x - 0.5) + sides[1] * (y - 0.5);
            departure = departure.max((direction(x, y) - flat).length());
        }
        let margin = BETWEEN_PLACES * departure + TEXEL_ROUNDING;
        let [s, t] = sides;
        let radius = 0.5 * (s + t).length().max((s - t).length()) + margin;
        let (center, sides) = (center.to_array(), sides.map(|side| side.to_array()));
        Self { code, level, excess, cap, margin, radius, center, sides }
    }

    /// First Morton code of the block in a finer level, and the number of codes.
    #[inline]
    pub(crate) fn codes(&self, depth: u32) -> (u32, u32) {
        let shift = 2 * (depth - self.level);
        (self.code << shift, 1 << shift)
    }

    /// Excess over the cap, integrated over solid angle.
    #[inline]
    pub(crate) fn power(&self) -> f32 {
        self.excess * self.solid_angle()
    }

    /// Solid angle of the block.
    #[inline]
    pub(crate) fn solid_angle(&self) -> f32 {
        // A power of two, by its exponent.
        SPHERE * f32::from_bits((127 - 2 * self.level) << 23)
    }
}

/// Returns the Morton code of a texel: bit `i` of the column becomes bit `2 i`, that of the row bit `2 i + 1`.
#[inline]
pub(super) fn to_morton(x: u32, y: u32) -> u32 {
    spread(x) | (spread(y) << 1)
}

/// Returns column and row of a Morton code.
#[inline]
pub(super) fn from_morton(code: u32) -> [u32; 2] {
    [gather(code), gather(code >> 1)]
}

#[inline]
fn spread(mut x: u32) -> u32 {
    x = (x | (x << 8)) & 0x00ff_00ff;
    x = (x | (x << 4)) & 0x0f0f_0f0f;
    x = (x | (x << 2)) & 0x3333_3333;
    (x | (x << 1)) & 0x5555_5555
}

#[inline]
fn gather(mut x: u32) -> u32 {
    x &= 0x5555_5555;
    x = (x | (x >> 1)) & 0x3333_3333;
    x = (x | (x >> 2)) & 0x0f0f_0f0f;
    x = (x | (x >> 4)) & 0x00ff_00ff;
    (x | (x >> 8)) & 0x0000_ffff
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Pcg32;
    use glam::Vec3;

    #[test]
    fn morton_codes_keep_all_bits() {
        for (x, y) in [(0, 0), (8191, 0), (0, 8191), (8191, 4096), (1234, 4321)] {
            assert_eq!(from_morton(to_morton(x, y)), [x, y]);
        }
        assert_eq!((to_morton(2, 0), to_morton(0, 1), to_morton(3, 3)), (4, 2, 15));
    }

    #[test]
    fn margins_hold_what_lies_between_the_places() {
        let mut pcg = Pcg32::new(1, 55);
        let mut worst = 0.0f32;
        for level in 2..=11 {
            let size = 1_u32 << level;
            let middle = size / 2;
            let special =
                [(0, 0), (middle, middle), (middle - 1, 0), (middle, 1), (size - 1, middle), (middle / 2, middle / 2)];
            let random = (0..40).map(|_| (pcg.next_u32() % size, pcg.next_u32() % size));
            for (x, y) in special.into_iter().chain(random) {
                let texel = FeatureTexel::new(level, to_morton(x, y), 1.0, 1.0);
                let [s, t] = texel.sides.map(Vec3::from_array);
                for i in 0..65 * 65_u32 {
                    let place = Vec2::new((i % 65) as f32, (i / 65) as f32) / 64.0;
                    let direction = square_to_sphere((Vec2::new(x as f32, y as f32) + place) / size as f32);
                    let flat = Vec3::from_array(texel.center) + s * (place.x - 0.5) + t * (place.y - 0.5);
                    worst = worst.max(((direction - flat).length() - TEXEL_ROUNDING) / (texel.margin - TEXEL_ROUNDING));
                }
            }
        }
        assert!((0.99 / BETWEEN_PLACES..1.0).contains(&worst), "{worst}");
    }
}
