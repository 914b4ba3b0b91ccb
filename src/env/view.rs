//! The borrowed form of an environment: all lookups.

use super::feature_texel::FeatureTexel;
use super::feature_tree::FeatureNode;
use super::pyramid::level_start;
use super::rotation::to_local;
use crate::buffers::buffers;
use crate::warp::equal_area::{SPHERE, sphere_to_square};
use bytemuck::{Pod, Zeroable};
use glam::{Mat3, Vec2, Vec3};

/// The fixed part of an environment, plain data.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct EnvironmentHeader {
    /// Columns of the rotation from the environment's frame to the world. Orthonormal, determinant 1.
    pub(crate) rotation: [[f32; 3]; 3],
    /// Base-2 logarithm of the number of texels a side, `0..=13`. Zero: constant radiance.
    pub(crate) depth: u32,
    /// Mean radiance over the sphere. `0` or in `[1e-38, 1e30]`.
    pub(crate) mean: f32,
    /// Largest radiance of a texel. `0` or in `[1e-30, 1e30]`.
    pub(crate) max: f32,
    /// Number of negative texels of the input, all clamped to zero.
    pub(crate) clamped_texels: u32,
    /// Least radiance at which texels are capped anywhere in `ranges` and `filtered`: what is above is in the bright
    /// features, which say where they cap. Infinite without features.
    pub(crate) cap: f32,
}

const _: () = assert!(size_of::<EnvironmentHeader>() == 56);

buffers! {
    /// A non-negative radiance over all directions, seen from the scene.
    ///
    /// What is stored is one number a direction, the luminance of the environment. All lookups are those of
    /// [`EnvironmentView`].
    ///
    /// # Frames
    ///
    /// The environment's own frame has `z` up; `with_rotation` places it in the world. A latitude-longitude image is
    /// seen from inside: its point `(u, v)`, with `v = 0` at the top, is the direction
    /// `(cos φ sin θ, -sin φ sin θ, cos θ)`, where `θ = π v` and `φ = 2π u`. An equal-area image has pbrt-v4's
    /// orientation: its center is `+z`, its corners are `-z`, and its axes run along `x` and `y`.
    pub Environment,
    /// An environment whose data is borrowed: from an [`Environment`], or from bytes that were loaded or mapped.
    ///
    /// Everything that is looked up or sampled is defined here. Directions point away from the viewer; all
    /// densities are per solid angle.
    EnvironmentView
    plain {
        /// The fixed part.
        header: EnvironmentHeader,
    }
    buffers {
        /// Means of all levels, the coarsest (one texel) first, rows from the square's `y = 0`.
        means: f32 = b"EMEA" version 1,
        /// Minimum and maximum of all levels of the capped image but the finest, laid out like `means`.
        ranges: [f32; 2] = b"ERAN" version 1,
        /// 3x3 box-filtered means of all levels of the capped image, laid out like `means`.
        filtered: f32 = b"EFIL" version 1,
        /// Tree over the texels above the cap.
        features: FeatureNode = b"EFEA" version 2,
        /// Texels of all features, in blocks.
        feature_texels: FeatureTexel = b"ETEX" version 2,
    }
}

impl EnvironmentView<'_> {
    /// Mean radiance over the sphere without the bright features.
    #[inline]
    pub(crate) fn mean_without_features(&self) -> f32 {
        self.filtered[0]
    }

    /// Returns the mean radiance over the sphere.
    #[must_use]
    #[inline]
    pub fn mean(&self) -> f32 {
        self.header.mean
    }

    /// Returns the largest radiance of a texel.
    #[must_use]
    #[inline]
    pub fn max(&self) -> f32 {
        self.header.max
    }

    /// Returns whether every direction has the same radiance.
    #[must_use]
    #[inline]
    pub fn is_constant(&self) -> bool {
        self.header.depth == 0
    }

    /// Returns the texels a side of the equal-area image, a power of two: one if the radiance is constant.
    #[must_use]
    #[inline]
    pub fn size(&self) -> u32 {
        1 << self.header.depth
    }

    /// Returns the solid angle of one texel: 4π over the number of texels, all of the sphere if the radiance is
    /// constant.
    #[must_use]
    #[inline]
    pub fn texel_solid_angle(&self) -> f32 {
        SPHERE / (1_u64 << (2 * self.header.depth)) as f32
    }

    /// Returns how many texels of the input were negative and were clamped to zero.
    #[must_use]
    pub fn clamped_texels(&self) -> usize {
        self.header.clamped_texels as usize
    }

    /// Returns the rotation from the environment's frame to the world.
    #[must_use]
    #[inline]
    pub fn rotation(&self) -> Mat3 {
        Mat3::from_cols_array_2d(&self.header.rotation)
    }

    /// Returns the radiance along a unit world direction: the value of the texel that it falls into.
    #[must_use]
    #[inline]
    pub fn radiance(&self, direction: Vec3) -> f32 {
        if self.is_constant() {
            return self.header.mean;
        }
        self.means[level_start(self.header.depth) + self.texel(direction) as usize]
    }

    /// Number of the texel of the finest level that a unit world direction falls into.
    #[inline]
    fn texel(&self, direction: Vec3) -> u32 {
        texel_at(self.header.depth, sphere_to_square(to_local(&self.header.rotation, direction)))
    }

    /// 3x3 filtered mean of a texel of the level with `2^depth` texels a side, without the bright features.
    #[inline]
    pub(super) fn filtered_at(&self, depth: u32, x: u32, y: u32) -> f32 {
        self.filtered[level_start(depth) + ((y << depth) | x) as usize]
    }

    /// Mean of a texel of the level with `2^depth` texels a side.
    #[inline]
    pub(super) fn mean_at(&self, depth: u32, x: u32, y: u32) -> f32 {
        self.means[level_start(depth) + ((y << depth) | x) as usize]
    }

    /// Minimum and maximum below a texel of the level with `2^depth` texels a side.
    #[inline]
    pub(super) fn range_at(&self, depth: u32, x: u32, y: u32) -> [f32; 2] {
        if depth == self.header.depth {
            [self.rest_of(x, y, self.mean_at(depth, x, y)); 2]
        } else {
            self.ranges[level_start(depth) + ((y << depth) | x) as usize]
        }
    }
}

/// Number of the texel that holds a point of the square, in the level with `2^depth` texels a side.
#[inline(always)]
pub(super) fn texel_at(depth: u32, point: Vec2) -> u32 {
    // The product is exact, and the cast truncates; the square's far edges belong to the last texel.
    let (scale, last) = ((1_u32 << depth) as f32, (1 << depth) - 1);
    let (x, y) = (((point.x * scale) as u32).min(last), ((point.y * scale) as u32).min(last));
    (y << depth) | x
}
