//! What walls hide: how a sampler takes it, and how it is learned.

use alloc::vec::Vec;
use core::ops::ControlFlow;

use super::lights::{LightSampler, LightSamplerView};
use super::point::PointSampler;
use crate::env::{REGION_DEPTH, region_at};
use crate::error::{Error, ErrorKind};
use crate::parallel;
use crate::progress::{Progress, Report};
use crate::receiver::ShadingPoint;
use crate::record::{LightSample, SampledLight};
use crate::technique::LightScene;
use crate::visibility::{
    Counts, LeafKey, RegionBuilder, RegionFactors, Visibility, VisibilityHeader, VisibilityView, distill, orientation,
};

/// Bytes that a table takes at most, unless the host says otherwise. *Measured* on `building` (docs/CONSTANTS.md).
///
/// Larger: more entries are kept, and more of the processor's cache is used. Smaller: the least useful entries go.
const DEFAULT_BYTES: usize = 3 << 20;

/// Largest number of regions. *Measured* on `building` (docs/CONSTANTS.md).
///
/// Larger: shadows are followed more closely, each region from fewer reports. Smaller: the reverse.
const MAX_REGIONS: usize = 1 << 14;

/// Reports from which on a region is divided, where they are made while rendering. *Chosen*.
///
/// Larger: regions stay wide. Smaller: what they know is thin.
const DIVIDED: u64 = 512;

/// Rays of a region, where space is divided before they are traced. *Measured* on `building` (docs/CONSTANTS.md).
const RAYS_IN_REGION: u64 = 96;

/// Rays for each of the points that regions are divided by. *Chosen*: points may cost as much as rays.
///
/// Larger: regions differ more in the number of their rays. Smaller: more points are requested.
const COVERED_RAYS: u64 = 4;

/// Largest number of points that regions are divided by. *Chosen*: memory and time of a fraction of a second.
const COVERING_POINTS: u64 = 1 << 18;

/// Shares of the rays of all passes, of which each uses what the ones before have found. *Measured* on `building`
/// (docs/CONSTANTS.md).
const PASSES: [f64; 3] = [0.25, 0.25, 0.5];

/// Share of the rays of all passes but the first that are drawn as if nothing had been learned. *Measured* on
/// `building` (docs/CONSTANTS.md).
///
/// Larger: more rays to what is hidden. Smaller: what the table hides is sampled seldom, and each report stands
/// for more, up to the inverse of this.
const UNLEARNED: f64 = 0.5;

/// Rays that are counted together. *Chosen*: it decides about memory and waiting, not about results.
const RAYS_AT_ONCE: u64 = 1 << 13;

/// Chunks between two merges. *Chosen*, as [`RAYS_AT_ONCE`].
const CHUNKS: u64 = 64;

impl LightSampler {
    /// Returns the lights with what is known of walls: see [`LightSamplerView::with_visibility`].
    ///
    /// # Errors
    ///
    /// As [`LightSamplerView::with_visibility`].
    pub fn with_visibility<'a>(&'a self, visibility: &'a Visibility) -> Result<LightSamplerView<'a>, Error> {
        self.as_view().with_visibility(visibility.as_view())
    }
}

impl<'a> LightSamplerView<'a> {
    /// Returns the same lights, sampled with what is known of walls.
    ///
    /// Samples, every density, splitting, batches and resampling use the same factors, so that all of them stay
    /// unbiased and exact for any table, whatever it holds: only noise depends on it. A density belongs to the sampler
    /// that computed it: do not mix those of samplers with different tables, or of one with and one without.
    ///
    /// Rays of light that leave the lights ([`Self::emission`]) are drawn as without a table, and [`Self::to_bytes`]
    /// writes the lights alone: a table has bytes of its own.
    ///
    /// Distant lights have no factor: a [`DistantLight`](crate::DistantLight) keeps the weight that it has without a
    /// table, whether walls hide it or not.
    ///
    /// # Errors
    ///
    /// If the table was learned for a light tree with another number of nodes or of lights: after a rebuild, learn
    /// again. After a [`refit`](LightSampler::refit) a table can still be used. The numbers alone are compared. A table
    /// of another scene that agrees in these makes noise, but no error.
    pub fn with_visibility(self, visibility: VisibilityView<'a>) -> Result<Self, Error> {
        same_lights(visibility.header, header(&self.scene))?;
        Ok(Self { visibility: Some(visibility), ..self })
    }

    /// Returns the same lights without what is known of walls.
    #[must_use]
    pub fn without_visibility(self) -> Self {
        Self { visibility: None, ..self }
    }

    /// Returns what is known of the region of a shading point.
    #[inline(always)]
    pub(super) fn region(&self, x: &ShadingPoint) -> Option<RegionFactors<'a>> {
        match &self.visibility {
            Some(visibility) if !visibility.is_empty() => visibility.at(x),
            _ => None,
        }
    }
}

fn header(scene: &LightScene<'_>) -> VisibilityHeader {
    let tlas = &scene.tlas;
    VisibilityHeader { nodes: tlas.node_count() as u32, leaves: tlas.leaves.len() as u32 }
}

/// `Ok` if what was learned is of light trees with the expected numbers.
fn same_lights(found: VisibilityHeader, expected: VisibilityHeader) -> Result<(), Error> {
    same("nodes of the light tree", found.nodes, expected.nodes)?;
    same("lights", found.leaves, expected.leaves)
}

/// `Ok` if a number that something was learned for is the expected one.
fn same(what: &'static str, found: u32, expected: u32) -> Result<(), Error> {
    let (found, expected) = (found as usize, expected as usize);
    if found == expected { Ok(()) } else { Err(Error(ErrorKind::Visibility { what, found, expected })) }
}

/// Learns what walls hide from what a host reports.
///
/// Rendering and learning alternate. For a pass, each thread takes its own [`VisibilityCounters`] and reports to them
/// which samples got through. Between two passes the counters are merged, and [`publish`](Self::publish) makes the
/// table of all reports so far, with which the next pass samples. Counts are integers, so that the table depends
/// neither on the number of threads nor on the order of merging. Never use a table of a pass to weigh samples of the
/// same pass again: samples, densities and table belong together.
///
/// The regions of space and orientation that the table distinguishes adapt: [`publish`](Self::publish) divides those
/// with many reports.
///
/// ```
/// use fanlight::{LightSampler, Mesh, ShadingPoint, VisibilityLearner, glam::Vec3};
///
/// // A wall between two lamps, the plane x = 0.
/// let lamp = |x: f32| [[x, 0.0, 2.0], [x, 1.0, 2.0], [x + 1.0, 0.0, 2.0]].map(Vec3::from);
/// let lights = LightSampler::builder()
///     .mesh(&Mesh::emitter(&lamp(-2.0), &[[0, 1, 2]]))?
///     .mesh(&Mesh::emitter(&lamp(1.0), &[[0, 1, 2]]))?
///     .build()?;
/// let x = ShadingPoint::surface(Vec3::new(0.5, 0.5, 0.0), Vec3::Z);
///
/// let mut learner = VisibilityLearner::new(&lights.as_view());
/// let mut counters = learner.counters();
/// let here = lights.at(&x);
/// for i in 0..64_u8 {
///     let Some(sample) = here.sample([f32::from(i) / 64.0, 0.5, 0.5]) else { continue };
///     let is_seen = sample.position.x > 0.0;
///     counters.report(&here, &sample, f32::from(u8::from(is_seen)));
/// }
/// learner.merge(&counters)?;
/// let visibility = learner.publish(&lights.as_view())?;
///
/// // From here on most samples go to the lamp on this side.
/// let lights = lights.with_visibility(&visibility)?;
/// let seen = (0..64_u8).filter_map(|i| lights.at(&x).sample([f32::from(i) / 64.0, 0.5, 0.5]));
/// assert!(seen.filter(|sample| sample.position.x > 0.0).count() > 52);
/// # Ok::<(), fanlight::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct VisibilityLearner {
    header: VisibilityHeader,
    regions: RegionBuilder,
    counts: Counts,
    /// Number of times that regions were divided.
    generation: u32,
    max_bytes: usize,
}

/// Counts of reports, for one thread and one pass: see [`VisibilityLearner`].
///
/// Memory grows with the number of different pairs of region and light that are reported, by about 20 bytes each.
/// Publish when [`Self::bytes`] has become too much.
#[derive(Clone, Debug)]
pub struct VisibilityCounters {
    header: VisibilityHeader,
    regions: RegionBuilder,
    counts: Counts,
    generation: u32,
    /// Share of the samples that were drawn without a table, whatever table they are reported with.
    unlearned_share: f64,
}

impl VisibilityCounters {
    /// Counts one report: that a share of the light of a sample gets to the point that it was drawn for.
    /// `transmittance` is in `[0, 1]`; NaN counts as 0.
    ///
    /// Report samples whether they got through or not, or only every nth of them; but do not choose by the result. For
    /// a sample on a portal, what counts is whether the environment is seen along its direction. `here` is the sampler
    /// that drew the sample. Samples of distant lights and of lights that it does not have, and those at positions that
    /// are not finite, are ignored, as are all of a sampler whose light tree has another number of nodes or of lights
    /// than the learner's.
    ///
    /// Where the sample got through several portals, what it says is shared among them: it counts most for the one that
    /// finds the direction most easily, since samples on the others are not needed for it.
    ///
    /// If `here` has a table itself, a report costs about as much as the density of a hit; otherwise a few dozen
    /// instructions. For a sample that got through a portal behind which there may be others, it costs as much as the
    /// density of a direction.
    pub fn report(&mut self, here: &PointSampler<'_>, sample: &LightSample, transmittance: f32) {
        let (x, scene) = (&here.at.x, &here.at.scene);
        // Both numbers: a leaf that the learner's tree does not have would have no way to its root.
        if header(scene) != self.header {
            return;
        }
        let Some(region) = self.regions.find(orientation(&x.receiver), x.position) else { return };
        let (mut weight, mut credit) = (1.0, 1.0);
        let key = match (scene.lights.leaf_of_sampled(&sample.light), &sample.light) {
            (Some(leaf), _) => {
                let is_portal = scene.lights.is_portal(leaf);
                if is_portal && scene.has_features() && scene.environment.feature_at(sample.direction).is_some() {
                    LeafKey::feature(leaf.top)
                } else {
                    if let (true, SampledLight::Triangle(hit)) = (is_portal && transmittance > 0.0, &sample.light) {
                        credit = here.credit(leaf, hit, sample.direction);
                    }
                    if here.at.visibility.is_some() {
                        // As if the sample had been drawn without the table: else lanes would seem as visible as what
                        // the table has left of them.
                        let drawn = scene.tlas.pmf(leaf.top, &here.at, None);
                        let unlearned = scene.tlas.pmf(leaf.top, &here.at.unlearned(), None);
                        let drawn = self.unlearned_share * unlearned + (1.0 - self.unlearned_share) * drawn;
                        weight = if drawn > 0.0 { (unlearned / drawn) as f32 } else { 1.0 };
                    }
                    LeafKey::leaf(leaf.top)
                }
            }
            (None, SampledLight::Environment) => {
                LeafKey::sky(region_at(scene.environment.texel_in(REGION_DEPTH, sample.direction)) as u32)
            }
            (None, _) => return,
        };
        self.regions.extents[region as usize].add(x.position);
        self.counts.report(region, key, credit * transmittance, weight);
    }

    /// Adds all reports of other counters.
    ///
    /// # Errors
    ///
    /// If they differ in the number of nodes or lights, in how often the learner had published, or in its regions.
    /// Counters of another learner that agree in all of these mean the same, and are added.
    pub fn merge(&mut self, other: &Self) -> Result<(), Error> {
        same_lights(other.header, self.header)?;
        same("published tables", other.generation, self.generation)?;
        same_regions(&other.regions, &self.regions)?;
        self.regions.add(&other.regions.extents);
        self.counts.merge(&other.counts);
        Ok(())
    }

    /// Returns the number of bytes that the counts take.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.counts.bytes()
    }
}

/// `Ok` if regions have the same numbers at the same places. Otherwise counts would land elsewhere, or nowhere.
fn same_regions(found: &RegionBuilder, expected: &RegionBuilder) -> Result<(), Error> {
    same("regions", found.len() as u32, expected.len() as u32)?;
    match found.difference(expected) {
        None => Ok(()),
        Some((node, [found, expected])) => Err(Error(ErrorKind::VisibilityRegions { node, found, expected })),
    }
}

impl VisibilityLearner {
    /// Returns a learner that knows nothing.
    #[must_use]
    pub fn new(lights: &LightSamplerView<'_>) -> Self {
        Self {
            header: header(&lights.scene),
            regions: RegionBuilder::new(),
            counts: Counts::default(),
            generation: 0,
            max_bytes: DEFAULT_BYTES,
        }
    }

    /// Sets the number of bytes that the entries of a table take at most, three MiB by default. If there are more
    /// entries, those that matter least are left out.
    #[must_use]
    pub fn max_bytes(mut self, bytes: usize) -> Self {
        self.max_bytes = bytes;
        self
    }

    /// Returns counters without reports, for one thread and until the next [`publish`](Self::publish).
    #[must_use]
    pub fn counters(&self) -> VisibilityCounters {
        let (header, regions, generation) = (self.header, self.regions.clone(), self.generation);
        VisibilityCounters {
            header,
            regions: regions.without_reports(),
            counts: Counts::default(),
            generation,
            unlearned_share: 0.0,
        }
    }

    /// Adds all reports of counters. The order does not matter.
    ///
    /// # Errors
    ///
    /// If they were made before the last [`publish`](Self::publish), or by a learner that differs from this one in the
    /// number of nodes or lights, in how often it has published, or in its regions. Counters of another learner that
    /// agrees in all of these mean the same, and are added.
    pub fn merge(&mut self, counters: &VisibilityCounters) -> Result<(), Error> {
        same_lights(counters.header, self.header)?;
        same("published tables", counters.generation, self.generation)?;
        same_regions(&counters.regions, &self.regions)?;
        self.regions.add(&counters.regions.extents);
        self.counts.merge(&counters.counts);
        Ok(())
    }

    /// Returns the table of all reports so far, and divides regions with many reports for those that follow.
    ///
    /// # Errors
    ///
    /// If the light tree of the sampler has another number of nodes or of lights than that of the one that the learner
    /// was made for. The numbers alone are compared, as in [`LightSamplerView::with_visibility`].
    pub fn publish(&mut self, lights: &LightSamplerView<'_>) -> Result<Visibility, Error> {
        same_lights(self.header, header(&lights.scene))?;
        self.regions.surround();
        let visibility = distill(&self.regions, &self.counts, &lights.scene.tlas, self.max_bytes);
        self.divide();
        self.generation = self.generation.wrapping_add(1);
        Ok(visibility)
    }

    /// Divides regions with many reports. Both halves begin with a share of what was counted in the whole.
    fn divide(&mut self) {
        let mut halves = alloc::vec![None; self.regions.len()];
        let busy = (0..self.regions.len()).filter(|&region| self.regions.extents[region].count >= DIVIDED);
        let mut busy: Vec<usize> = busy.collect();
        busy.sort_by_key(|&region| core::cmp::Reverse(self.regions.extents[region].count));
        for region in busy {
            if self.regions.len() < MAX_REGIONS {
                halves[region] = self.regions.divide(region as u32);
            }
        }
        let mut records = Vec::new();
        for record in self.counts.records() {
            match halves[record.region as usize] {
                None => records.push(*record),
                Some(new) => records.extend([record.region, new].map(|region| record.faded(region))),
            }
        }
        records.retain(|record| record.asked > 0 && record.squares > 0);
        self.counts.replace(records);
    }
}

impl Visibility {
    /// Learns what walls hide, by rays of its own.
    ///
    /// `points(i)` is the i-th point that light is gathered at, for any `i` below `rays`: for example a random point on
    /// a random surface, or a random one of a list. Draw the points in random order: space is divided by the first
    /// quarter of them (262,144 at most), before a ray is traced. Places that only later points show share wide regions,
    /// or have none, and the rays from there are wasted. Only noise depends on it.
    ///
    /// `transmittance` says which share, in `[0, 1]`, of the light of a sample gets to such a point: for a sample on a
    /// portal or of the environment, of the light that comes along its direction. It is called once for each of the
    /// `rays`, of which many are drawn with what earlier ones have found. One hundred rays for each room make a useful
    /// table, a few thousand a good one.
    ///
    /// The result does not depend on the number of threads. With the feature `rayon` both functions are called by
    /// several.
    ///
    /// A tree without nodes (a single light) has nothing to learn, and the table is empty, as it is where all lights are
    /// seen.
    ///
    /// # Errors
    ///
    /// Those of [`Self::learn_with`], which do not occur here.
    pub fn learn(
        lights: &LightSamplerView<'_>,
        rays: u64,
        points: impl Fn(u64) -> ShadingPoint + Sync,
        transmittance: impl Fn(&ShadingPoint, &LightSample) -> f32 + Sync,
    ) -> Result<Self, Error> {
        learn(lights, rays, &points, &transmittance, None)
    }

    /// Learns as [`Self::learn`] does, for hosts that show progress or that need to be able to cancel: `report` is
    /// called with the share of the rays that are done, and [`ControlFlow::Break`] cancels.
    ///
    /// # Errors
    ///
    /// If `report` has canceled: [`Error::is_cancelled`] is true.
    pub fn learn_with(
        lights: &LightSamplerView<'_>,
        rays: u64,
        points: impl Fn(u64) -> ShadingPoint + Sync,
        transmittance: impl Fn(&ShadingPoint, &LightSample) -> f32 + Sync,
        report: impl Fn(f32) -> ControlFlow<()> + Sync,
    ) -> Result<Self, Error> {
        learn(lights, rays, &points, &transmittance, Some(&report))
    }
}

fn learn(
    lights: &LightSamplerView<'_>,
    rays: u64,
    points: &(impl Fn(u64) -> ShadingPoint + Sync),
    transmittance: &(impl Fn(&ShadingPoint, &LightSample) -> f32 + Sync),
    report: Option<Report<'_>>,
) -> Result<Visibility, Error> {
    let progress = Progress::new(report, rays as f64);
    let unlearned = lights.without_visibility();
    let mut learner = VisibilityLearner::new(&unlearned);
    learner.cover(rays, points);
    let mut visibility = learner.publish_as_is(&unlearned);
    let mut first = 0;
    for (pass, share) in PASSES.into_iter().enumerate() {
        let is_last = pass + 1 == PASSES.len();
        let end = if is_last { rays } else { first + (share * rays as f64) as u64 };
        let lights = if pass == 0 {
            unlearned
        } else {
            LightSamplerView { visibility: Some(visibility.as_view()), ..unlearned }
        };
        while first < end {
            let batch_end = end.min(first + RAYS_AT_ONCE * CHUNKS);
            let chunks: Vec<u64> = (first..batch_end).step_by(RAYS_AT_ONCE as usize).collect();
            let counted = parallel::map(&chunks, 2, |&start| {
                progress.check()?;
                let mut counters = learner.counters();
                counters.unlearned_share = if pass == 0 { 1.0 } else { UNLEARNED };
                let rays = start..batch_end.min(start + RAYS_AT_ONCE);
                progress.add((rays.end - rays.start) as usize);
                for ray in rays {
                    let x = points(ray);
                    let here = lights.at(&x);
                    let [choice, u @ ..] = numbers(ray);
                    let drawn = if f64::from(choice) < UNLEARNED { unlearned.at(&x).sample(u) } else { here.sample(u) };
                    if let Some(sample) = drawn {
                        counters.report(&here, &sample, transmittance(&x, &sample));
                    }
                }
                counters.counts.sort();
                Ok::<_, Error>(counters)
            })?;
            counted.iter().try_for_each(|counters| learner.merge(counters))?;
            first = batch_end;
        }
        visibility = learner.publish_as_is(&unlearned);
    }
    progress.finish()?;
    Ok(visibility)
}

impl VisibilityLearner {
    /// Divides regions by where points are, before there are any reports.
    fn cover(&mut self, rays: u64, points: &impl Fn(u64) -> ShadingPoint) {
        let count = rays.div_ceil(COVERED_RAYS).min(COVERING_POINTS);
        let places = (0..count).map(|i| {
            let x = points(i);
            (orientation(&x.receiver), x.position)
        });
        let mut places: Vec<_> = places.filter(|(_, position)| position.is_finite()).collect();
        let regions = (rays / RAYS_IN_REGION).clamp(1, MAX_REGIONS as u64) as usize;
        self.regions.cover(&mut places, count as usize / regions, MAX_REGIONS);
    }

    /// Makes the table without dividing regions.
    fn publish_as_is(&self, lights: &LightSamplerView<'_>) -> Visibility {
        distill(&self.regions, &self.counts, &lights.scene.tlas, self.max_bytes)
    }
}

/// Returns the numbers that a ray is drawn with, first the choice of the table: hashes of its number (the finalizer of
/// SplitMix64, Steele, Lea and Flood 2014).
fn numbers(ray: u64) -> [f32; 4] {
    [0, 1, 2, 3].map(|dimension| {
        let mut bits = (ray.wrapping_mul(4) + dimension + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        (bits >> 40) as f32 * (1.0 / 16_777_216.0)
    })
}
