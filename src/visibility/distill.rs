//! From counts to factors: shares that got through, shrunk towards what is known of more.
//!
//! A report of a leaf counts for each lane on the way from the root to the leaf. The share `q` of a lane is the share
//! of its reports that got through, as if [`PRIOR`] further reports had come out as expected. What is expected is the
//! share of the node itself, corrected by what the surrounding regions know: first all reports of an orientation are
//! looked at, then those of ever smaller groups of regions, each with the group before as its prior.
//!
//! The factor is the *root* of the share. A light that gets through to a part `q` of a region, and whose unhidden
//! contribution is `f`, has the second moment `q f²` there. Over all lights, the expected square of the estimate
//! `Σ q f² / p` is least for `p` in proportion to `f √q`. The factor of a lane with lanes below it is the mean of
//! theirs, so that it says the same of a lamp behind a wall and one in the room as of both apart.

use alloc::vec::Vec;
use core::ops::Range;

use super::counts::{Counts, LeafKey, Record, UNIT};
use super::regions::RegionBuilder;
use super::table::{Factors, ORIENTATIONS, Visibility, VisibilityHeader};
use super::{FEATURES, SKY};
use crate::math;
use crate::tlas::{FACTORS as LANES, TlasView};

/// Number of reports that the expectation counts as.
///
/// *Measured* on `building` and `two-rooms` (docs/CONSTANTS.md). Larger: a lane needs more reports to differ from what
/// surrounds it. Smaller: few reports decide, and what they have missed by chance becomes noise.
const PRIOR: f32 = 8.0;

/// Levels of the tree over regions from one prior to the next. *Measured* on `building` (docs/CONSTANTS.md).
///
/// Larger: less time to publish, and a coarser prior. Smaller: the reverse.
const PRIOR_LEVELS: u32 = 2;

/// Least share. A light that got through nowhere is still chosen with the root of this, 0.7 %, of its weight without a
/// table.
///
/// *Measured* on `building` (docs/CONSTANTS.md). Larger: more samples of what is hidden. Smaller: what was missed while
/// learning is noisier, by the inverse of the root.
const FLOOR: f32 = 5e-5;

/// Least gain of an entry: the part of the samples of its region that the entry moves.
///
/// *Measured* on `building` (docs/CONSTANTS.md). Larger: a smaller table. Smaller: entries that change next to nothing.
const LEAST_GAIN: f32 = 5e-4;

/// Gain of the first entry of a region. *Chosen*: above all other gains times any number of reports, and finite when it
/// is multiplied by that number itself.
///
/// Larger: products overflow, and where even first entries are too many, those of busy regions are no longer kept first.
/// Smaller: other entries of busy regions come before the first ones of idle regions.
const FIRST_GAIN: f32 = 1e20;

/// Least number by which the entries of a region divide the expected square of an estimate: where all lights are seen
/// alike, entries are left out, since a call with a table costs about a tenth more than one without.
///
/// *Measured* (docs/CONSTANTS.md). Larger: more regions work as without a table. Smaller: more calls pay for a table
/// that gains nothing.
const LEAST_SAVING: f32 = 1.02;

/// Mean factor from which on a region may be without entries. *Chosen*: below it, distant lights and the environment,
/// which compete with the lights of the tree, need to know that these are hidden.
///
/// Larger: more regions have entries. Smaller: lights that are all hidden take samples from what is seen.
const SEEN: f32 = 0.9;

/// Number of reports that the prior counts as of how often lanes are asked about. *Measured* on `building`
/// (docs/CONSTANTS.md).
///
/// Larger: factors of clusters are means over what a larger group of regions asks about. Smaller: over few reports.
const PRIOR_MASS: f32 = 32.0;

/// Least part of all reports, or of the samples that the table leads to, from which on a lane is told apart from its
/// siblings. *Measured* on `building` (docs/CONSTANTS.md).
///
/// Larger: faster to publish, and small lights are taken together. Smaller: the reverse.
const LEAST_MASS: f32 = 2e-4;

/// A lane: its node's key, and its number.
type LaneKey = u64;

fn slot(key: u32, lane: u32) -> LaneKey {
    u64::from(key) << 4 | u64::from(lane)
}

fn key_of(slot: LaneKey) -> u32 {
    (slot >> 4) as u32
}

/// What was counted of a lane, in units of one report.
#[derive(Clone, Copy, Debug)]
struct Count {
    slot: LaneKey,
    squares: f32,
    asked: f32,
    seen: f32,
}

impl Count {
    /// Number of reports of equal weight that say as much (Kish 1965).
    fn reports(&self) -> f32 {
        if self.squares > 0.0 { self.asked * self.asked / self.squares } else { 0.0 }
    }
}

/// What is believed of the lanes of a group of regions, in order.
#[derive(Clone, Debug, Default)]
struct Beliefs {
    slots: Vec<Belief>,
}

/// What is believed of a lane.
#[derive(Clone, Copy, Debug)]
struct Belief {
    slot: LaneKey,
    /// How often it is asked about, relative to all that is.
    mass: f32,
    /// Share of what is sent that gets through.
    share: f32,
    /// Factor of the weight.
    factor: f32,
}

impl Beliefs {
    fn get(&self, slot: LaneKey) -> Option<&Belief> {
        let at = self.slots.binary_search_by_key(&slot, |belief| belief.slot).ok()?;
        Some(&self.slots[at])
    }

    /// The lanes of each node.
    fn nodes(&self) -> impl DoubleEndedIterator<Item = &[Belief]> {
        self.slots.chunk_by(|a, b| key_of(a.slot) == key_of(b.slot))
    }
}

/// An entry that may be kept.
struct FactorEntry {
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
    fn descend(&self, node: usize, prior: Option<&Beliefs>, entries: &mut Vec<FactorEntry>) {
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

    /// Appends the nodes `levels` levels below a node, or the regions above these.
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
            // Wider than records: those of many regions together may exceed what one of them holds.
            let (LeafKey(leaf), mut sums) = (first.leaf, [0u64; 3]);
            while let Some(record) = records.get(from).filter(|record| record.leaf == LeafKey(leaf)) {
                let more = [record.squares, record.asked, record.seen];
                sums.iter_mut().zip(more).for_each(|(sum, more)| *sum += u64::from(more));
                from += 1;
            }
            let mut push = |key: u32, lane: u32| {
                let [squares, asked, seen] = sums.map(|sum| sum as f32 * (1.0 / UNIT));
                counts.push(Count { slot: slot(key, lane), squares, asked, seen });
            };
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
                to.squares += from.squares;
                to.asked += from.asked;
                to.seen += from.seen;
            }
            is_same
        });
        counts
    }

    /// Lane that leads to a node.
    fn parent(&self, key: u32) -> Option<LaneKey> {
        if key & SKY != 0 {
            return (key > SKY).then(|| slot(SKY, 0));
        }
        let (node, lane) = self.tlas.parent_of(key & !FEATURES)?;
        Some(slot(node | key & FEATURES, lane))
    }

    /// Forms beliefs from counts and from those of a larger group of regions.
    fn believe(&self, counts: &[Count], prior: Option<&Beliefs>) -> Beliefs {
        let all = self.asked(counts);
        let mut beliefs = Beliefs { slots: union(counts, prior) };
        for lanes in self.downwards(&beliefs.slots, |belief| key_of(belief.slot)) {
            let key = key_of(beliefs.slots[lanes.start].slot);
            let start = counts.partition_point(|count| key_of(count.slot) < key);
            let of_node = counts[start..].chunk_by(|a, b| key_of(a.slot) == key_of(b.slot)).next().unwrap_or(&[]);
            let is_counted = of_node.first().is_some_and(|count| key_of(count.slot) == key);
            self.shrink(&mut beliefs, lanes, if is_counted { of_node } else { &[] }, all, prior);
        }
        // Lanes that are rarely asked about count if they are most of what gets through.
        let is_first = |belief: &&Belief| self.parent(key_of(belief.slot)).is_none();
        let chosen: f32 = beliefs.slots.iter().filter(is_first).map(|belief| belief.mass * belief.factor).sum();
        beliefs.slots.retain(|belief| belief.mass.max(belief.mass * belief.factor / chosen) >= LEAST_MASS);
        // The factor of a lane is the mean over what is below it, from the leaves upwards.
        for lanes in self.downwards(&beliefs.slots, |belief| key_of(belief.slot)).into_iter().rev() {
            let Some(parent) = self.parent(key_of(beliefs.slots[lanes.start].slot)) else { continue };
            let mean = mean_factor(&beliefs.slots[lanes]);
            if let Ok(at) = beliefs.slots.binary_search_by_key(&parent, |belief| belief.slot) {
                beliefs.slots[at].factor = mean;
            }
        }
        beliefs
    }

    /// Returns the ranges of equal keys, those of nodes nearer to the root first: edits reuse numbers of nodes, so that
    /// a child's may be below its parent's.
    fn downwards<T>(&self, sorted: &[T], key: impl Fn(&T) -> u32) -> Vec<Range<usize>> {
        let mut start = 0;
        let ranges = sorted.chunk_by(|a, b| key(a) == key(b)).map(|chunk| {
            start += chunk.len();
            start - chunk.len()..start
        });
        let mut ranges: Vec<_> = ranges.collect();
        ranges.sort_by_cached_key(|range| self.depth(key(&sorted[range.start])));
        ranges
    }

    /// Number of nodes above a node.
    fn depth(&self, key: u32) -> usize {
        core::iter::successors(self.parent(key), |above| self.parent(key_of(*above))).count()
    }

    /// Forms the beliefs of one node's lanes, those above being known: shares that got through, shrunk towards what is
    /// expected. `all` is the number of reports.
    fn shrink(&self, beliefs: &mut Beliefs, lanes: Range<usize>, counts: &[Count], all: f32, prior: Option<&Beliefs>) {
        let Some(first) = beliefs.slots.get(lanes.start) else { return };
        let parent = self.parent(key_of(first.slot));
        let above = parent.and_then(|parent| beliefs.get(parent)).map_or_else(|| share(counts), |above| above.share);
        let above_before = prior.and_then(|prior| Some(prior.get(parent?)?.share));
        let prior_mass = if prior.is_some() { PRIOR_MASS } else { 0.0 };
        let mut counts = counts.iter().peekable();
        for belief in &mut beliefs.slots[lanes] {
            let before = prior.and_then(|prior| prior.get(belief.slot));
            let expected = match (before, above_before) {
                (Some(before), Some(above_before)) => (before.share * (above / above_before)).min(1.0),
                (Some(before), None) => before.share,
                (None, _) => above,
            };
            let mut mass = prior_mass * before.map_or(0.0, |before| before.mass);
            belief.share = expected;
            if let Some(count) = counts.next_if(|count| count.slot == belief.slot) {
                let reports = count.reports();
                belief.share = (count.seen / count.asked * reports + PRIOR * expected) / (reports + PRIOR);
                mass += count.asked;
            }
            belief.share = belief.share.clamp(FLOOR, 1.0);
            belief.factor = math::sqrt(belief.share);
            belief.mass = mass / (all + prior_mass);
        }
    }

    /// Number of reports by the lanes of all roots.
    fn asked(&self, counts: &[Count]) -> f32 {
        counts.iter().filter(|count| self.parent(key_of(count.slot)).is_none()).map(|count| count.asked).sum()
    }

    /// Whether entries are worth their time. The expected square of an estimate is divided by one plus the relative
    /// variance of the factors of all lanes without lanes below them, by how often they are asked about.
    fn pays(&self, beliefs: &Beliefs) -> bool {
        let mut above: Vec<LaneKey> = beliefs.nodes().filter_map(|lanes| self.parent(key_of(lanes[0].slot))).collect();
        above.sort_unstable();
        let last = beliefs.slots.iter().filter(|belief| above.binary_search(&belief.slot).is_err());
        let [mass, share, factor] = last.fold([0.0; 3], |[mass, share, factor], b| {
            [mass + b.mass, share + b.mass * b.share, factor + b.mass * b.factor]
        });
        mass * share >= LEAST_SAVING * factor * factor || factor < SEEN * mass
    }

    /// Makes the entries of a region.
    fn add_entries(&self, region: u32, counts: &[Count], beliefs: &Beliefs, entries: &mut Vec<FactorEntry>) {
        if !self.pays(beliefs) {
            return;
        }
        let all = self.asked(counts);
        let first = entries.len();
        for of_node in beliefs.nodes() {
            let key = key_of(of_node[0].slot);
            let parent = self.parent(key);
            let above = parent.and_then(|parent| beliefs.get(parent));
            let above = above.map_or_else(|| mean_factor(of_node), |above| above.factor);
            let mut factors = Factors([Factors::code(above); LANES]);
            let mut gain = 0.0;
            for Belief { slot, mass, factor, .. } in of_node {
                factors.0[(slot % LANES as u64) as usize] = Factors::code(*factor);
                gain += mass * (factor - above).abs();
            }
            // The first entry says how much arrives at all.
            let gain = if parent.is_none() { FIRST_GAIN } else { gain };
            entries.push(FactorEntry { region, key, factors, gain });
        }
        // An entry is kept where one below it is.
        for range in self.downwards(&entries[first..], |entry| entry.key).into_iter().rev() {
            let FactorEntry { key, gain, .. } = entries[first + range.start];
            let Some(parent) = self.parent(key) else { continue };
            let above = entries[first..].binary_search_by_key(&key_of(parent), |entry| entry.key);
            if let Ok(above) = above {
                let entry = &mut entries[first + above];
                entry.gain = entry.gain.max(gain);
            }
        }
        let mut keep = first;
        for i in first..entries.len() {
            if entries[i].gain > LEAST_GAIN {
                entries.swap(keep, i);
                entries[keep].gain *= all;
                keep += 1;
            }
        }
        entries.truncate(keep);
    }

    /// Makes the table of the entries that gain most.
    fn freeze(&self, mut entries: Vec<FactorEntry>, max_bytes: usize) -> Visibility {
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

/// Mean factor of the lanes of a node, weighted by how often each is asked about.
fn mean_factor(beliefs: &[Belief]) -> f32 {
    let (sum, mass) = beliefs.iter().fold((0.0, 0.0), |(sum, mass), b| (sum + b.mass * b.factor, mass + b.mass));
    if mass > 0.0 { sum / mass } else { 1.0 }
}

/// Returns the lanes of which there are counts or a prior, in order.
fn union(counts: &[Count], prior: Option<&Beliefs>) -> Vec<Belief> {
    let prior = prior.map_or(&[][..], |prior| &prior.slots);
    let all = counts.iter().map(|count| count.slot).chain(prior.iter().map(|belief| belief.slot));
    let mut slots: Vec<Belief> = all.map(|slot| Belief { slot, mass: 0.0, share: 1.0, factor: 1.0 }).collect();
    slots.sort_unstable_by_key(|belief| belief.slot);
    slots.dedup_by_key(|belief| belief.slot);
    slots
}
