//! Bright features of the environment through light triangles.
//!
//! A triangle that is seen from a shading point is an [`Opening`]: three planes through the viewer. The part of a
//! feature's texel that it shows is a square cut by three lines ([`TexelCut`](texel_cut::TexelCut)). A
//! [`FeatureView`] joins the two for the cells of one triangle's texture.

mod clipped_square;
mod opening;
#[cfg(test)]
mod tests;
mod texel_cut;
mod view;

pub(crate) use view::{FeaturePart, FeatureView};
