//! Checks of a table that comes from outside, after which no lookup can leave it or go round in circles.

use super::table::{NOTHING, ORIENTATIONS, REGION, VisibilityView};
use crate::error::Error;

impl VisibilityView<'_> {
    /// Checks that the trees over regions lead forward and end in regions, and that the entries of each region are in
    /// order. Every factor is good.
    pub(super) fn validate(&self) -> Result<(), Error> {
        let Some((&end, _)) = self.starts.split_last() else {
            return Err(Error::bytes("starts of regions", 0, 0, 1));
        };
        Error::unless_equal("number of factors", self.factors.len(), self.keys.len())?;
        Error::unless_equal("end of the last region", end as usize, self.keys.len())?;
        if self.regions.len() < ORIENTATIONS {
            return Err(Error::bytes("nodes over regions", 0, self.regions.len(), ORIENTATIONS));
        }
        let count = self.starts.len() - 1;
        for (index, node) in self.regions.iter().enumerate() {
            let first = node.first as usize;
            match node.kind {
                0..=2 if node.plane.is_nan() => {
                    return Err(Error::bytes("plane between regions", index, node.plane.to_bits(), 0u64));
                }
                0..=2 if first <= index || first >= self.regions.len() - 1 => {
                    return Err(Error::bytes("child of a node over regions", index, first, index + 1));
                }
                REGION if first >= count => return Err(Error::bytes("region", index, first, count)),
                0..=NOTHING => {}
                kind => return Err(Error::bytes("kind of a node over regions", index, kind, NOTHING)),
            }
        }
        for (region, ends) in self.starts.windows(2).enumerate() {
            let keys = self.keys.get(ends[0] as usize..ends[1] as usize);
            let Some(keys) = keys else {
                return Err(Error::bytes("start of a region", region, ends[0], ends[1]));
            };
            if let Some(at) = keys.windows(2).position(|pair| pair[0] >= pair[1]) {
                return Err(Error::bytes("key in order", ends[0] as usize + at, keys[at], keys[at + 1]));
            }
        }
        Ok(())
    }
}
