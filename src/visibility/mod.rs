//! What walls hide, learned from reports and then frozen: a factor for each child of a node of the light tree, by
//! regions of space and orientation.
//!
//! The idea is that of a cut of the light tree for each region (Vévoda, Kondapaneni and Křivánek 2018; Wang et al.
//! 2021), in a form that costs little: one table, keyed by region and node. A walk that meets an entry multiplies the
//! weights of the node's lanes by the entry's factors; a walk without one goes on as it would anyway. The factors are
//! functions of the shading point and of nothing else, and never zero, so that samples stay unbiased and densities
//! exact for any table.
//!
//! [`counts`] collects reports in integers, so that neither threads nor their order matter; [`regions`] divides space
//! where reports are; [`distill`] turns counts into factors; [`table`] is what sampling reads.

mod counts;
mod distill;
mod regions;
mod table;
mod validate;

pub(crate) use counts::{Counts, LeafKey};
pub(crate) use distill::distill;
pub(crate) use regions::RegionBuilder;
pub(crate) use table::{RegionFactors, VisibilityHeader, orientation};
pub use table::{Visibility, VisibilityView};

/// Bit that tells the factors for bright features of the environment from those for everything else. *Format*: nodes
/// are fewer than 2^28.
pub(crate) const FEATURES: u32 = 1 << 30;

/// Key of the first of the entries that hold the factors of the environment's regions, 16 each. *Format*: above all
/// nodes.
pub(crate) const SKY: u32 = 1 << 31;
