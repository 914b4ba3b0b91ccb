//! Sampling techniques that know of all lights and of the environment at once.

mod features;

pub(crate) use features::{FeaturePart, FeatureView};
