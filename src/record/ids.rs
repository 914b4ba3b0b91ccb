//! Numbers of what a host has passed to the builder.

/// A mesh that was added to a builder. Meshes are numbered from 0 in the order in which they are added.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MeshId(pub(crate) u32);

impl MeshId {
    /// Returns the id of the mesh with this number.
    #[must_use]
    pub const fn from_index(index: u32) -> Self {
        Self(index)
    }

    /// Returns the number of the mesh.
    #[must_use]
    pub const fn index(self) -> u32 {
        self.0
    }
}

/// A texture, or a function that takes the place of one, that was added to a builder. Both are numbered together from 0 in
/// the order in which they are added.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TextureId(pub(crate) u32);

impl TextureId {
    /// Returns the id of the texture with this number.
    #[must_use]
    pub const fn from_index(index: u32) -> Self {
        Self(index)
    }

    /// Returns the number of the texture.
    #[must_use]
    pub const fn index(self) -> u32 {
        self.0
    }
}

/// A light that was added to a builder and is not made of triangles ([`Lamp`](crate::Lamp)). These lights are numbered from 0
/// in the order in which they are added.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LightId(pub(crate) u32);

impl LightId {
    /// Returns the id of the light with this number.
    #[must_use]
    pub const fn from_index(index: u32) -> Self {
        Self(index)
    }

    /// Returns the number of the light.
    #[must_use]
    pub const fn index(self) -> u32 {
        self.0
    }
}

/// A profile that was added to a builder. Profiles are numbered from 0 in the order in which they are added.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ProfileId(pub(crate) u32);

impl ProfileId {
    /// Returns the id of the profile with this number.
    #[must_use]
    pub const fn from_index(index: u32) -> Self {
        Self(index)
    }

    /// Returns the number of the profile.
    #[must_use]
    pub const fn index(self) -> u32 {
        self.0
    }
}

/// An object that was added to a builder: meshes that are placed by instances. Objects are numbered from 0 in the order in
/// which they are added.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ObjectId(pub(crate) u32);

impl ObjectId {
    /// Returns the id of the object with this number.
    #[must_use]
    pub const fn from_index(index: u32) -> Self {
        Self(index)
    }

    /// Returns the number of the object.
    #[must_use]
    pub const fn index(self) -> u32 {
        self.0
    }
}

/// An object at one place. Instances are numbered from 0 in the order in which they are added, those of all objects together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct InstanceId(pub(crate) u32);

impl InstanceId {
    /// Returns the id of the instance with this number.
    #[must_use]
    pub const fn from_index(index: u32) -> Self {
        Self(index)
    }

    /// Returns the number of the instance.
    #[must_use]
    pub const fn index(self) -> u32 {
        self.0
    }
}

/// One triangle of one mesh.
///
/// A triangle of an [`Instance`](crate::Instance) is numbered within its object: the mesh is one of those that
/// [`add_object`](crate::LightSamplerBuilder::add_object) was given, numbered from 0. Which instance it belongs to is said
/// beside it ([`Hit::instance`](crate::Hit::instance)).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub struct TriangleId {
    /// Mesh that the triangle belongs to.
    pub mesh: MeshId,
    /// Number of the triangle in its mesh.
    pub triangle: u32,
}

impl TriangleId {
    /// Returns the id of a triangle of a mesh.
    #[must_use]
    pub const fn new(mesh: MeshId, triangle: u32) -> Self {
        Self { mesh, triangle }
    }
}
