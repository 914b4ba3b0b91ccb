//! Pictures of the figures.

pub(crate) mod panels;
pub(crate) mod scatter;
