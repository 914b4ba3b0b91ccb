//! The top level: a wide bounding volume hierarchy over light triangles.
//!
//! It sees bounds and opaque leaf numbers only; what a leaf is, and what light arrives from behind a portal, it
//! asks of the level above through [`Scene`].

mod beam;
mod bins;
mod build;
mod cluster;
mod collapse;
mod descend;
mod encode;
mod fit;
mod forest;
mod importance;
mod node;
mod progress;
mod ray;
mod split;
#[cfg(test)]
mod tests;
mod validate;

pub(crate) use beam::{Beam, Outgoing};
pub(crate) use build::build;
pub(crate) use descend::{TURNS, Walk};
pub(crate) use importance::Scene;
pub(crate) use node::{MAX_LEAVES, Tlas, TlasView};
pub(crate) use progress::Report;
pub use split::Splitting;
