//! The plain records that a host passes in and gets back.

mod ids;
mod image;
mod sample;

pub use ids::{InstanceId, LightId, MeshId, ObjectId, ProfileId, TextureId, TriangleId};
pub use image::{Filter, Wrap};
pub use sample::{Hit, LightSample, SampledLight};
