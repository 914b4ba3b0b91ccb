//! What is asked of a finished tree. Whatever draws a leaf has its density next to it, by the same weights.

mod beam;
pub(in crate::tlas) mod descend;
mod importance;
pub(in crate::tlas) mod ray;
mod split;

pub(crate) use beam::{Beam, Outgoing};
pub(crate) use descend::{Descent, TURNS};
pub(crate) use importance::LeafOracle;
pub use split::Splitting;
