//! Numbers of what a host has passed to the builder.

/// Defines ids: a name, what it numbers, and its documentation.
macro_rules! ids {
    ($($(#[$doc:meta])* $id:ident of the $what:literal;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub struct $id(pub(crate) u32);

        impl $id {
            #[doc = concat!("Returns the id of the ", $what, " with this number.")]
            #[must_use]
            pub const fn from_index(index: u32) -> Self {
                Self(index)
            }

            #[doc = concat!("Returns the number of the ", $what, ".")]
            #[must_use]
            pub const fn index(self) -> u32 {
                self.0
            }
        }
    )*};
}

ids! {
    /// A mesh that was added to a builder. Meshes are numbered from 0 in the order in which they are added.
    MeshId of the "mesh";

    /// A texture, or a function that takes the place of one, that was added to a builder. Both are numbered together
    /// from 0 in the order in which they are added.
    TextureId of the "texture";

    /// A light that was added to a builder and is not made of triangles ([`Lamp`](crate::Lamp)). These lights are
    /// numbered from 0 in the order in which they are added.
    LightId of the "light";

    /// A profile that was added to a builder. Profiles are numbered from 0 in the order in which they are added.
    ProfileId of the "profile";

    /// An object that was added to a builder: meshes that are placed by instances. Objects are numbered from 0 in the
    /// order in which they are added.
    ObjectId of the "object";

    /// An object at one place. Instances are numbered from 0 in the order in which they are added, those of all objects
    /// together.
    InstanceId of the "instance";
}

/// One triangle of one mesh.
///
/// A triangle of an [`Instance`](crate::Instance) is numbered within its object: the mesh is one of those that
/// [`add_object`](crate::LightSamplerBuilder::add_object) was given, numbered from 0. Which instance it belongs to is
/// said beside it ([`Hit::instance`](crate::Hit::instance)).
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
