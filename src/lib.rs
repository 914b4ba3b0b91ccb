//! Light sampling for renderers: textured mesh lights and light portals of any shape.

#![no_std]

extern crate alloc;
#[cfg(any(feature = "std", test))]
extern crate std;

mod env;
mod error;
mod geometry;
mod math;
mod record;
#[cfg(test)]
mod testing;
mod warp;

pub use env::{Environment, EnvironmentHeader, EnvironmentSample, EnvironmentView};
pub use error::Error;
pub use record::{Filter, Hit, LightSample, Receiver, ShadingPoint, TriangleId, Wrap};
