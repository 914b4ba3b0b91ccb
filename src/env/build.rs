//! The owned environment and the ways to build one.

use super::descend::EnvironmentSample;
use super::pyramid::Pyramid;
use super::resample::resample;
use super::source::{Edges, Source};
use super::suns::{Suns, finest};
use super::view::{EnvironmentHeader, EnvironmentView};
use super::{BRIGHTEST, DARKEST, MAX_DEPTH, rotation};
use crate::error::{Error, Kind};
use crate::record::Filter;
use alloc::vec;
use glam::{Mat3, Vec3};

/// A non-negative radiance over all directions, seen from the scene.
///
/// What is stored is one number a direction, the luminance of the environment. All look-ups are those of
/// [`EnvironmentView`].
///
/// # Frames
///
/// The environment's own frame has `z` up; `with_rotation` places it in the world. A latitude-longitude image is
/// seen from inside: its point `(u, v)`, with `v = 0` at the top, is the direction
/// `(cos φ sin θ, -sin φ sin θ, cos θ)`, where `θ = π v` and `φ = 2π u`. An equal-area image has pbrt-v4's
/// orientation: its centre is `+z`, its corners are `-z`, and its axes run along `x` and `y`.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    header: EnvironmentHeader,
    pyramid: Pyramid,
    suns: Suns,
}

impl Environment {
    /// Rotation of a latitude-longitude image for a world with `y` up: its point `(u, v)` becomes
    /// `(sin φ sin θ, cos θ, -cos φ sin θ)`, as in Mitsuba.
    pub const Y_UP_LAT_LONG: Mat3 = Mat3::from_cols(Vec3::NEG_Z, Vec3::NEG_X, Vec3::Y);

    /// The same radiance from everywhere. It costs no memory and no look-ups.
    ///
    /// # Errors
    ///
    /// If the radiance is NaN, negative or above 1e30.
    pub fn constant(radiance: f32) -> Result<Self, Error> {
        if !(0.0..=BRIGHTEST).contains(&radiance) {
            let expected = "finite, not negative and at most 1e30";
            return Err(Error(Kind::Scalar { what: "environment: the radiance", value: radiance, expected }));
        }
        Ok(Self::uniform(if radiance > 0.0 { radiance.max(DARKEST) } else { 0.0 }, 0))
    }

    /// From the luminance of a latitude-longitude image, `width * height` texels, the top row first.
    ///
    /// The image is resampled by solid angle, so that no flux is lost, to the smallest square power of two that
    /// has at least as many texels, and at most 8192² ([`from_lat_long_with_size`](Self::from_lat_long_with_size)
    /// chooses otherwise). `filter` is how the host reads the image. Negative texels are clamped to zero and
    /// counted; positive ones below 1e-30 are raised to that.
    ///
    /// # Errors
    ///
    /// If a side is zero or above 65536, if the number of texels is not the product of the sides, or if a texel
    /// is NaN, infinite or above 1e30.
    pub fn from_lat_long(width: usize, height: usize, luminance: &[f32], filter: Filter) -> Result<Self, Error> {
        let source = Source::new(width, height, luminance, Edges::LatLong, filter)?;
        Ok(Self::from_source(&source, Edges::LatLong, depth_for(width as u64 * height as u64)))
    }

    /// [`from_lat_long`](Self::from_lat_long) with a number of texels a side for the equal-area image, which is
    /// rounded up to a power of two.
    ///
    /// # Errors
    ///
    /// Those of [`from_lat_long`](Self::from_lat_long), and if `size` is zero or above 8192.
    pub fn from_lat_long_with_size(
        width: usize,
        height: usize,
        luminance: &[f32],
        filter: Filter,
        size: usize,
    ) -> Result<Self, Error> {
        let depth = checked_depth(size)?;
        let source = Source::new(width, height, luminance, Edges::LatLong, filter)?;
        Ok(Self::from_source(&source, Edges::LatLong, depth))
    }

    /// From the luminance of an equal-area image of `size * size` texels, the row at `y = 0` first.
    ///
    /// Sizes that are no power of two are resampled, by area, to the next one, and at most to 8192. `filter` and
    /// dark texels are treated as in [`from_lat_long`](Self::from_lat_long).
    ///
    /// # Errors
    ///
    /// If the size is zero or above 65536, if the number of texels is not its square, or if a texel is NaN,
    /// infinite or above 1e30.
    pub fn from_equal_area(size: usize, luminance: &[f32], filter: Filter) -> Result<Self, Error> {
        let source = Source::new(size, size, luminance, Edges::EqualArea, filter)?;
        Ok(Self::from_source(&source, Edges::EqualArea, depth_for(size as u64 * size as u64)))
    }

    /// [`from_equal_area`](Self::from_equal_area) with another number of texels a side than the image has. It is
    /// rounded up to a power of two.
    ///
    /// # Errors
    ///
    /// Those of [`from_equal_area`](Self::from_equal_area), and if `resolution` is zero or above 8192.
    pub fn from_equal_area_with_size(
        size: usize,
        luminance: &[f32],
        filter: Filter,
        resolution: usize,
    ) -> Result<Self, Error> {
        let depth = checked_depth(resolution)?;
        let source = Source::new(size, size, luminance, Edges::EqualArea, filter)?;
        Ok(Self::from_source(&source, Edges::EqualArea, depth))
    }

    fn from_source(source: &Source, edges: Edges, depth: u32) -> Self {
        if let Some(radiance) = source.constant() {
            return Self::uniform(radiance, source.clamped);
        }
        // One texel is cut by all seams of the map; take the mean of four instead.
        let image = resample(source, edges, depth.max(1));
        let suns = if depth == 0 { Suns::none() } else { Suns::find(depth, finest(depth, &image)) };
        let pyramid = Pyramid::new(depth.max(1), image, suns.cap);
        let [low, high] = pyramid.ranges[0];
        if depth == 0 || low == high {
            return Self::uniform(pyramid.means[0], source.clamped);
        }
        Self::from_pyramid(depth, pyramid, suns, source.clamped)
    }

    fn uniform(radiance: f32, clamped_texels: u32) -> Self {
        Self::from_pyramid(0, Pyramid::new(0, vec![radiance], f32::INFINITY), Suns::none(), clamped_texels)
    }

    fn from_pyramid(depth: u32, pyramid: Pyramid, suns: Suns, clamped_texels: u32) -> Self {
        let mean = pyramid.means[0];
        let max = finest(depth, &pyramid.means).iter().copied().fold(0.0, f32::max);
        let rotation = Mat3::IDENTITY.to_cols_array_2d();
        Self { header: EnvironmentHeader { rotation, depth, mean, max, clamped_texels, cap: suns.cap }, pyramid, suns }
    }

    /// Turns the environment. `rotation` takes directions of the environment's frame to the world.
    ///
    /// # Errors
    ///
    /// As [`set_rotation`](Self::set_rotation).
    pub fn with_rotation(mut self, rotation: Mat3) -> Result<Self, Error> {
        self.set_rotation(rotation)?;
        Ok(self)
    }

    /// Turns the environment, without building anything anew. `rotation` takes directions of the environment's
    /// frame to the world.
    ///
    /// # Errors
    ///
    /// If the matrix is not orthonormal with the determinant 1, within 1e-4. The environment is unchanged then.
    pub fn set_rotation(&mut self, rotation: Mat3) -> Result<(), Error> {
        self.header.rotation = rotation::checked(rotation)?;
        Ok(())
    }

    /// The borrowed form, which does all the work.
    #[inline]
    pub fn as_view(&self) -> EnvironmentView<'_> {
        EnvironmentView::from_pyramid(self.header, &self.pyramid, &self.suns)
    }

    /// [`EnvironmentView::sample`].
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> Option<EnvironmentSample> {
        self.as_view().sample(u)
    }

    /// [`EnvironmentView::pdf`].
    #[inline]
    pub fn pdf(&self, direction: Vec3) -> f32 {
        self.as_view().pdf(direction)
    }

    /// [`EnvironmentView::radiance`].
    #[inline]
    pub fn radiance(&self, direction: Vec3) -> f32 {
        self.as_view().radiance(direction)
    }

    /// [`EnvironmentView::mean`].
    pub fn mean(&self) -> f32 {
        self.header.mean
    }

    /// Mean radiance over the sphere without the suns.
    pub(crate) fn mean_without_suns(&self) -> f32 {
        self.as_view().mean_without_suns()
    }

    /// [`EnvironmentView::max`].
    pub fn max(&self) -> f32 {
        self.header.max
    }

    /// [`EnvironmentView::size`].
    pub fn size(&self) -> u32 {
        self.as_view().size()
    }

    /// [`EnvironmentView::is_constant`].
    pub fn is_constant(&self) -> bool {
        self.as_view().is_constant()
    }

    /// [`EnvironmentView::texel_solid_angle`].
    pub fn texel_solid_angle(&self) -> f32 {
        self.as_view().texel_solid_angle()
    }

    /// [`EnvironmentView::clamped_texels`].
    pub fn clamped_texels(&self) -> usize {
        self.as_view().clamped_texels()
    }

    /// [`EnvironmentView::rotation`].
    pub fn rotation(&self) -> Mat3 {
        self.as_view().rotation()
    }
}

/// Depth of the smallest pyramid whose finest level has at least this many texels, at most [`MAX_DEPTH`].
fn depth_for(texels: u64) -> u32 {
    (0..MAX_DEPTH).find(|depth| 1 << (2 * depth) >= texels).unwrap_or(MAX_DEPTH)
}

/// Depth of a pyramid with at least `size` texels a side.
fn checked_depth(size: usize) -> Result<u32, Error> {
    let limit = 1 << MAX_DEPTH;
    if !(1..=limit).contains(&size) {
        let what = "environment: the resolution asked for";
        return Err(Error(Kind::ImageSize { what, width: size, height: size, limit }));
    }
    Ok(size.next_power_of_two().trailing_zeros())
}
