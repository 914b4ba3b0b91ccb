//! Reports in integers: sums do not depend on their order.

use alloc::vec::Vec;

use super::{FEATURES, SKY};

/// What a report is about: a leaf of the light tree, a leaf as far as it shows a bright feature, or a region of the
/// environment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct LeafKey(pub(crate) u32);

impl LeafKey {
    pub(crate) const fn leaf(leaf: u32) -> Self {
        Self(leaf)
    }

    pub(crate) const fn feature(leaf: u32) -> Self {
        Self(leaf | FEATURES)
    }

    pub(crate) const fn sky(region: u32) -> Self {
        Self(region | SKY)
    }
}

/// Units of a weight of one. *Chosen*: finer than the noise of any share.
///
/// Larger: sums saturate earlier, at 2^32 of these. Smaller: weights are rounded.
pub(crate) const UNIT: f32 = 64.0;

/// Largest weight of a report. *Chosen*: one report stands for this many at most.
///
/// Larger: single reports speak too loud. Smaller: what a table already hides is overrated.
const MAX_WEIGHT: f32 = 4.0;

/// All reports of one leaf in one region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Record {
    pub(crate) region: u32,
    pub(crate) leaf: LeafKey,
    /// Sum of the squares of the weights of all reports, in units.
    pub(crate) squares: u32,
    /// Sum of the weights, and of the weights times the transmittances, in units.
    pub(crate) asked: u32,
    pub(crate) seen: u32,
}

impl Record {
    fn key(&self) -> (u32, LeafKey) {
        (self.region, self.leaf)
    }

    /// Adds another record. Saturating sums of what is not negative do not depend on the order.
    pub(crate) fn add(&mut self, other: &Self) {
        self.squares = self.squares.saturating_add(other.squares);
        self.asked = self.asked.saturating_add(other.asked);
        self.seen = self.seen.saturating_add(other.seen);
    }

    /// Returns the same with a fourth of the counts.
    pub(crate) fn faded(self, region: u32) -> Self {
        Self { region, squares: self.squares / 4, asked: self.asked / 4, seen: self.seen / 4, ..self }
    }
}

/// A collection of reports.
#[derive(Clone, Default, PartialEq)]
pub(crate) struct Counts {
    /// Up to `sorted`, in order and one for each key; then as they came.
    records: Vec<Record>,
    sorted: usize,
}

crate::buffers::debug_counts!(Counts, counts => {
    records: counts.records.len(),
    sorted: counts.sorted,
});

impl Counts {
    /// Least number of records that are sorted. *Chosen*: a few pages.
    const LEAST: usize = 1 << 12;

    /// Adds one report: the transmittance in `[0, 1]`, and how often the light is asked about without a table relative
    /// to how often it was.
    pub(crate) fn report(&mut self, region: u32, leaf: LeafKey, transmittance: f32, weight: f32) {
        let weight = crate::math::limit(weight, MAX_WEIGHT);
        let asked = ((weight * UNIT + 0.5) as u32).max(1);
        let seen = (crate::math::limit(transmittance, 1.0) * asked as f32 + 0.5) as u32;
        let squares = ((weight * weight * UNIT + 0.5) as u32).max(1);
        self.push(Record { region, leaf, squares, asked, seen: seen.min(asked) });
    }

    pub(crate) fn push(&mut self, record: Record) {
        self.records.push(record);
        if self.records.len() >= (2 * self.sorted).max(Self::LEAST) {
            self.sort();
        }
    }

    /// Adds all of another collection.
    pub(crate) fn merge(&mut self, other: &Self) {
        self.records.extend_from_slice(&other.records);
        self.sort();
    }

    /// Sorts all records, and makes one of those with the same key.
    pub(crate) fn sort(&mut self) {
        self.records.sort_unstable_by_key(Record::key);
        self.records.dedup_by(|from, to| {
            let is_same = from.key() == to.key();
            if is_same {
                to.add(from);
            }
            is_same
        });
        self.sorted = self.records.len();
    }

    /// Returns all records, as [`Self::sort`] has left them.
    pub(crate) fn records(&self) -> &[Record] {
        &self.records
    }

    /// Replaces all records.
    pub(crate) fn replace(&mut self, records: Vec<Record>) {
        self.records = records;
        self.sort();
    }

    /// Number of bytes that the records take.
    pub(crate) fn bytes(&self) -> usize {
        self.records.capacity() * size_of::<Record>()
    }
}
