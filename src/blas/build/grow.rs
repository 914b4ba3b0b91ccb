//! Divides a triangle's cells from the top, one level at a time.

use alloc::vec::Vec;

use crate::blas::barycentric::{ARITY, LatticeCell};
use crate::blas::build::touched::TexelRange;
use crate::blas::node::{CellNode, LEAF, Root, append, end, storable};
use crate::error::{Error, ErrorKind};
use crate::parallel;

/// From this number of cells on, they are measured side by side.
///
/// A budget of time: no result depends on it.
const WORTHWHILE_CELLS: usize = 256;

/// Relative variance of sampling inside a cell from which dividing it is worth memory beyond the usual.
///
/// Chosen between two cases, not swept: the cells of grid-10000's clip map of 400² texels have 3, and those of noise
/// have less than 1.
///
/// Larger: sharp edges stay inside of cells, and samples miss the openings. Smaller: noise takes twice the memory for
/// little.
const WORTHWHILE_VARIANCE: f64 = 1.5;

/// Relative variance that cells that are black in part may leave before they take memory beyond all else
/// ([`GrowthLimits::rescue`]).
///
/// *Measured* on the clip map of grid-10000 (docs/ACCURACY.md, "Memory of textures"). Larger: more samples go
/// astray between narrow openings. Smaller: more memory for edges that cost little.
const RESCUE_VARIANCE: f64 = 0.1;

/// Ratio of a cell's average to its largest weight up to which it does not count as black in part. *Chosen*, far above the
/// rounding of averages: cells that end where texels do may touch the next texel.
///
/// Larger: thin slices of openings are left inside of cells. Smaller: memory for what rounding shows.
const LEAST_AVERAGE: f64 = 1.0 / 256.0;

/// The weights over a triangle.
pub(crate) trait WeightSource: Sync {
    /// What may be wrong with them.
    type Fault: Send;

    /// What they all are over a cell, if they are all the same.
    fn constant(&self, cell: LatticeCell) -> Result<Option<f32>, Self::Fault>;

    /// Their ends and their average over a cell.
    fn measure(&self, cell: LatticeCell) -> Result<(TexelRange, f32), Self::Fault>;

    /// Their variance over a small cell, as a share of what two values at the ends of its range would have.
    fn spread(&self) -> f64;
}

/// How far a tree may grow.
pub(crate) struct GrowthLimits {
    /// Most nodes; one at least.
    pub(crate) nodes: usize,
    /// How many more there may be below cells that are not fine, if sampling inside of them has at least the relative
    /// variance [`WORTHWHILE_VARIANCE`].
    pub(crate) worthwhile: usize,
    /// How many more there may be below cells that are black in part, as long as what sampling inside of them adds to the
    /// relative variance is above [`RESCUE_VARIANCE`].
    pub(crate) rescue: usize,
    /// From this level on, cells are fine: there must be a reason to divide them.
    pub(crate) fine: u32,
    /// Cells of this level are not divided.
    pub(crate) deepest: u32,
    /// Fine cells of a level are divided until what the contrast of the others adds to the relative variance is below
    /// this.
    pub(crate) variance: f64,
}

/// A tree before it is packed.
pub(crate) struct GrownTree {
    /// That of the whole triangle.
    pub(crate) average: f32,
    /// Those of all cells, node by node, breadth first.
    pub(crate) averages: Vec<f32>,
    /// Which cells have a node below, in the same order. The first such cell has the second node, and so on.
    pub(crate) divided: Vec<bool>,
    /// Nodes of [`GrowthLimits::rescue`] among them.
    pub(crate) rescued: usize,
}

impl GrownTree {
    /// One weight for the whole triangle.
    pub(super) fn constant(average: f32) -> Self {
        Self { average, averages: Vec::new(), divided: Vec::new(), rescued: 0 }
    }

    /// Number of nodes.
    pub(super) fn nodes(&self) -> usize {
        self.divided.len() / ARITY
    }

    /// Adds the tree to the pool. Returns its root and the bytes that it takes.
    pub(super) fn store(&self, pool: &mut Vec<CellNode>) -> Result<(Root, f64), Error> {
        if self.divided.is_empty() || self.average == 0.0 {
            return Ok((Root::constant(self.average), 0.0));
        }
        let count = end(pool, self.divided.len() / ARITY);
        if count >= LEAF as usize {
            return Err(Error(ErrorKind::TooMany { what: "BLAS nodes", count, limit: LEAF as usize }));
        }
        let bytes = self.averages.len() / ARITY * size_of::<CellNode>();
        Ok((Root { average: self.average, node: append(pool, &self.averages, &self.divided) }, bytes as f64))
    }
}

/// A cell of which it is not yet known whether it is divided.
struct OpenCell {
    cell: LatticeCell,
    /// Its place in the tree.
    at: usize,
    /// What is known of a fine cell.
    measured: Option<MeasuredCell>,
}

/// A cell that could be a leaf.
#[derive(Clone, Copy)]
struct MeasuredCell {
    average: f32,
    /// Estimate of what its contrast adds to the variance, for a cell of unit area.
    variance: f64,
    /// Whether it is black in part, and not all but for what rounding shows.
    has_black: bool,
}

/// What is found below a divided cell.
#[derive(Clone, Copy)]
enum FoundChild {
    /// A cell over which lookups are all the same.
    Constant(f32),
    /// A cell that may be divided, measured if it is fine.
    Open(Option<MeasuredCell>),
}

/// Grows the tree of a triangle in which lookups are not all the same. It has no nodes if none is worth it.
pub(crate) fn grow<S: WeightSource>(source: &S, limits: &GrowthLimits) -> Result<GrownTree, S::Fault> {
    // The whole triangle stands in front, as the only cell of a node before the first.
    let (averages, divided) = (alloc::vec![0.0], alloc::vec![false]);
    let mut growing = TreeGrowth { source, averages, divided, mass: 0.0, rescued: 0 };
    let mut open = alloc::vec![OpenCell { cell: LatticeCell::whole(), at: 0, measured: None }];
    let (mut nodes, mut level, mut share) = (0, 0, 1.0);
    while !open.is_empty() {
        let is_deepest = level == limits.deepest;
        let room = [limits.nodes, limits.nodes + limits.worthwhile]
            .map(|most| if is_deepest { 0 } else { most.saturating_sub(nodes) });
        let spare = (level >= limits.fine).then_some(limits.variance);
        let rescue = if is_deepest { 0 } else { limits.rescue - growing.rescued };
        open = growing.choose(open, room, rescue, spare, share)?;
        nodes += open.len();
        level += 1;
        share /= ARITY as f64;
        open = growing.divide(open, level >= limits.fine, share)?;
    }
    Ok(growing.finish())
}

/// The number of nodes that bytes hold.
pub(super) fn nodes_in(bytes: f64) -> usize {
    (bytes / size_of::<CellNode>() as f64) as usize
}

/// Orders cells, each with its variance and its number, from the largest variance on.
fn by_variance(a: &(f64, u32), b: &(f64, u32)) -> core::cmp::Ordering {
    b.0.total_cmp(&a.0).then(a.1.cmp(&b.1))
}

/// Sorts cells that there is no room for, those with black that vary most in front, and returns how many of the first are
/// divided all the same, at most `most`, so that the others with black add no more than [`RESCUE_VARIANCE`].
fn rescued(
    beyond: &mut [(f64, u32)],
    has_black: impl Fn(&(f64, u32)) -> bool,
    most: usize,
    share: f64,
    mass: f64,
) -> usize {
    let mut left = share * beyond.iter().filter(|cell| has_black(cell)).map(|(variance, _)| variance).sum::<f64>();
    if most == 0 || left <= RESCUE_VARIANCE * mass {
        return 0;
    }
    beyond.sort_unstable_by(|a, b| has_black(b).cmp(&has_black(a)).then(by_variance(a, b)));
    let is_needed = |cell: &&(f64, u32)| {
        let is_needed = left > RESCUE_VARIANCE * mass && has_black(cell);
        left -= share * cell.0;
        is_needed
    };
    beyond.iter().take(most).take_while(is_needed).count()
}

struct TreeGrowth<'a, S> {
    source: &'a S,
    averages: Vec<f32>,
    divided: Vec<bool>,
    /// The integral over all leaves so far, for a triangle of unit area.
    mass: f64,
    /// Nodes of [`GrowthLimits::rescue`] so far.
    rescued: usize,
}

impl<S: WeightSource> TreeGrowth<'_, S> {
    /// The relative variance of sampling by averages is the sum of variance over mean. Ends of the range bound the
    /// variance (Bhatia and Davis 2000); with two values, and that is what edges have, the bound is exact.
    fn judge(&self, range: TexelRange, average: f32) -> MeasuredCell {
        let [min, max, mean] = [range.min, range.max, average].map(f64::from);
        let variance = self.source.spread() * (max - mean) * (mean - min) / mean;
        MeasuredCell { average, variance, has_black: min == 0.0 && mean > LEAST_AVERAGE * max }
    }

    fn measure(&self, open: &OpenCell) -> Result<MeasuredCell, S::Fault> {
        match open.measured {
            Some(measured) => Ok(measured),
            None => self.source.measure(open.cell).map(|(range, average)| self.judge(range, average)),
        }
    }

    /// What a cell is found to be.
    fn child(&self, cell: LatticeCell, is_fine: bool) -> Result<FoundChild, S::Fault> {
        if !is_fine {
            return Ok(self.source.constant(cell)?.map_or(FoundChild::Open(None), FoundChild::Constant));
        }
        let (range, average) = self.source.measure(cell)?;
        let open = || FoundChild::Open(Some(self.judge(range, average)));
        Ok(if range.is_constant() { FoundChild::Constant(range.max) } else { open() })
    }

    /// The cells that are to be divided, in their order; the others become leaves. Of fine cells those may stay that
    /// together add no more than `spare` to the variance.
    fn choose(
        &mut self,
        open: Vec<OpenCell>,
        [room, worthwhile_room]: [usize; 2],
        rescue: usize,
        spare: Option<f64>,
        share: f64,
    ) -> Result<Vec<OpenCell>, S::Fault> {
        if spare.is_none() && open.len() <= room {
            return Ok(open);
        }
        let measured = parallel::map(&open, WORTHWHILE_CELLS, |open| self.measure(open))?;
        let mass = self.mass + share * measured.iter().map(|m| f64::from(m.average)).sum::<f64>();
        let mut ranks: Vec<(f64, u32)> = measured.iter().map(|m| m.variance).zip(0..).collect();
        let count = match spare {
            None => {
                // The order among those that there is room for does not matter.
                let (_, _, others) = ranks.select_nth_unstable_by(room, by_variance);
                others.sort_unstable_by(by_variance);
                let beyond = &mut ranks[room..];
                let mut worthwhile = 0;
                for at in 0..beyond.len() {
                    let (variance, i) = beyond[at];
                    let is_worthwhile = variance >= WORTHWHILE_VARIANCE * f64::from(measured[i as usize].average);
                    if worthwhile < worthwhile_room - room && is_worthwhile {
                        beyond.swap(worthwhile, at);
                        worthwhile += 1;
                    }
                }
                room + worthwhile
            }
            Some(spare) => {
                ranks.sort_unstable_by(by_variance);
                // Without contrast enough, they stay undivided from the end.
                let mut left = 0.0;
                let enough = |(variance, _): &&(f64, u32)| {
                    left += share * variance;
                    left <= spare * mass
                };
                let spared = ranks.iter().rev().take_while(enough).count();
                room.min(ranks.len() - spared)
            }
        };
        let rescued = rescued(&mut ranks[count..], |&(_, i)| measured[i as usize].has_black, rescue, share, mass);
        self.rescued += rescued;
        let count = count + rescued;
        let mut is_kept = alloc::vec![false; open.len()];
        for &(_, i) in &ranks[..count] {
            is_kept[i as usize] = true;
        }
        for ((open, measured), _) in open.iter().zip(&measured).zip(&is_kept).filter(|(_, is_kept)| !**is_kept) {
            self.set(open.at, measured.average, share);
        }
        Ok(open.into_iter().zip(is_kept).filter_map(|(open, is_kept)| is_kept.then_some(open)).collect())
    }

    /// Adds the nodes below cells. Returns those of their cells over which lookups differ.
    fn divide(&mut self, open: Vec<OpenCell>, is_fine: bool, share: f64) -> Result<Vec<OpenCell>, S::Fault> {
        let children: Vec<[FoundChild; ARITY]> = parallel::map(&open, WORTHWHILE_CELLS, |open| {
            let mut children = [FoundChild::Open(None); ARITY];
            for (slot, child) in children.iter_mut().enumerate() {
                *child = self.child(open.cell.child(slot), is_fine)?;
            }
            Ok(children)
        })?;
        let mut next = Vec::new();
        for (parent, children) in open.iter().zip(children) {
            self.divided[parent.at] = true;
            for (slot, child) in children.into_iter().enumerate() {
                let at = self.averages.len();
                self.averages.push(0.0);
                self.divided.push(false);
                match child {
                    FoundChild::Constant(value) => self.set(at, storable(f64::from(value)), share),
                    FoundChild::Open(measured) => next.push(OpenCell { cell: parent.cell.child(slot), at, measured }),
                }
            }
        }
        Ok(next)
    }

    fn set(&mut self, at: usize, average: f32, share: f64) {
        self.averages[at] = average;
        self.mass += share * f64::from(average);
    }

    /// Sets the average of every divided cell to the mean of its node.
    fn finish(mut self) -> GrownTree {
        let mut end = self.averages.len();
        for at in (0..self.averages.len()).rev() {
            if self.divided[at] {
                let node = &self.averages[end - ARITY..end];
                let mean = node.iter().map(|average| f64::from(*average)).sum::<f64>() / ARITY as f64;
                self.averages[at] = storable(mean);
                end -= ARITY;
            }
        }
        let average = self.averages[0];
        GrownTree {
            average,
            averages: self.averages.split_off(1),
            divided: self.divided.split_off(1),
            rescued: self.rescued,
        }
    }
}
