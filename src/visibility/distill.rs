//! From counts to factors: shares that got through, shrunk towards what is known of more.
//!
//! A report of a leaf counts for each lane on the way from the root to the leaf. The factor of a lane is the share of its
//! reports that got through, as if [`PRIOR`] further reports had come out as expected. What is expected is the factor of the
//! node itself, corrected by what the surrounding regions know: first a table is made of all reports of an orientation, then
//! of ever smaller groups of regions, each with the one before as its prior.

use alloc::vec::Vec;

use super::counts::{Counts, LeafKey, Record};
use super::regions::RegionBuilder;
use super::table::{Factors, ORIENTATIONS, Visibility, VisibilityHeader};
use super::{FEATURES, SKY};
use crate::tlas::{FACTORS as LANES, TlasView};

/// Number of reports that the expectation counts as.
///
/// *Measured* on `building` (docs/CONSTANTS.md). Larger: a lane needs more reports to differ from what surrounds it. Smaller:
/// few reports decide, and what they have missed by chance becomes noise.
const PRIOR: f32 = 2.0;

/// Levels of the tree over regions from one prior to the next. *Measured* on `building` (docs/CONSTANTS.md).
///
/// Larger: less time to publish, and a coarser prior. Smaller: the reverse.
const PRIOR_LEVELS: u32 = 2;

/// Least factor. A light that got through nowhere is still chosen this share as often as without a table.
///
/// *Measured* on `building` (docs/CONSTANTS.md). Larger: more samples of what is hidden. Smaller: what was missed while
/// learning is noisier, by the inverse.
const FLOOR: f32 = 1e-3;

/// Least gain of an entry, as a share of the reports of its region that would go to other lanes.
///
/// *Measured* on `building` (docs/CONSTANTS.md). Larger: a smaller table. Smaller: entries that change next to nothing.
const LEAST_GAIN: f32 = 2e-4;

/// A lane: its node's key, and its number.
type Slot = u64;

fn slot(key: u32, lane: u32) -> Slot {
    u64::from(key) << 4 | u64::from(lane)
}

fn key_of(slot: Slot) -> u32 {
    (slot >> 4) as u32
}

/// What was counted of a lane.
#[derive(Clone, Copy, Debug)]
struct Count {
    slot: Slot,
    reports: f32,
    asked: f32,
    seen: f32,
}

/// What is believed of the lanes of a group of regions, in order.
#[derive(Clone, Debug, Default)]
struct Beliefs {
    slots: Vec<(Slot, f32)>,
}

impl Beliefs {
    fn get(&self, slot: Slot) -> Option<f32> {
        let at = self.slots.binary_search_by_key(&slot, |(slot, _)| *slot).ok()?;
        Some(self.slots[at].1)
    }
}

/// An entry that may be kept.
struct Entry {
    region: u32,
    key: u32,
    factors: Factors,
    gain: f32,
}

/// Makes the table of all reports. `max_bytes` bounds the entries: those that gain least are left out.
pub(crate) fn distill(regions: &RegionBuilder, counts: &Counts, tlas: &TlasView<'_>, max_bytes: usize) -> Visibility {
    let mut entries = Vec::new();
    let distiller = Distiller { regions, starts: starts(regions.len(), counts.records()), counts, tlas };
    for root in 0..ORIENTATIONS {
        distiller.descend(root, None, &mut entries);
    }
    distiller.freeze(entries, max_bytes)
}

/// Returns the index of the first record of each region, and the number of all.
fn starts(regions: usize, records: &[Record]) -> Vec<usize> {
    (0..=regions).map(|region| records.partition_point(|record| (record.region as usize) < region)).collect()
}

struct Distiller<'a> {
    regions: &'a RegionBuilder,
    counts: &'a Counts,
    starts: Vec<usize>,
    tlas: &'a TlasView<'a>,
}

impl Distiller<'_> {
    /// Makes the entries of all regions below a node of the tree over regions.
    fn descend(&self, node: usize, prior: Option<&Beliefs>, entries: &mut Vec<Entry>) {
        let mut records = Vec::new();
        self.gather(node, &mut records);
        if records.is_empty() {
            return;
        }
        let counts = self.count(&mut records);
        let beliefs = self.believe(&counts, prior);
        match self.regions.halves(node) {
            Err(region) => self.add_entries(region, &counts, &beliefs, entries),
            Ok(_) => {
                let mut nodes = Vec::new();
                self.below(node, PRIOR_LEVELS, &mut nodes);
                for node in nodes {
                    self.descend(node, Some(&beliefs), entries);
                }
            }
        }
    }

    /// Appends the nodes so many levels below a node, or the regions above these.
    fn below(&self, node: usize, levels: u32, nodes: &mut Vec<usize>) {
        match self.regions.halves(node) {
            Ok(halves) if levels > 0 => halves.iter().for_each(|half| self.below(*half, levels - 1, nodes)),
            _ => nodes.push(node),
        }
    }

    /// Appends the records of all regions below a node.
    fn gather(&self, node: usize, records: &mut Vec<Record>) {
        match self.regions.halves(node) {
            Ok(halves) => halves.iter().for_each(|half| self.gather(*half, records)),
            Err(region) => {
                let region = region as usize;
                records.extend_from_slice(&self.counts.records()[self.starts[region]..self.starts[region + 1]]);
            }
        }
    }

    /// Counts reports by lanes.
    fn count(&self, records: &mut [Record]) -> Vec<Count> {
        records.sort_unstable_by_key(|record| record.leaf);
        let mut counts: Vec<Count> = Vec::new();
        let mut from = 0;
        while let Some(first) = records.get(from) {
            let mut sum = Record { reports: 0, asked: 0, seen: 0, ..*first };
            while let Some(record) = records.get(from).filter(|record| record.leaf == sum.leaf) {
                sum.add(record);
                from += 1;
            }
            let mut push = |key: u32, lane: u32| {
                let [reports, asked, seen] = [sum.reports, sum.asked, sum.seen].map(|count| count as f32);
                counts.push(Count { slot: slot(key, lane), reports, asked, seen });
            };
            let LeafKey(leaf) = sum.leaf;
            if leaf & SKY != 0 {
                let region = leaf & !SKY;
                push(SKY, 0);
                push(SKY + 1 + region / LANES as u32, region % LANES as u32);
            } else {
                self.tlas.visit_path(leaf & !FEATURES, |node, lane| push(node | leaf & FEATURES, lane));
            }
        }
        counts.sort_by_key(|count| count.slot);
        counts.dedup_by(|from, to| {
            let is_same = from.slot == to.slot;
            if is_same {
                to.reports += from.reports;
                to.asked += from.asked;
                to.seen += from.seen;
            }
            is_same
        });
        counts
    }

    /// Lane that leads to a node.
    fn parent(&self, key: u32) -> Option<Slot> {
        if key & SKY != 0 {
            return (key > SKY).then(|| slot(SKY, 0));
        }
        let (node, lane) = self.tlas.parent_of(key & !FEATURES)?;
        Some(slot(node | key & FEATURES, lane))
    }

    /// Shrinks the shares of all lanes, from the root downwards.
    fn believe(&self, counts: &[Count], prior: Option<&Beliefs>) -> Beliefs {
        let mut beliefs = Beliefs { slots: Vec::with_capacity(counts.len()) };
        for of_node in counts.chunk_by(|a, b| key_of(a.slot) == key_of(b.slot)) {
            let parent = self.parent(key_of(of_node[0].slot));
            let above = parent.and_then(|parent| beliefs.get(parent)).unwrap_or_else(|| share(of_node));
            let above_before = prior.and_then(|prior| prior.get(parent?));
            for count in of_node {
                let before = prior.and_then(|prior| prior.get(count.slot));
                let expected = match (before, above_before) {
                    (Some(before), Some(above_before)) => (before * (above / above_before)).min(1.0),
                    (Some(before), None) => before,
                    (None, _) => above,
                };
                let share = if count.asked > 0.0 { count.seen / count.asked } else { expected };
                let factor = (share * count.reports + PRIOR * expected) / (count.reports + PRIOR);
                beliefs.slots.push((count.slot, factor.clamp(FLOOR, 1.0)));
            }
        }
        beliefs
    }

    /// Makes the entries of a region.
    fn add_entries(&self, region: u32, counts: &[Count], beliefs: &Beliefs, entries: &mut Vec<Entry>) {
        let all: f32 = counts.iter().filter(|count| self.parent(key_of(count.slot)).is_none()).map(|c| c.asked).sum();
        let first = entries.len();
        let mut from = 0;
        for of_node in counts.chunk_by(|a, b| key_of(a.slot) == key_of(b.slot)) {
            let believed = &beliefs.slots[from..from + of_node.len()];
            from += of_node.len();
            let key = key_of(of_node[0].slot);
            let parent = self.parent(key);
            let above = parent.and_then(|parent| beliefs.get(parent)).unwrap_or_else(|| share(of_node));
            let mut factors = Factors([Factors::code(above); LANES]);
            let mut gain = 0.0;
            for (count, (slot, factor)) in of_node.iter().zip(believed) {
                factors.0[(slot % LANES as u64) as usize] = Factors::code(*factor);
                gain += count.asked * (factor - above).abs();
            }
            // The first entry says how much arrives at all.
            let gain = if parent.is_none() { f32::MAX } else { gain };
            entries.push(Entry { region, key, factors, gain });
        }
        // An entry is kept where one below it is.
        for i in (first..entries.len()).rev() {
            let Some(parent) = self.parent(entries[i].key) else { continue };
            let gain = entries[i].gain;
            let above = entries[first..].binary_search_by_key(&key_of(parent), |entry| entry.key);
            if let Ok(above) = above {
                let entry = &mut entries[first + above];
                entry.gain = entry.gain.max(gain);
            }
        }
        let least = LEAST_GAIN * all;
        let mut keep = first;
        for i in first..entries.len() {
            if entries[i].gain > least {
                entries.swap(keep, i);
                keep += 1;
            }
        }
        entries.truncate(keep);
    }

    /// Makes the table of the entries that gain most.
    fn freeze(&self, mut entries: Vec<Entry>, max_bytes: usize) -> Visibility {
        let limit = max_bytes / (size_of::<u32>() + size_of::<Factors>());
        if entries.len() > limit {
            entries.sort_by(|a, b| b.gain.total_cmp(&a.gain).then((a.region, a.key).cmp(&(b.region, b.key))));
            entries.truncate(limit);
        }
        entries.sort_by_key(|entry| (entry.region, entry.key));
        let mut numbers = alloc::vec![None; self.regions.len()];
        let mut starts = alloc::vec![0];
        for of_region in entries.chunk_by(|a, b| a.region == b.region) {
            numbers[of_region[0].region as usize] = Some(starts.len() as u32 - 1);
            starts.push(starts[starts.len() - 1] + of_region.len() as u32);
        }
        Visibility {
            header: VisibilityHeader { nodes: self.tlas.node_count() as u32, leaves: self.tlas.leaves.len() as u32 },
            regions: self.regions.freeze(|region| numbers[region as usize]),
            starts,
            keys: entries.iter().map(|entry| entry.key).collect(),
            factors: entries.iter().map(|entry| entry.factors).collect(),
        }
    }
}

/// Share that got through to all lanes of a node together.
fn share(counts: &[Count]) -> f32 {
    let (asked, seen) = counts.iter().fold((0.0, 0.0), |(asked, seen), c| (asked + c.asked, seen + c.seen));
    if asked > 0.0 { (seen / asked).max(FLOOR) } else { 1.0 }
}
