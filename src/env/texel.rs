//! One texel of a sun, and how much of it is seen through an opening.
//!
//! The equal-area map bends a texel's edges only a little. Here a texel is a parallelogram in the space of directions,
//! an opening three planes through the viewer, and what is seen a square cut by three lines, whose area is exact. A
//! margin that bounds how far the map departs from the parallelogram makes the cut square hold all that is seen.

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

use super::clipped_square::ClippedSquare;
use super::opening::Opening;
use crate::warp::equal_area::square_to_sphere;

/// Covers the rounding of the map, of the rotation and of the planes.
const ROUNDING: f32 = 1e-6;
/// Places along each side of a texel at which the departure from the parallelogram is measured.
const PLACES: u32 = 9;
/// Granted to what lies between those places.
const BETWEEN: f32 = 1.25;

/// A texel of a sun, or a square block of texels.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct SunTexel {
    /// Its number in the sun's level of the image, row by row.
    pub texel: u32,
    /// Share of the sun's power in this texel and those before it; 1 for the last one.
    pub sum: f32,
    /// Mean radiance above the cap.
    pub excess: f32,
    /// Bound on the distance between a direction in the texel and the parallelogram's.
    pub margin: f32,
    /// Half of the parallelogram's longer diagonal, and the margin.
    pub radius: f32,
    /// Direction of the centre, in the environment's frame.
    pub center: [f32; 3],
    /// The two sides of the parallelogram.
    pub sides: [[f32; 3]; 2],
}

/// The part of a texel that is seen through an opening.
#[derive(Clone, Copy, Debug)]
pub(super) enum Cut {
    Nothing,
    All,
    /// In units of the texel, around its centre, and its area.
    Part(ClippedSquare, f32),
}

impl Cut {
    /// Share of the texel's area.
    pub(super) fn share(self) -> f32 {
        match self {
            Self::Nothing => 0.0,
            Self::All => 1.0,
            Self::Part(_, area) => area,
        }
    }
}

impl SunTexel {
    /// A texel of the level with `2^level` texels a side. Its sum is left open.
    pub(super) fn new(level: u32, texel: u32, excess: f32) -> Self {
        let side = 1.0 / (1_u32 << level) as f32;
        let corner = Vec2::new((texel & ((1 << level) - 1)) as f32, (texel >> level) as f32);
        let direction = |x: f32, y: f32| square_to_sphere((corner + Vec2::new(x, y)) * side);
        let center = direction(0.5, 0.5);
        let sides = [direction(1.0, 0.5) - direction(0.0, 0.5), direction(0.5, 1.0) - direction(0.5, 0.0)];
        let mut departure = 0.0f32;
        for i in 0..PLACES * PLACES {
            let [x, y] = [i % PLACES, i / PLACES].map(|i| i as f32 / (PLACES - 1) as f32);
            let flat = center + sides[0] * (x - 0.5) + sides[1] * (y - 0.5);
            departure = departure.max((direction(x, y) - flat).length());
        }
        let margin = BETWEEN * departure + ROUNDING;
        let [s, t] = sides;
        let radius = 0.5 * (s + t).length().max((s - t).length()) + margin;
        let (center, sides) = (center.to_array(), sides.map(|side| side.to_array()));
        Self { texel, sum: 0.0, excess, margin, radius, center, sides }
    }

    /// What is seen of the texel.
    #[inline]
    pub(super) fn cut(&self, opening: &Opening) -> Cut {
        let center = Vec3::from_array(self.center);
        let depths = opening.planes.map(|plane| plane.dot(center));
        let [a, b, c] = depths;
        let least = a.min(b).min(c);
        // Most texels are decided by their distances from the planes.
        if least < -self.radius {
            return Cut::Nothing;
        }
        if least >= self.radius {
            return Cut::All;
        }
        self.cut_exactly(opening, depths)
    }

    fn cut_exactly(&self, opening: &Opening, depths: [f32; 3]) -> Cut {
        let [s, t] = self.sides.map(Vec3::from_array);
        let mut part = None;
        for (plane, depth) in opening.planes.into_iter().zip(depths) {
            let line = [depth + self.margin, plane.dot(s), plane.dot(t)];
            let reach = 0.5 * (line[1].abs() + line[2].abs());
            if line[0] < -reach {
                return Cut::Nothing;
            }
            if line[0] < reach {
                part = Some(part.unwrap_or_else(ClippedSquare::whole).clip(line));
            }
        }
        match part.map(|polygon: ClippedSquare| (polygon, polygon.area())) {
            None => Cut::All,
            Some((polygon, area)) if area > 0.0 => Cut::Part(polygon, area),
            Some(_) => Cut::Nothing,
        }
    }
}
