//! The one error type of the crate.

use alloc::boxed::Box;
use core::fmt;

use crate::progress::Cancelled;

/// Why a builder refused its input, or a loader its bytes.
///
/// The kinds are private, so that new ones can be added; the message names the mesh, the element, the value
/// and the limit that it broke.
#[derive(Clone, Debug, PartialEq)]
pub struct Error(pub(crate) ErrorKind);

impl Error {
    /// Whether it is no mistake but the host's own wish, given by what it passed to
    /// [`build_with`](crate::LightSamplerBuilder::build_with) or
    /// [`Environment::new_with`](crate::Environment::new_with).
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        self.0 == ErrorKind::Cancelled
    }

    /// Bytes that hold, in the element `at` or at that offset, something else than they should.
    pub(crate) fn bytes(what: &'static str, at: usize, found: impl TryInto<u64>, expected: impl TryInto<u64>) -> Self {
        let (found, expected) = (found.try_into().unwrap_or(u64::MAX), expected.try_into().unwrap_or(u64::MAX));
        Self(ErrorKind::Bytes { what, at, found, expected })
    }

    /// A section of bytes whose version this build does not read.
    pub(crate) fn section(what: &'static str, found: u32, expected: u32) -> Self {
        Self(ErrorKind::SectionVersion { what, found, expected })
    }

    /// `Ok` if a count that bytes hold is the expected one.
    pub(crate) fn unless_equal(what: &'static str, found: usize, expected: usize) -> Result<(), Self> {
        if found == expected { Ok(()) } else { Err(Self::bytes(what, 0, found, expected)) }
    }
}

impl From<Cancelled> for Error {
    fn from(_: Cancelled) -> Self {
        Self(ErrorKind::Cancelled)
    }
}

/// What went wrong, with everything that the message says.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum ErrorKind {
    /// An image without texels, or with more than an index can hold.
    ImageSize { what: &'static str, width: usize, height: usize, limit: usize },
    /// The number of texels is not width times height.
    TexelCount { what: &'static str, width: usize, height: usize, found: usize },
    /// A texel that is NaN, infinite or, where that is an error, negative.
    Texel { what: &'static str, x: usize, y: usize, value: f32 },
    /// A texel too large for the sums and products that it goes into.
    TexelTooBright { what: &'static str, x: usize, y: usize, value: f32, limit: f32 },
    /// A scalar that is NaN, infinite or out of its range.
    Scalar { what: &'static str, value: f32, expected: &'static str },
    /// A rotation that is not orthonormal.
    Rotation { determinant: f32 },
    /// A vertex with a NaN or infinite coordinate, or one too large to square.
    Position { mesh: usize, vertex: usize, value: [f32; 3], limit: f32 },
    /// A texture coordinate that is NaN, infinite or too large.
    TextureCoordinate { mesh: usize, vertex: usize, value: [f32; 2], limit: f32 },
    /// A triangle that refers to a vertex that is not there.
    Index { mesh: usize, triangle: usize, index: u32, vertices: usize },
    /// A textured mesh without, or with too few, texture coordinates.
    TextureCoordinateCount { mesh: usize, found: usize, vertices: usize },
    /// A constant weight of a mesh that is NaN, negative or too large.
    Weight { mesh: usize, value: f32, limit: f32 },
    /// What a function says it lies between over a box of texture coordinates is no range of weights.
    ProceduralBounds { mesh: usize, region: [[f32; 2]; 2], bounds: [f32; 2] },
    /// What a function gives at a place is not within the bound that it gives over a box around it.
    ProceduralWeight { mesh: usize, uv: [f32; 2], value: f32, region: [[f32; 2]; 2], bounds: [f32; 2] },
    /// A light without triangles of which a number is NaN, infinite or out of its range.
    Lamp { light: usize, what: &'static str, value: f32, expected: &'static str },
    /// A handle to a texture that this builder did not give out.
    UnknownTexture { mesh: usize, texture: usize, textures: usize },
    /// A mesh that a sampler does not hold.
    UnknownMesh { mesh: usize, meshes: usize },
    /// A changed mesh of other triangles than before.
    TriangleCount { mesh: usize, found: usize, expected: usize },
    /// A triangle that is not in the tree, for it had no area, but would have to be.
    Revived { mesh: usize, triangle: usize },
    /// A light without triangles that a sampler does not hold.
    UnknownLight { light: usize, lights: usize },
    /// A light without triangles that is not in the tree, for it emitted nothing, but would have to be.
    RevivedLight { light: usize },
    /// A value of a profile that is NaN, infinite or out of its range.
    Profile { what: &'static str, at: usize, value: f32, expected: &'static str },
    /// A profile that this builder did not give out.
    UnknownProfile { light: usize, profile: usize, profiles: usize },
    /// A distant light in the place of one that is somewhere, or the other way round.
    DistantReplaced { light: usize },
    /// What is wrong with a mesh of an object.
    InObject { object: usize, kind: Box<ErrorKind> },
    /// A mesh of an object that is not in all light groups.
    GroupsInObject { object: usize, mesh: usize },
    /// An object without triangles.
    EmptyObject { object: usize },
    /// A handle to an object that this builder did not give out.
    UnknownObject { instance: usize, object: usize, objects: usize },
    /// An instance of which a number is NaN, infinite or out of its range.
    Instance { instance: usize, what: &'static str, value: f32, expected: &'static str },
    /// A changed instance of another object than before.
    OtherObject { instance: usize, object: u32, expected: u32 },
    /// An instance that a sampler does not hold.
    UnknownInstance { instance: usize, instances: usize },
    /// A mesh that moves, with another number of vertices at the end than at the start.
    EndCount { mesh: usize, found: usize, vertices: usize },
    /// A mesh of an object whose vertices move.
    MotionInObject { object: usize, mesh: usize },
    /// More of something than its index type can count.
    TooMany { what: &'static str, count: usize, limit: usize },
    /// A build that the host has cancelled.
    Cancelled,
    /// A section of bytes of another version.
    SectionVersion { what: &'static str, found: u32, expected: u32 },
    /// Bytes with trees of an arity that this build does not walk.
    Arity { what: &'static str, found: u32, expected: &'static [u32] },
    /// A table of visibility that was learned for another sampler.
    Visibility { what: &'static str, found: usize, expected: usize },
    /// Counts of visibility with other regions than those of the learner.
    VisibilityRegions { node: usize, found: Box<str>, expected: Box<str> },
    /// Bytes that do not hold what they should.
    Bytes { what: &'static str, at: usize, found: u64, expected: u64 },
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl fmt::Display for ErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ErrorKind::ImageSize { what, width, height, limit } => {
                write!(f, "{what}: {width} x {height} texels, but each side must be from 1 to {limit}")
            }
            ErrorKind::TexelCount { what, width, height, found } => {
                write!(f, "{what}: {found} texels given for {width} x {height}")
            }
            ErrorKind::Texel { what, x, y, value } => {
                write!(f, "{what}: texel ({x}, {y}) is {value}, but must be finite and not negative")
            }
            ErrorKind::TexelTooBright { what, x, y, value, limit } => {
                write!(f, "{what}: texel ({x}, {y}) is {value:e}, but must be at most {limit:e}")
            }
            ErrorKind::Scalar { what, value, expected } => write!(f, "{what} is {value}, but must be {expected}"),
            ErrorKind::Rotation { determinant } => {
                write!(f, "environment: the rotation is not orthonormal (determinant {determinant}, must be 1)")
            }
            ErrorKind::Position { mesh, vertex, value: [x, y, z], limit } => {
                write!(f, "mesh {mesh}: vertex {vertex} is at ({x}, {y}, {z}), but must be finite and within {limit:e}")
            }
            ErrorKind::TextureCoordinate { mesh, vertex, value: [u, v], limit } => {
                write!(f, "mesh {mesh}: vertex {vertex} has uv ({u}, {v}), but must be finite and within {limit:e}")
            }
            ErrorKind::Index { mesh, triangle, index, vertices } => {
                write!(f, "mesh {mesh}: triangle {triangle} uses vertex {index}, but there are {vertices}")
            }
            ErrorKind::TextureCoordinateCount { mesh, found, vertices } => {
                write!(f, "mesh {mesh}: its weight is a texture, but it has {found} uvs for {vertices} vertices")
            }
            ErrorKind::Weight { mesh, value, limit } => {
                write!(f, "mesh {mesh}: the weight is {value}, but must be from 0 to {limit:e}")
            }
            ErrorKind::ProceduralBounds { mesh, region: [[u0, v0], [u1, v1]], bounds: [min, max] } => {
                write!(f, "mesh {mesh}: the bounds of its weight over uv ({u0}, {v0}) to ({u1}, {v1}) are {min} and ")?;
                write!(f, "{max}, but must be finite, not negative and in this order")
            }
            ErrorKind::ProceduralWeight {
                mesh,
                uv: [u, v],
                value,
                region: [[u0, v0], [u1, v1]],
                bounds: [min, max],
            } => {
                write!(f, "mesh {mesh}: the weight at uv ({u}, {v}) is {value}, but its bounds over uv ")?;
                write!(f, "({u0}, {v0}) to ({u1}, {v1}) are {min} and {max}")
            }
            ErrorKind::Lamp { light, what, value, expected } => {
                write!(f, "light {light}: the {what} is {value}, but must be {expected}")
            }
            ErrorKind::UnknownTexture { mesh, texture, textures } => {
                write!(f, "mesh {mesh}: texture {texture} was never added, this builder has {textures}")
            }
            ErrorKind::UnknownMesh { mesh, meshes } => {
                write!(f, "mesh {mesh} was never added or has been removed, this sampler has {meshes}")
            }
            ErrorKind::TriangleCount { mesh, found, expected } => {
                write!(f, "mesh {mesh}: {found} triangles given, but it was added with {expected}")
            }
            ErrorKind::Revived { mesh, triangle } => {
                write!(f, "mesh {mesh}: triangle {triangle} has an area now, but had none when the sampler was built")
            }
            ErrorKind::UnknownLight { light, lights } => {
                write!(f, "light {light} was never added or has been removed, this sampler has {lights}")
            }
            ErrorKind::RevivedLight { light } => {
                write!(f, "light {light} emits now, but emitted nothing when the sampler was built")
            }
            ErrorKind::Profile { what, at, value, expected } => {
                write!(f, "profile: {what} {at} is {value}, but must be {expected}")
            }
            ErrorKind::UnknownProfile { light, profile, profiles } => {
                write!(f, "light {light}: there is no profile {profile}, but {profiles} profiles")
            }
            ErrorKind::DistantReplaced { light } => {
                write!(f, "light {light}: a distant light can only take the place of a distant light")
            }
            ErrorKind::InObject { object, kind } => write!(f, "object {object}: {kind}"),
            ErrorKind::GroupsInObject { object, mesh } => {
                write!(f, "object {object}: mesh {mesh} has light groups, but those of an instance count")
            }
            ErrorKind::EmptyObject { object } => write!(f, "object {object} has no triangles"),
            ErrorKind::UnknownObject { instance, object, objects } => {
                write!(f, "instance {instance}: object {object} was never added, this builder has {objects}")
            }
            ErrorKind::Instance { instance, what, value, expected } => {
                write!(f, "instance {instance}: the {what} is {value}, but must be {expected}")
            }
            ErrorKind::OtherObject { instance, object, expected } => {
                write!(
                    f,
                    "instance {instance}: it is one of object {object} now, but was added as one of object {expected}"
                )
            }
            ErrorKind::UnknownInstance { instance, instances } => {
                write!(f, "instance {instance} was never added or has been removed, this sampler has {instances}")
            }
            ErrorKind::EndCount { mesh, found, vertices } => {
                write!(
                    f,
                    "mesh {mesh}: {found} vertices at the end of the shutter interval, but {vertices} at its start"
                )
            }
            ErrorKind::MotionInObject { object, mesh } => {
                write!(f, "object {object}: the vertices of mesh {mesh} move, but only the object's instances can")
            }
            ErrorKind::TooMany { what, count, limit } => write!(f, "{count} {what}, but at most {limit} are possible"),
            ErrorKind::Cancelled => write!(f, "the build was cancelled"),
            ErrorKind::SectionVersion { what, found, expected } => {
                write!(f, "bytes: section `{what}` has version {found}, but this build reads version {expected}")
            }
            ErrorKind::Arity { what, found, expected } => {
                write!(f, "bytes: {what} has the arity {found}, but this build reads ")?;
                for (i, arity) in expected.iter().enumerate() {
                    write!(f, "{}{arity}", if i == 0 { "" } else { ", " })?;
                }
                Ok(())
            }
            ErrorKind::Visibility { what, found, expected } => {
                write!(f, "visibility: it was learned for {found} {what}, but there are {expected}")
            }
            ErrorKind::VisibilityRegions { node, found, expected } => {
                write!(f, "visibility: it was counted with node {node} over regions as {found}, but it is {expected}")
            }
            ErrorKind::Bytes { what, at, found, expected } => {
                write!(f, "bytes: {what} at {at} is {found:#x}, expected {expected:#x}")
            }
        }
    }
}

impl core::error::Error for Error {}
