//! Light sampling for renderers: textured mesh lights and light portals of any shape.

#![no_std]

extern crate alloc;
#[cfg(feature = "std")]
extern crate std;

#[cfg_attr(not(test), expect(dead_code, reason = "the lights are to use it"))]
mod blas;
mod env;
mod error;
mod geometry;
mod math;
mod record;
#[cfg(test)]
mod testing;
mod warp;

pub use blas::Texture;
pub use env::{Environment, EnvironmentHeader, EnvironmentSample, EnvironmentView};
pub use error::Error;
pub use record::{Filter, Hit, LightSample, Receiver, ShadingPoint, TriangleId, Wrap};
