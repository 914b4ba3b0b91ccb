//! The facade that a host calls.

mod builder;
mod bytes;
mod emission;
mod finite;
mod lights;
mod many;
mod point;
mod refit;
mod resample;
mod visibility;

pub use builder::LightSamplerBuilder;
pub use emission::{Emission, EmissionSample};
pub use lights::{ByteSizes, LightSampler, LightSamplerView};
pub use point::PointSampler;
pub use resample::ResampledLight;
pub use visibility::{VisibilityCounters, VisibilityLearner};
