//! How an image is read between its texels and outside of its edges.

/// How the host reads an image between texel centers.
///
/// The crate needs to know so that it never gives a zero density to a place where the host sees light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Filter {
    /// The value of the texel that the coordinate falls into.
    Nearest,
    /// Linear interpolation between the four nearest texel centers.
    #[default]
    Bilinear,
}

/// What a texture holds outside of `[0, 1]`, one per axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// The image, repeated.
    #[default]
    Repeat,
    /// The image and its mirror image, alternating.
    Mirror,
    /// The texel at the edge.
    Clamp,
}
