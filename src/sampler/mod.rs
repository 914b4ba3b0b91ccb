//! The facade that a host calls.

mod at;
mod builder;
mod bytes;
mod direction;
mod emission;
mod energy;
mod forward;
mod lights;
mod many;
mod mesh;
mod pdf;
mod refit;
mod sample;
mod split;
mod suns;
mod techniques;

pub use at::PointSampler;
pub use builder::LightSamplerBuilder;
pub use emission::{Emission, EmissionSample};
pub use lights::{LightSampler, LightSamplerView};
pub use mesh::{Mesh, Sides, TextureId, Weight};
pub use refit::MeshUpdate;
