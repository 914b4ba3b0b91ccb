//! Where a light is: in the tree over all lights, or in that of an object and there.

/// A leaf of the tree over all lights; where that is an instance, with a leaf of the object's own tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct LightLeaf {
    /// Leaf of the tree over all lights.
    pub(crate) top: u32,
    /// Leaf of the object's own tree, or [`Self::ALONE`].
    below: u32,
}

impl LightLeaf {
    /// Marks a light that belongs to no instance.
    const ALONE: u32 = u32::MAX;

    /// Returns a light that belongs to no instance.
    #[inline(always)]
    pub(crate) const fn alone(top: u32) -> Self {
        Self { top, below: Self::ALONE }
    }

    /// Returns a light of an instance.
    #[inline(always)]
    pub(crate) const fn within(top: u32, below: u32) -> Self {
        Self { top, below }
    }

    /// Returns the leaf of the object's own tree; `None` for a light that belongs to no instance.
    #[inline(always)]
    pub(crate) fn below(self) -> Option<u32> {
        (self.below != Self::ALONE).then_some(self.below)
    }
}
