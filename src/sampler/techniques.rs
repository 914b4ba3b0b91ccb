//! How often suns and trees are used at one shading point.

use crate::env::MAX_FEATURES;
use crate::technique::FeaturePart;
use crate::warp::{Variate, pick, pick_pair, sum};

/// Most pairs of a sun and a part of a portal that shows some of it. Of a sun with more, directions are drawn as if
/// there were no walls.
pub(super) const MAX_SEEN: usize = 64;
const _: () = assert!(MAX_SEEN > MAX_FEATURES);

/// Stands for all portals.
pub(super) const ANY: u32 = u32::MAX;

/// Least probability of the trees where they may find anything.
const LEAST_TREES: f32 = 0.02;

/// The same next to a portal: what is seen through it differs so much from place to place that neither the estimate of
/// the trees nor their choices are as good there.
const LEAST_TREES_CLOSE: f32 = 0.2;

/// Largest estimate of an irradiance, so that sums stay finite.
const BRIGHTEST: f32 = 1e35;

/// A sun through a part of a portal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    /// Or [`ANY`].
    pub(super) leaf: u32,
    pub(super) sun: u32,
    pub(super) part: FeaturePart,
}

/// Suns through parts of portals.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pairs {
    seen: [Seen; MAX_SEEN],
    /// Irradiance from each.
    weights: [f32; MAX_SEEN],
    count: usize,
    /// Whether the shading point is close to one of the portals.
    is_close: bool,
}

/// How often each technique is used at one shading point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Techniques {
    /// Nothing where no sun is seen: a list would take longer to write than many a sample to draw.
    pairs: Option<Pairs>,
    /// Irradiance from the trees.
    rest: f32,
    /// Probability of the trees; 1 if they are used anyway.
    pub(super) trees: f64,
    /// Probability of a pair per weight; 0 if there is none.
    pub(super) per_weight: f64,
}

/// A technique that was chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Technique {
    Trees,
    /// By its place in the list.
    Sun(usize),
}

impl Pairs {
    pub(super) const NONE: Self = Self {
        seen: [Seen { leaf: 0, sun: 0, part: FeaturePart::WHOLE }; MAX_SEEN],
        weights: [0.0; MAX_SEEN],
        count: 0,
        is_close: false,
    };

    fn weights(&self) -> &[f32] {
        &self.weights[..self.count]
    }

    /// Number of pairs so far.
    pub(super) fn len(&self) -> usize {
        self.count
    }

    /// Appends a pair. There must be room for it.
    pub(super) fn push(&mut self, leaf: u32, sun: usize, part: FeaturePart, weight: f32) {
        self.seen[self.count] = Seen { leaf, sun: sun as u32, part };
        self.weights[self.count] = weight;
        self.count += 1;
    }

    /// Notes whether the shading point is close to a portal that a sun may be seen through.
    pub(super) fn note(&mut self, is_close: bool) {
        self.is_close |= is_close;
    }

    /// Replaces all pairs from one on by the sun as such.
    pub(super) fn merge(&mut self, start: usize, sun: usize, weight: f32) {
        self.count = start;
        self.push(ANY, sun, FeaturePart::WHOLE, weight);
    }

    /// Irradiance from all pairs from one on.
    pub(super) fn irradiance(&self, start: usize) -> f32 {
        sum(&self.weights()[start..]) as f32
    }

    /// A pair by its place in the list.
    pub(super) fn seen(&self, index: usize) -> Seen {
        self.seen[index]
    }

    /// The pairs of one sun, with their weights.
    pub(super) fn of_sun(&self, sun: usize) -> impl Iterator<Item = (Seen, f32)> {
        let pairs = self.seen.iter().copied().zip(self.weights().iter().copied());
        pairs.filter(move |(seen, _)| seen.sun as usize == sun)
    }
}

impl Techniques {
    /// The trees alone. Not a constant, of which compilers copy the room for a list as well.
    #[inline(always)]
    pub(super) fn trees() -> Self {
        Self { pairs: None, rest: 1.0, trees: 1.0, per_weight: 0.0 }
    }

    /// The suns that are seen, if any is.
    #[inline]
    pub(super) fn suns(&self) -> Option<&Pairs> {
        self.pairs.as_ref()
    }

    /// Chooses one technique.
    #[inline]
    pub(super) fn choose(&self, u: &mut Variate) -> Technique {
        let Some(pairs) = &self.pairs else { return Technique::Trees };
        let suns = sum(pairs.weights());
        match pick_pair([suns as f32, self.rest], u) {
            0 => Technique::Sun(pick(pairs.weights(), suns, u)),
            _ => Technique::Trees,
        }
    }

    /// Uses the trees in any case, and one of the suns next to them.
    pub(super) fn put_side_by_side(&mut self) {
        if let Some(pairs) = &self.pairs {
            (self.trees, self.per_weight) = (1.0, 1.0 / sum(pairs.weights()));
        }
    }

    /// Chooses among the suns alone, if any is seen.
    pub(super) fn choose_sun(&self, u: &mut Variate) -> Option<usize> {
        self.pairs.as_ref().map(|pairs| pick(pairs.weights(), sum(pairs.weights()), u))
    }

    /// Balances the pairs with the trees, which are estimated to send so much.
    #[inline]
    pub(super) fn balance(pairs: Pairs, trees: impl FnOnce() -> f32) -> Self {
        let suns = pairs.irradiance(0);
        if !(suns > 0.0 && suns < BRIGHTEST) {
            return Self::trees();
        }
        let trees = trees();
        let least = if pairs.is_close { LEAST_TREES_CLOSE } else { LEAST_TREES };
        let rest = if trees > 0.0 { trees.max(least * suns).min(BRIGHTEST) } else { 0.0 };
        let total = f64::from(suns) + f64::from(rest);
        Self { pairs: Some(pairs), rest, trees: f64::from(rest) / total, per_weight: 1.0 / total }
    }
}
