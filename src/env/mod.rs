//! The environment: a non-negative radiance over all directions.
//!
//! It is held as an equal-area image ([`crate::warp::equal_area`]) with its pyramid of means, ranges and 3x3
//! filtered means, and answers three questions: how bright a direction is, how bright a region of directions is
//! (conservatively, for portals), and which direction to trace.

mod build;
mod cone;
mod cones;
mod descend;
mod feature_blocks;
mod feature_clusters;
mod feature_sampling;
mod feature_texel;
mod feature_tree;
mod features;
mod image;
mod lanes;
mod lat_long;
mod pyramid;
mod regions;
mod resample;
mod rotation;
mod source;
#[cfg(test)]
mod tests;
mod validate;
mod view;
mod weighted;

pub(crate) use cone::DirectionCone;
pub use descend::EnvironmentSample;
pub(crate) use descend::step;
pub(crate) use feature_texel::FeatureTexel;
pub(crate) use feature_tree::FeatureNode;
pub use image::{EnvironmentImage, Poles};
pub(crate) use lanes::texel_of;
pub(crate) use regions::{REGION_DEPTH, REGIONS, RegionMoments, RegionSums, region_at, texel_cone, texel_solid_angle};
pub use view::{Environment, EnvironmentView};
pub(crate) use weighted::DirectionDistribution;

/// Largest radiance of a texel. What is brighter is refused. *Format*: loaded texels are checked against it.
///
/// Larger: sums and products of sampling could overflow. Smaller: more images are refused.
pub(crate) const MAX_RADIANCE: f32 = 1e30;

/// Smallest positive radiance of a texel. What is darker, but not black, is raised to it. *Format*: loaded texels are
/// checked against it.
///
/// Larger: dark images change. Smaller: means could underflow. Divided by the 2^26 texels of the largest image it is
/// still a normal number, so no mean of a region that holds a lit texel is zero.
pub(crate) const MIN_RADIANCE: f32 = 1e-30;

/// Base-2 logarithm of the largest number of texels a side. *Format*: deeper pyramids are refused.
///
/// Larger: indices of texels and the rounding of the map (2.5e-7) would no longer fit the texels, 1.2e-4 of the side.
/// Smaller: large images lose detail.
pub(crate) const MAX_PYRAMID_DEPTH: u32 = 13;
