//! The tree over one triangle's barycentric domain (Ogaki, "Generalized Light Portals", HPG 2020).
//!
//! A node has `M = R²` children, `R` to an edge of the triangle; their values are the average weights of the
//! texture over them. The tree knows nothing of the triangle's shape, only of its texture coordinates, so that
//! every triangle with the same texture and coordinates can share it.

mod axis;
pub(crate) mod barycentric;
pub(crate) mod build;
mod coverage;
pub(crate) mod footprint;
pub(crate) mod node;
mod polygon;
pub(crate) mod pyramid;
mod texture;
mod touched;

#[cfg(test)]
mod pcg;

pub use texture::Texture;
