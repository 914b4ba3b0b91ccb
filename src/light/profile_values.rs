//! What the tables of profiles and of projections have in common: one collection, and shares that are added up.

use alloc::vec::Vec;

/// Values in front of a table: numbers of vertical and horizontal angles, mean intensity, and largest vertical angle at
/// which anything is sent. *Format.*
pub(super) const TABLE_HEADER: usize = 4;

/// Widening of the largest vertical angle, in radians. *Proved*: covers the rounding of angles to single precision,
/// 2e-7. A larger one culls less.
pub(super) const REACH_MARGIN: f32 = 1e-6;

/// Least share of a cell among all cells of a profile, of a row of a projection among all rows, and of a texel in its
/// row, if it is lit. *Proved*: above the rounding of sums up to 1 to single precision, 6e-8, also where shares of the
/// most cells of a profile add up to 2, so that nothing that is lit is without a share.
///
/// Larger: more rays from what is dark.
pub(super) const LEAST_LIT_SHARE: f64 = 2.4e-7;

/// All profiles of a scene on their way into a sampler.
#[derive(Debug, Default)]
pub(super) struct ProfileCollection {
    pub(super) starts: Vec<u32>,
    pub(super) values: Vec<f32>,
}

impl ProfileCollection {
    /// Returns starts and values, as words.
    pub(super) fn arrays(&self) -> [&[u32]; 2] {
        [&self.starts, bytemuck::cast_slice(&self.values)]
    }
}

/// Appends the shares of these powers, added up; of what is lit, none is so small that it vanishes.
pub(super) fn push_sums(values: &mut Vec<f32>, powers: impl Iterator<Item = f64> + Clone) {
    let total: f64 = powers.clone().sum();
    let share = |power: f64| if power > 0.0 { (power / total).max(LEAST_LIT_SHARE) } else { 0.0 };
    let all: f64 = powers.clone().map(share).sum();
    let mut sum = 0.0;
    for power in powers {
        sum += share(power);
        values.push(if all > 0.0 { (sum / all).min(1.0) as f32 } else { 0.0 });
    }
}
