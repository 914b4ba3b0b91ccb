//! The plain records that a host passes in and gets back.

mod image;
mod sample;
mod shading;

pub use image::{Filter, Wrap};
pub use sample::{Hit, LightSample, TriangleId};
pub use shading::{Receiver, ShadingPoint};
