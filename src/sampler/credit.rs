//! How much of what gets through a ray that crosses several portals counts for each of them.
//!
//! Where a small portal stands in front of a large one, all that gets through the large one comes through the small one
//! as well, whose samples find it more often. A sample on the large one then says nothing for choosing it: the
//! direction's density is the sum over both. What got through is therefore shared among the portals of the ray by the
//! power heuristic (Veach and Guibas 1995), with the densities that each triangle has for the direction once it is
//! chosen. Portals that cover each other exactly share alike, and nothing is lost: the shares of a ray add up to 1.

use super::point::PointSampler;
use crate::light::{LightLeaf, LightPoint};
use crate::record::Hit;

impl PointSampler<'_> {
    /// Returns the share in `[0, 1]` of what gets through along the direction of a point of a portal that counts for
    /// the triangle that the point is on.
    #[inline(never)]
    pub(super) fn credit(&self, leaf: LightLeaf, hit: &Hit, direction: glam::Vec3) -> f32 {
        let lights = &self.at.scene.lights;
        if lights.is_crossed_once {
            return 1.0;
        }
        let mixture = self.mixture();
        let mixed = mixture.one();
        let density = |point: LightPoint| {
            let view = &self.at.view(point.leaf);
            view.as_ref().map_or(0.0, |view| mixed.density_within(&self.at, point, view))
        };
        let own = density(LightPoint::new(leaf, hit.barycentrics));
        let mut sum = 1.0;
        self.at.scene.cross(
            self.at.x.position,
            direction,
            |other| other != leaf && lights.is_portal(other),
            |point| {
                // Divided first: squares of densities overflow.
                let ratio = density(point) / own;
                sum += ratio * ratio;
            },
        );
        // A density of zero makes NaN or an infinite sum.
        if own > 0.0 { (1.0 / sum) as f32 } else { 1.0 }
    }
}
