//! The image that a host builds an environment from.

use crate::record::Filter;

/// What a latitude-longitude image holds beyond its poles, for a host that interpolates between texels.
///
/// It matters within half a texel of a pole. Choose what the host's own lookup does, so that no place where the host
/// sees light has a density of zero. It makes no difference with [`Filter::Nearest`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Poles {
    /// Rows end: beyond a pole the row next to the pole is repeated.
    #[default]
    Clamp,
    /// Rows continue on the other side: the row beyond a pole is the row next to the pole, half a turn away. If the
    /// width is odd, it is the mean of the two nearest columns.
    Across,
}

/// How the image continues beyond its edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Edges {
    /// A latitude-longitude image: columns repeat, rows continue beyond the poles as the host says.
    LatLong(Poles),
    /// An equal-area image: the octahedral map's copies, rotated by half a turn.
    EqualArea,
}

/// The luminance of an environment, as the host has it, and how the host reads it.
///
/// ```
/// use fanlight::{Environment, EnvironmentImage, Filter, Poles};
///
/// let luminance = [1.0; 8 * 4];
/// let image = EnvironmentImage::lat_long(8, 4, &luminance).filter(Filter::Bilinear).poles(Poles::Across);
/// let environment = Environment::new(&image)?;
/// # Ok::<(), fanlight::Error>(())
/// ```
#[derive(Clone, Copy)]
#[must_use]
pub struct EnvironmentImage<'a> {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) luminance: &'a [f32],
    pub(super) edges: Edges,
    pub(super) filter: Filter,
    /// Texels a side of the resampled image, if the host chose them.
    pub(super) resolution: Option<usize>,
}

crate::buffers::debug_counts!(EnvironmentImage<'_>, image => {
    width: image.width,
    height: image.height,
    edges: image.edges,
    filter: image.filter,
    resolution: image.resolution,
});

impl<'a> EnvironmentImage<'a> {
    /// A latitude-longitude image of `width * height` texels, the top row first.
    pub const fn lat_long(width: usize, height: usize, luminance: &'a [f32]) -> Self {
        let edges = Edges::LatLong(Poles::Clamp);
        Self { width, height, luminance, edges, filter: Filter::Bilinear, resolution: None }
    }

    /// An equal-area image of `size * size` texels, the row at `y = 0` first.
    pub const fn equal_area(size: usize, luminance: &'a [f32]) -> Self {
        let edges = Edges::EqualArea;
        Self { width: size, height: size, luminance, edges, filter: Filter::Bilinear, resolution: None }
    }

    /// Sets how the host reads the image between texel centers; [`Filter::Bilinear`] if it is not set.
    pub const fn filter(mut self, filter: Filter) -> Self {
        self.filter = filter;
        self
    }

    /// Sets what the host reads beyond the poles of a latitude-longitude image; [`Poles::Clamp`] if it is not set.
    /// Equal-area images have no poles and ignore it.
    pub const fn poles(mut self, poles: Poles) -> Self {
        if let Edges::LatLong(_) = self.edges {
            self.edges = Edges::LatLong(poles);
        }
        self
    }

    /// Sets the number of texels a side of the equal-area image that the environment stores, at most 8192. It is
    /// rounded up to a power of two.
    ///
    /// If it is not set, it is the smallest power of two whose square is at least the number of texels, and at most
    /// 8192.
    pub const fn resolution(mut self, size: usize) -> Self {
        self.resolution = Some(size);
        self
    }
}
