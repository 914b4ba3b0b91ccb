//! How much the statistical tests do.
//!
//! `cargo test` does little of everything; `FANLIGHT_TIER=full cargo test --release --test suite -- --include-ignored`
//! does what is behind the figures of the documentation. `FANLIGHT_TIER=long` draws 10^8 samples in each test that looks
//! samples up again, which takes a quarter of an hour to hours a test: to be run by hand, with the names of tests. No
//! tolerance depends on the tier.

use std::sync::OnceLock;

/// The sizes of one tier.
pub(crate) struct Tier {
    /// Scenes of which samples are looked up again.
    pub(crate) scenes: usize,
    /// How many times fewer samples are looked up again than in the full tier.
    agreement_divisor: usize,
    /// Samples of a whole test that are looked up again at least.
    agreement_least: usize,
    /// Shading points of a family of scenes whose irradiance is estimated.
    pub(crate) points: usize,
    /// Cases of a property.
    pub(crate) cases: u32,
    /// Samples of a histogram over the cells of triangles.
    pub(crate) histogram: usize,
    /// One of this many scenes and points of a family is looked at, where all together take long.
    pub(crate) stride: usize,
    /// One of this many is looked at where another test looks at the same family.
    pub(crate) wide_stride: usize,
    /// Inputs of random bytes.
    pub(crate) inputs: u64,
    /// Triangles of a large build.
    pub(crate) triangles: u32,
    /// Edges of images that are repeated, in texels.
    pub(crate) tiles: &'static [usize],
}

/// Strides have no factor in common with the periods in which the families of scenes vary.
const FULL: Tier = Tier {
    scenes: 400,
    agreement_divisor: 1,
    agreement_least: 0,
    points: 20,
    cases: 200,
    histogram: 100_000,
    stride: 1,
    wide_stride: 5,
    inputs: 8000,
    triangles: 1_000_000,
    tiles: &[16, 64, 256],
};

const THIN: Tier = Tier {
    scenes: 100,
    agreement_divisor: 25,
    agreement_least: 0,
    points: 8,
    cases: 50,
    histogram: 30_000,
    stride: 7,
    wide_stride: 49,
    inputs: 2000,
    triangles: 200_000,
    tiles: &[16, 64],
};

const LONG: Tier = Tier { agreement_least: 100_000_000, ..FULL };

/// The tier that the environment variable `FANLIGHT_TIER` asks for.
pub(crate) fn tier() -> &'static Tier {
    static TIER: OnceLock<&Tier> = OnceLock::new();
    TIER.get_or_init(|| match std::env::var("FANLIGHT_TIER").as_deref() {
        Ok("long") => &LONG,
        Ok("full") => &FULL,
        Ok("thin") | Err(_) => &THIN,
        Ok(other) => panic!("FANLIGHT_TIER is `thin`, `full` or `long`, not `{other}`"),
    })
}

/// Samples that are looked up again at each of `points` points (or scenes), where the full tier draws `full`.
pub(crate) fn agreement(points: usize, full: usize) -> usize {
    (full / tier().agreement_divisor).max(tier().agreement_least.div_ceil(points))
}

/// Numbers below `count`: all of them, or one in [`Tier::stride`].
pub(crate) fn some(count: usize) -> Vec<usize> {
    (0..count).step_by(tier().stride).collect()
}

/// As [`some`], where each takes seconds: two of five in the full tier, and one of 13 in the thin one. Five and 13 have no
/// factor in common with the periods of the families either; of 7 or 11, none of normalization's points would miss some
/// samples and not others.
pub(crate) fn some_slow(count: usize) -> Vec<usize> {
    let (period, kept): (usize, &[usize]) = if tier().stride > 1 { (13, &[0]) } else { (5, &[0, 2]) };
    (0..count).filter(|i| kept.contains(&(i % period))).collect()
}

/// Numbers below `count`: one of several, or one of many, where another test looks at the same family.
pub(crate) fn few(count: usize) -> Vec<usize> {
    (0..count).step_by(tier().wide_stride).collect()
}

/// As [`few`], and a third of them in the full tier, where each takes long.
pub(crate) fn fewer(count: usize) -> Vec<usize> {
    few(count).into_iter().step_by(if tier().stride > 1 { 1 } else { 3 }).collect()
}
