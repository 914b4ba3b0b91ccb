//! The facade that a host calls.

mod builder;
mod bytes;
mod credit;
mod distant_rays;
mod edit;
mod emission;
mod emission_sample;
mod finite;
mod lights;
mod many;
mod point;
mod refit;
mod resample;
mod segment;
mod visibility;

pub use builder::LightSamplerBuilder;
pub use edit::LightEdits;
pub use emission::Emission;
pub use emission_sample::EmissionSample;
pub use lights::{ByteSizes, LightSampler, LightSamplerView};
pub use point::PointSampler;
pub use resample::ResampledLight;
pub use segment::{RaySegment, SegmentSample, SegmentSampler};
pub use visibility::{VisibilityCounters, VisibilityLearner};
