//! The top level: a wide bounding volume hierarchy over light triangles.
//!
//! It sees bounds and opaque leaf numbers only; what a leaf is, and what light arrives from behind a portal, it
//! asks of the level above through [`LeafOracle`].

mod arity;
mod build;
mod edit;
mod node;
#[cfg(test)]
mod tests;
mod tree;
mod validate;
mod walk;
mod words;

pub use arity::Arity;
pub(crate) use arity::MAX_LANES;
#[cfg(test)]
use build::build;
pub(crate) use build::build_in_groups;
pub(crate) use edit::{LeafStore, TreeEdit, TreeState, relayout};
pub(crate) use tree::{MAX_LEAVES, Tlas, TlasView};
pub use walk::Splitting;
pub(crate) use walk::{
    Beam, ClusterAlong, ClusterMoments, Clusters, Descent, FACTORS, FactorBytes, FirstWeights, INTERLEAVED, LeafOracle,
    Outgoing, Stretch, factor,
};
