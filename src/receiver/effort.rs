//! How much a call may do to follow the light.

/// How much a call may do to follow the light at a shading point. Samples and densities are exact at any effort; they
/// are those of different densities, so that a density must be requested with the effort that the sample was drawn
/// with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Effort {
    /// Follows all that is known: inside a light the receiver and, through a portal, the environment.
    #[default]
    Full,
    /// Chooses a light as [`Full`](Self::Full) does, and follows bright features of the environment, through larger
    /// parts of a texture at a time. Inside a light, nothing else of the environment behind it is followed: directions
    /// to a triangle without a texture are uniform, or points by area where it is small for its distance, and of a
    /// texture the texels are followed.
    ///
    /// What it saves depends on what a call does there: through two windows to an image of the sky it takes a quarter of
    /// the time, and where dozens of openings or bright features are to choose among four fifths; among emitters it saves
    /// little. It pays where the noise of a sample is not that of the picture: at later vertices of a path, and in
    /// previews (docs/HOST.md, "Effort").
    Least,
}
