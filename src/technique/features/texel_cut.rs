//! How much of one block of a bright feature's texels is visible through an opening.
//!
//! The equal-area map bends the edges of a block, in short a texel, only a little. Here it is a parallelogram of
//! directions, an opening is three planes through the viewer, and the visible part is a square cut by three lines,
//! whose area is exact. The texel's margin, which bounds the distance between the map and the parallelogram, makes the
//! cut square hold every visible direction.

use glam::Vec3;

use super::clipped_square::ClippedSquare;
use crate::env::FeatureTexel;

/// The part of a texel that is visible through an opening.
#[derive(Clone, Copy, Debug)]
pub(super) enum TexelCut {
    /// Nothing of the texel.
    Nothing,
    /// All of the texel.
    All,
    /// A polygon in units of the texel, around its center, and the polygon's area.
    Part(ClippedSquare, f32),
}

impl TexelCut {
    /// Cuts a texel by the planes of an opening, in the environment's frame.
    #[inline]
    pub(super) fn new(texel: &FeatureTexel, planes: &[Vec3; 3]) -> Self {
        let center = Vec3::from_array(texel.center);
        let depths = planes.map(|plane| plane.dot(center));
        let [a, b, c] = depths;
        let least = a.min(b).min(c);
        // Most texels are decided by their distances from the planes.
        if least < -texel.radius {
            return Self::Nothing;
        }
        if least >= texel.radius {
            return Self::All;
        }
        Self::exact(texel, planes, depths)
    }

    /// Cuts a texel whose center has the given distances from the planes.
    fn exact(texel: &FeatureTexel, planes: &[Vec3; 3], depths: [f32; 3]) -> Self {
        let [s, t] = texel.sides.map(Vec3::from_array);
        let mut part = None;
        for (plane, depth) in planes.iter().zip(depths) {
            let line = [depth + texel.margin, plane.dot(s), plane.dot(t)];
            let reach = 0.5 * (line[1].abs() + line[2].abs());
            if line[0] < -reach {
                return Self::Nothing;
            }
            if line[0] < reach {
                part = Some(part.unwrap_or_else(ClippedSquare::whole).clip(line));
            }
        }
        match part.map(|polygon: ClippedSquare| (polygon, polygon.area())) {
            None => Self::All,
            Some((polygon, area)) if area > 0.0 => Self::Part(polygon, area),
            Some(_) => Self::Nothing,
        }
    }

    /// Visible share of the texel's area.
    pub(super) fn share(self) -> f32 {
        match self {
            Self::Nothing => 0.0,
            Self::All => 1.0,
            Self::Part(_, area) => area,
        }
    }
}
