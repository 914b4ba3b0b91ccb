//! The environment: a non-negative radiance over all directions.
//!
//! It is held as an equal-area image ([`crate::warp::equal_area`]) with its pyramid of means, ranges and 3x3
//! filtered means, and answers three questions: how bright a direction is, how bright a region of directions is
//! (conservatively, for portals), and which direction to trace.

mod balls;
mod build;
mod clipped_square;
mod descend;
mod directions;
mod footprint;
mod lat_long;
mod opening;
mod parts;
mod pyramid;
mod resample;
mod rotation;
mod source;
mod suns;
#[cfg(test)]
mod tests;
mod texel;
mod view;

pub use build::Environment;
pub use descend::EnvironmentSample;
pub(crate) use directions::Directions;
pub(crate) use footprint::Footprint;
pub(crate) use opening::{Cover, Opening};
pub use parts::EnvironmentParts;
pub(crate) use suns::MAX_SUNS;
pub use suns::Sun;
pub use texel::SunTexel;
pub use view::{EnvironmentHeader, EnvironmentView};

/// Largest radiance of a texel. What is brighter is refused.
///
/// It leaves room for the sums and products that sampling forms.
pub(crate) const BRIGHTEST: f32 = 1e30;

/// Smallest positive radiance of a texel. What is darker, but not black, is raised to it.
///
/// Divided by the 2^26 texels of the largest image it is still a normal number: no mean of a region that holds
/// a lit texel can underflow to zero.
pub(crate) const DARKEST: f32 = 1e-30;

/// Base-2 logarithm of the largest number of texels a side.
pub(crate) const MAX_DEPTH: u32 = 13;
