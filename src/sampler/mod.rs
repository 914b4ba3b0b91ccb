//! The facade that a host calls.

mod at;
mod builder;
mod bytes;
mod direction;
mod forward;
mod lights;
mod mesh;
mod pdf;
mod sample;
mod split;
mod suns;
mod techniques;

pub use at::PointSampler;
pub use builder::LightSamplerBuilder;
pub use lights::{LightSampler, LightSamplerView};
pub use mesh::{Mesh, Sides, TextureId, Weight};
