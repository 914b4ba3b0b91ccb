//! Joins a triangle, its texture's tree and the environment into one target.

mod illumination;
mod triangle;
mod worth;

pub use illumination::Illumination;
pub(crate) use triangle::{LightTriangle, Lit, POSITION_LIMIT};
