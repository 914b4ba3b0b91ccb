//! Light sampling for renderers: textured mesh lights and light portals of any shape.

#![no_std]

extern crate alloc;
#[cfg(any(feature = "std", test))]
extern crate std;

mod blas;
mod bounds;
mod env;
mod error;
mod geometry;
mod light;
mod math;
mod record;
mod sampler;
#[cfg(test)]
mod testing;
mod tlas;
mod warp;

pub use blas::Texture;
pub use env::{Environment, EnvironmentHeader, EnvironmentSample, EnvironmentView};
pub use error::Error;
pub use light::Illumination;
pub use record::{Filter, Hit, LightSample, Receiver, ShadingPoint, TriangleId, Wrap};
pub use sampler::{LightSampler, LightSamplerBuilder, LightSamplerView, Mesh, Sides, TextureId, Weight};
pub use tlas::Splitting;
