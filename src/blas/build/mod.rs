//! Builds the tree over a texture on one triangle.
//!
//! A [`WeightSource`](grow::WeightSource) gives the range and the average of the weight over any cell, from an image
//! ([`image`]) or from a function ([`procedural`]). [`grow`] divides cells by these until memory runs out or what is
//! left undivided adds little to the variance.

mod axis;
mod coverage;
mod footprint;
mod grow;
mod image;
mod procedural;
mod pyramid;
mod texture;
mod touched;
mod window;

pub(crate) use footprint::check_uv;
#[cfg(test)]
pub(crate) use image::build;
pub(crate) use image::{ImageTree, build_images, image_work};
pub use procedural::Procedural;
pub(crate) use procedural::{RegisteredFunction, build_procedural};
#[cfg(test)]
pub(crate) use pyramid::TexturePyramid;
pub use texture::Texture;
