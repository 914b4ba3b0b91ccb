//! Numbers of what can be removed, which are then given out again.

use alloc::collections::BTreeSet;

/// Numbers from 0 on, some of which are free.
#[derive(Clone)]
pub(super) struct Numbers {
    count: u32,
    free: BTreeSet<u32>,
}

crate::buffers::debug_counts!(Numbers, numbers => {
    count: numbers.count,
    free: numbers.free.len(),
});

impl Numbers {
    /// Returns the numbers below `count`, all in use.
    pub(super) fn new(count: u32) -> Self {
        Self { count, free: BTreeSet::new() }
    }

    /// Returns how many numbers there are, with those that are free.
    pub(super) fn count(&self) -> u32 {
        self.count
    }

    /// Whether a number is in use.
    pub(super) fn contains(&self, number: u32) -> bool {
        number < self.count && !self.free.contains(&number)
    }

    /// Returns the least free number from one on; without any, that one or the first that has never been in use.
    pub(super) fn next(&self, from: u32) -> u32 {
        self.free.range(from..).next().copied().unwrap_or(from.max(self.count))
    }

    /// Puts a number in use.
    pub(super) fn insert(&mut self, number: u32) {
        self.free.remove(&number);
        (self.count..number).for_each(|skipped| _ = self.free.insert(skipped));
        self.count = self.count.max(number + 1);
    }

    /// Frees a number.
    pub(super) fn remove(&mut self, number: u32) {
        self.insert(number);
        self.free.insert(number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn free_numbers_come_first() {
        let mut numbers = Numbers::new(3);
        assert!(numbers.contains(2) && !numbers.contains(3));
        assert_eq!(numbers.next(0), 3);
        numbers.remove(1);
        assert!(!numbers.contains(1));
        assert_eq!((numbers.next(0), numbers.next(2)), (1, 3));
        numbers.insert(5);
        assert_eq!((numbers.next(0), numbers.next(2), numbers.next(5), numbers.count()), (1, 3, 6, 6));
        numbers.insert(1);
        assert!(numbers.contains(1) && numbers.contains(5) && !numbers.contains(4));
    }
}
