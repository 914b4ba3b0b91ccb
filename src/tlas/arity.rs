//! How many children a node of the light tree may have.

/// Number of children of a node of the tree over triangles.
///
/// The wider a node, the more children compete in one choice, so that choices are better and walks are shorter; but all
/// lanes are computed, whether they are used or not. Without AVX, [`Arity::Eight`] may be faster than the default.
/// Where a narrower node holds all lights of a scene, the tree gets the least arity that does. The arity is a property
/// of the built sampler and is kept in its bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
#[repr(u32)]
pub enum Arity {
    /// Four children.
    Four = 4,
    /// Eight children: one register of 256 bits.
    Eight = 8,
    /// Sixteen children: one register of 512 bits, or two of 256 bits.
    #[default]
    Sixteen = 16,
}

/// Largest number of lanes of all arities. *Format*: the largest value of [`Arity`].
pub(crate) const MAX_LANES: usize = 16;

impl Arity {
    /// Returns the number of children that a node has room for.
    #[must_use]
    pub const fn lanes(self) -> usize {
        self as usize
    }

    /// Returns the least arity whose root has room for this many leaves, if one below this does, and otherwise this.
    pub(super) fn narrowed_to(self, leaves: usize) -> Self {
        let has_room = |arity: &Self| (leaves..=self.lanes()).contains(&arity.lanes());
        [Self::Four, Self::Eight].into_iter().find(has_room).unwrap_or(self)
    }

    /// Returns the number that stands for the arity in bytes.
    pub(crate) const fn code(self) -> u32 {
        self as u32
    }

    /// Returns the arity that a number in bytes stands for, if there is one.
    pub(crate) const fn from_code(code: u32) -> Option<Self> {
        match code {
            4 => Some(Self::Four),
            8 => Some(Self::Eight),
            16 => Some(Self::Sixteen),
            _ => None,
        }
    }
}
