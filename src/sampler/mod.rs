//! The facade that a host calls.

mod builder;
mod bytes;
mod direction;
mod energy;
mod lights;
mod mesh;
mod pdf;
mod refit;
mod sample;
mod split;
mod suns;

pub use builder::LightSamplerBuilder;
pub use lights::{LightSampler, LightSamplerView};
pub use mesh::{Mesh, Sides, TextureId, Weight};
pub use refit::MeshUpdate;
