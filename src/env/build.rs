//! The owned environment and the ways to build one.

use super::descend::EnvironmentSample;
use super::features::{BrightFeatures, FeatureLimits, finest};
use super::image::EnvironmentImage;
use super::pyramid::Pyramid;
use super::resample::{UNITS_PER_ROW, resample};
use super::source::EnvironmentSource;
use super::view::{Environment, EnvironmentHeader, EnvironmentView};
use super::{MAX_PYRAMID_DEPTH, MAX_RADIANCE, MIN_RADIANCE, rotation};
use crate::error::{Error, ErrorKind};
use crate::progress::{Progress, Report};
use crate::record::Filter;
use alloc::vec;
use alloc::vec::Vec;
use core::ops::ControlFlow;
use glam::{Mat3, Vec3};

impl Environment {
    /// Rotation of a latitude-longitude image for a world with `y` up: its point `(u, v)` becomes
    /// `(sin φ sin θ, cos θ, -cos φ sin θ)`, as in Mitsuba.
    pub const Y_UP_LAT_LONG: Mat3 = Mat3::from_cols(Vec3::NEG_Z, Vec3::NEG_X, Vec3::Y);

    /// Builds an environment with the same radiance from everywhere. It costs no memory and no lookups.
    ///
    /// # Errors
    ///
    /// If the radiance is NaN, negative or above 1e30.
    pub fn constant(radiance: f32) -> Result<Self, Error> {
        if !(0.0..=MAX_RADIANCE).contains(&radiance) {
            let expected = "finite, not negative and at most 1e30";
            return Err(Error(ErrorKind::Scalar { what: "environment: the radiance", value: radiance, expected }));
        }
        Ok(Self::uniform(if radiance > 0.0 { radiance.max(MIN_RADIANCE) } else { 0.0 }, 0))
    }

    /// Builds an environment from an image.
    ///
    /// The image is resampled by solid angle to an equal-area one, so that no flux is lost
    /// ([`EnvironmentImage::resolution`]). Negative texels are clamped to zero and counted; positive ones below 1e-30
    /// are raised to that.
    ///
    /// # Errors
    ///
    /// If a side is zero or above 65536, if the number of texels is not the product of the sides, if a texel is NaN,
    /// infinite or above 1e30, or if the resolution is zero or above 8192.
    pub fn new(image: &EnvironmentImage<'_>) -> Result<Self, Error> {
        Self::with_limits(image, &FeatureLimits::default(), None)
    }

    /// Builds as [`new`](Self::new) does, for hosts that show progress or that need to be able to cancel: a sky of
    /// 16384 x 8192 texels takes half a minute of one thread.
    ///
    /// `report` is called with the share of the work that is done, in `[0, 1]`, and last with 1;
    /// [`ControlFlow::Break`] cancels the build. With the feature `rayon` the calls come from the threads that build,
    /// several at once and not always in order.
    ///
    /// # Errors
    ///
    /// Those of [`new`](Self::new), and one of which [`Error::is_cancelled`] is true if `report` has canceled the
    /// build.
    pub fn new_with(
        image: &EnvironmentImage<'_>,
        report: impl Fn(f32) -> ControlFlow<()> + Sync,
    ) -> Result<Self, Error> {
        Self::with_limits(image, &FeatureLimits::default(), Some(&report))
    }

    /// [`new`](Self::new) of a latitude-longitude image of `width * height` texels, the top row first.
    ///
    /// # Errors
    ///
    /// Those of [`new`](Self::new).
    pub fn from_lat_long(width: usize, height: usize, luminance: &[f32], filter: Filter) -> Result<Self, Error> {
        Self::new(&EnvironmentImage::lat_long(width, height, luminance).filter(filter))
    }

    /// [`new`](Self::new) of an equal-area image of `size * size` texels, the row at `y = 0` first.
    ///
    /// # Errors
    ///
    /// Those of [`new`](Self::new).
    pub fn from_equal_area(size: usize, luminance: &[f32], filter: Filter) -> Result<Self, Error> {
        Self::new(&EnvironmentImage::equal_area(size, luminance).filter(filter))
    }

    /// Builds an environment with other limits for its bright features.
    pub(super) fn with_limits(
        image: &EnvironmentImage<'_>,
        limits: &FeatureLimits,
        report: Option<Report<'_>>,
    ) -> Result<Self, Error> {
        let resolution = image.resolution.map(checked_depth).transpose()?;
        let source = EnvironmentSource::new(image)?;
        let depth = resolution.unwrap_or_else(|| depth_for(image.width as u64 * image.height as u64));
        let progress = Progress::new(report, ((UNITS_PER_ROW + 1) << depth.max(1)) as f64);
        let environment = match source.constant() {
            Some(radiance) => Self::uniform(radiance, source.clamped),
            None => Self::resampled(&source, depth, limits, &progress)?,
        };
        progress.finish()?;
        Ok(environment)
    }

    fn resampled(
        source: &EnvironmentSource<'_>,
        depth: u32,
        limits: &FeatureLimits,
        progress: &Progress<'_>,
    ) -> Result<Self, Error> {
        // One texel is cut by all seams of the map; take the mean of four instead.
        let image = resample(source, depth.max(1), progress)?;
        let features = if depth == 0 {
            BrightFeatures::none()
        } else {
            BrightFeatures::find(depth, finest(depth, &image), limits)
        };
        let pyramid = Pyramid::new(depth.max(1), image, &features.rest, progress)?;
        let [low, high] = pyramid.ranges[0];
        if depth == 0 || low == high {
            return Ok(Self::uniform(pyramid.means[0], source.clamped));
        }
        Ok(Self::from_pyramid(depth, pyramid, features, source.clamped))
    }

    fn uniform(radiance: f32, clamped_texels: u32) -> Self {
        let pyramid = Pyramid { means: vec![radiance], ranges: Vec::new(), filtered: vec![radiance] };
        Self::from_pyramid(0, pyramid, BrightFeatures::none(), clamped_texels)
    }

    fn from_pyramid(depth: u32, pyramid: Pyramid, features: BrightFeatures, clamped_texels: u32) -> Self {
        let mean = pyramid.means[0];
        let max = finest(depth, &pyramid.means).iter().copied().fold(0.0, f32::max);
        let rotation = Mat3::IDENTITY.to_cols_array_2d();
        let header = EnvironmentHeader { rotation, depth, mean, max, clamped_texels, cap: features.cap };
        let Pyramid { means, ranges, filtered } = pyramid;
        let BrightFeatures { nodes: features, texels: feature_texels, .. } = features;
        Self { header, means, ranges, filtered, features, feature_texels }
    }

    /// Rotates the environment. `rotation` takes directions of the environment's frame to the world.
    ///
    /// # Errors
    ///
    /// As [`set_rotation`](Self::set_rotation).
    pub fn with_rotation(mut self, rotation: Mat3) -> Result<Self, Error> {
        self.set_rotation(rotation)?;
        Ok(self)
    }

    /// Rotates the environment, without rebuilding anything. `rotation` takes directions of the environment's
    /// frame to the world.
    ///
    /// # Errors
    ///
    /// If the matrix is not orthonormal with the determinant 1, within 1e-4. The environment is unchanged then.
    pub fn set_rotation(&mut self, rotation: Mat3) -> Result<(), Error> {
        self.header.rotation = rotation::checked(rotation)?;
        Ok(())
    }

    /// Returns the borrowed form, which does all the work.
    #[must_use]
    #[inline]
    pub fn as_view(&self) -> EnvironmentView<'_> {
        self.view()
    }

    /// Draws a direction: see [`EnvironmentView::sample`].
    #[must_use]
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> Option<EnvironmentSample> {
        self.as_view().sample(u)
    }

    /// Returns the density of a direction: see [`EnvironmentView::pdf`].
    #[must_use]
    #[inline]
    pub fn pdf(&self, direction: Vec3) -> f32 {
        self.as_view().pdf(direction)
    }

    /// Returns the radiance along a direction: see [`EnvironmentView::radiance`].
    #[must_use]
    #[inline]
    pub fn radiance(&self, direction: Vec3) -> f32 {
        self.as_view().radiance(direction)
    }

    /// Returns the mean radiance: see [`EnvironmentView::mean`].
    #[must_use]
    pub fn mean(&self) -> f32 {
        self.header.mean
    }

    /// Mean radiance over the sphere without the bright features.
    pub(crate) fn mean_without_features(&self) -> f32 {
        self.as_view().mean_without_features()
    }

    /// Returns the largest radiance: see [`EnvironmentView::max`].
    #[must_use]
    pub fn max(&self) -> f32 {
        self.header.max
    }

    /// Returns the edge of the image in texels: see [`EnvironmentView::size`].
    #[must_use]
    pub fn size(&self) -> u32 {
        self.as_view().size()
    }

    /// Returns whether every direction has the same radiance: see [`EnvironmentView::is_constant`].
    #[must_use]
    pub fn is_constant(&self) -> bool {
        self.as_view().is_constant()
    }

    /// Returns the solid angle of a texel: see [`EnvironmentView::texel_solid_angle`].
    #[must_use]
    pub fn texel_solid_angle(&self) -> f32 {
        self.as_view().texel_solid_angle()
    }

    /// Returns how many texels were clamped: see [`EnvironmentView::clamped_texels`].
    #[must_use]
    pub fn clamped_texels(&self) -> usize {
        self.as_view().clamped_texels()
    }

    /// Returns the rotation to the world: see [`EnvironmentView::rotation`].
    #[must_use]
    pub fn rotation(&self) -> Mat3 {
        self.as_view().rotation()
    }
}

/// Returns the depth of the smallest pyramid whose finest level has at least this many texels, at most
/// [`MAX_PYRAMID_DEPTH`].
fn depth_for(texels: u64) -> u32 {
    (0..MAX_PYRAMID_DEPTH).find(|depth| 1 << (2 * depth) >= texels).unwrap_or(MAX_PYRAMID_DEPTH)
}

/// Returns the depth of a pyramid with at least `size` texels a side.
fn checked_depth(size: usize) -> Result<u32, Error> {
    let limit = 1 << MAX_PYRAMID_DEPTH;
    if !(1..=limit).contains(&size) {
        let what = "environment: the requested resolution";
        return Err(Error(ErrorKind::ImageSize { what, width: size, height: size, limit }));
    }
    Ok(size.next_power_of_two().trailing_zeros())
}
