//! How much a call may do to follow the light.

/// How much a call may do to follow the light at a shading point. Samples and densities are exact at any effort; they
/// are those of different densities, so that a density must be asked for with the effort that the sample was drawn
/// with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Effort {
    /// Follows all that is known: inside a light the receiver and, through a portal, the environment.
    #[default]
    Full,
    /// Chooses a light as [`Full`](Self::Full) does, and follows bright features of the environment. Inside a light,
    /// directions are uniform if it has no texture; if it has one, its texels are followed, but nothing of the
    /// environment behind it.
    ///
    /// A call through portals to an image takes a third to two thirds of the time. It pays where the noise of a sample
    /// is not that of the picture: at later vertices of a path, and in previews (docs/HOST.md).
    Least,
}
