//! The plain records that a host hands in and gets back.

mod image;
mod sample;

pub use image::{Filter, Wrap};
pub use sample::{Hit, LightSample, TriangleId};

// Until all importers have moved.
pub(crate) use crate::receiver::{Receiver, ShadingPoint};
