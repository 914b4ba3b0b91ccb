//! Places of an array that nothing refers to, so that edits reuse them.

use alloc::vec::Vec;

use crate::tlas::arity::MAX_LANES;

/// Free places of an array, in blocks of neighbors that are as long as the children of a node may be.
#[derive(Clone, Default)]
pub(super) struct FreeBlocks {
    /// First places of the blocks, by their lengths less one.
    by_length: [Vec<u32>; MAX_LANES],
    count: usize,
}

crate::buffers::debug_counts!(FreeBlocks, blocks => {
    count: blocks.count,
});

impl FreeBlocks {
    /// Returns the number of all free places.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Takes a block of this length from the shortest that is long enough; `None` if there is none. What is left of it
    /// stays free.
    pub(super) fn take(&mut self, length: usize) -> Option<usize> {
        let found = (length..=MAX_LANES).find(|found| !self.by_length[found - 1].is_empty())?;
        let first = self.by_length[found - 1].pop()? as usize;
        self.count -= found;
        self.add(first + length, found - length);
        Some(first)
    }

    /// Adds a block.
    pub(super) fn add(&mut self, first: usize, length: usize) {
        if length > 0 {
            self.by_length[length - 1].push(first as u32);
            self.count += length;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_reused_and_divided() {
        let mut free = FreeBlocks::default();
        assert_eq!(free.take(1), None);
        free.add(10, 5);
        free.add(20, 2);
        free.add(30, 0);
        assert_eq!((free.count(), free.take(6)), (7, None));
        assert_eq!((free.take(2), free.take(3), free.take(2), free.take(1)), (Some(20), Some(10), Some(13), None));
        assert_eq!(free.count(), 0);
    }
}
