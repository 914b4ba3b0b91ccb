//! The suns through an opening with three straight edges: how much is seen, and directions into that.

use glam::{DVec3, Vec2, Vec3};

use super::descend::inside;
use super::rotation::{to_local, to_world};
use super::suns::Sun;
use super::texel::{Cut, SunTexel};
use super::view::{EnvironmentView, texel_at};
use crate::warp::Variate;
use crate::warp::equal_area::{SPHERE, sphere_to_square, square_to_sphere};

/// Granted to the tests of a sun as a whole.
const ROUNDING: f32 = 2e-6;

/// The directions between three planes through the viewer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Opening {
    /// Unit normals that point inwards, in the environment's frame. Zero for an edge that passes through the viewer.
    pub(super) planes: [Vec3; 3],
}

/// How much of something is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cover {
    Nothing,
    Part,
    All,
}

impl EnvironmentView<'_> {
    /// The directions in which a triangle is seen whose vertices are given relative to the viewer.
    pub(crate) fn opening(&self, [a, b, c]: [DVec3; 3]) -> Opening {
        let planes = [b.cross(c), c.cross(a), a.cross(b)];
        let sign = 1f64.copysign(planes[0].dot(a));
        let inwards = |plane: DVec3| (sign * plane).normalize_or_zero().as_vec3();
        Opening { planes: planes.map(|plane| to_local(&self.header.rotation, inwards(plane))) }
    }

    /// How much of a sun is seen, at least and at most.
    #[inline]
    pub(crate) fn cover_of_sun(&self, sun: usize, opening: &Opening) -> Cover {
        let Sun { axis, sin_radius, .. } = self.suns[sun];
        let (axis, reach) = (Vec3::from_array(axis), sin_radius + ROUNDING);
        let depths = opening.planes.map(|plane| plane.dot(axis));
        if depths.iter().any(|&depth| depth < -reach) {
            Cover::Nothing
        } else if depths.iter().all(|&depth| depth >= reach) {
            Cover::All
        } else {
            Cover::Part
        }
    }

    /// Excess of a sun over the cap, integrated over the directions of an opening.
    pub(crate) fn sun_through(&self, sun: usize, opening: &Opening) -> f32 {
        match self.cover_of_sun(sun, opening) {
            Cover::Nothing => 0.0,
            Cover::All => self.suns[sun].power,
            Cover::Part => {
                let shares = self.texels_of(sun).iter().map(|texel| texel.excess * texel.cut(opening).share());
                self.solid_angle_of(sun) * shares.sum::<f32>()
            }
        }
    }

    /// Draws a world direction in what an opening shows of a sun, with a density in proportion to the excess over
    /// the cap. `through` is [`Self::sun_through`] of the same, above zero.
    ///
    /// The direction may miss the opening by a hair's breadth: a texel's margin.
    pub(crate) fn sample_sun_through(&self, sun: usize, opening: &Opening, through: f32, mut u: [Variate; 2]) -> Vec3 {
        if self.cover_of_sun(sun, opening) == Cover::All {
            return self.sample_sun(sun, u);
        }
        let per_share = self.solid_angle_of(sun) / through;
        let target = u[1].value();
        let (mut chosen, mut low, mut width, mut below) = (None, 0.0, 1.0, 0.0);
        for texel in self.texels_of(sun) {
            let cut = texel.cut(opening);
            let share = f64::from(texel.excess * cut.share() * per_share);
            if share > 0.0 {
                (chosen, low, width) = (Some((texel, cut)), below, share);
                below += share;
                if target < below {
                    break;
                }
            }
        }
        u[1].stretch(target - low, width, 1.0);
        match chosen {
            Some((texel, Cut::Part(polygon, _))) => self.direction_in(sun, texel, polygon.sample(u)),
            Some((texel, _)) => self.direction_in(sun, texel, u.map(|u| u.value_f32() - 0.5)),
            None => self.sample_sun(sun, u),
        }
    }

    /// Draws a world direction in a sun, with a density in proportion to its excess over the cap.
    pub(crate) fn sample_sun(&self, sun: usize, mut u: [Variate; 2]) -> Vec3 {
        let texels = self.texels_of(sun);
        let target = u[1].value_f32();
        let chosen = texels.partition_point(|texel| texel.sum <= target).min(texels.len() - 1);
        let below = if chosen == 0 { 0.0 } else { f64::from(texels[chosen - 1].sum) };
        let width = f64::from(texels[chosen].sum) - below;
        u[1].stretch(u[1].value() - below, width, 1.0);
        self.direction_in(sun, &texels[chosen], u.map(|u| u.value_f32() - 0.5))
    }

    /// World direction of a place in a texel, in units of its side around the centre.
    fn direction_in(&self, sun: usize, texel: &SunTexel, place: [f32; 2]) -> Vec3 {
        let level = self.suns[sun].level;
        let (x, y) = (texel.texel & ((1 << level) - 1), texel.texel >> level);
        let point = Vec2::new(inside(level, x, place[0] + 0.5), inside(level, y, place[1] + 0.5));
        to_world(&self.header.rotation, square_to_sphere(point))
    }

    /// Excess of a sun over the cap in a unit world direction.
    #[inline]
    pub(crate) fn sun_excess(&self, sun: usize, direction: Vec3) -> f32 {
        let Sun { axis, sin_radius, level, .. } = self.suns[sun];
        let (axis, reach) = (Vec3::from_array(axis), sin_radius + ROUNDING);
        let local = to_local(&self.header.rotation, direction);
        if local.dot(axis) < 0.0 || local.cross(axis).length_squared() > reach * reach {
            return 0.0;
        }
        let number = texel_at(level, sphere_to_square(local));
        let texels = self.texels_of(sun);
        texels.binary_search_by_key(&number, |texel| texel.texel).map_or(0.0, |found| texels[found].excess)
    }

    /// Axis of a sun in the world.
    pub(crate) fn sun_axis(&self, sun: usize) -> Vec3 {
        to_world(&self.header.rotation, Vec3::from_array(self.suns[sun].axis))
    }

    /// Solid angle of one texel of a sun.
    #[inline]
    fn solid_angle_of(&self, sun: usize) -> f32 {
        SPHERE / (1_u64 << (2 * self.suns[sun].level)) as f32
    }

    #[inline]
    fn texels_of(&self, sun: usize) -> &[SunTexel] {
        let [start, end] = self.suns[sun].range;
        &self.sun_texels[start as usize..end as usize]
    }
}
