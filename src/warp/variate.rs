//! Uniform variates that survive any number of discrete choices.

use crate::math::{limit, limit64};

/// Share of the unit interval below which a [`Variate`] gets fresh low bits. *Proved*: 2^-20 leaves 2^32 of the 2^52
/// steps of a double at the time of the refill, so choices between two refills see a resolution of at least 2^-32.
///
/// Larger: more refills, which take time. Smaller: a coarser resolution just before a refill.
const REFILL_BELOW: f64 = 1.0 / (1u64 << 20) as f64;

/// Largest `f64` below one. *Format* of the number.
const ALMOST_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

/// Largest `f32` below one. *Format* of the number.
pub(crate) const ALMOST_ONE_F32: f32 = 1.0 - f32::EPSILON / 2.0;

/// Spacing of the doubles just below one, 2^-53. *Format* of the number.
const STEP: f64 = f64::EPSILON / 2.0;

/// A uniform variate in `[0, 1)` that never runs out of bits.
///
/// Every discrete choice spends bits: the part of the unit interval that was chosen is stretched to all of it.
/// An `f32` is empty after some 24 binary choices. This holds a double, whose low bits are a hash from the
/// start; when choices have used up its leading bits, those steps that still tell inputs apart are kept and
/// everything below them is hashed again. So the leading structure of a stratified input is never disturbed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Variate {
    /// In `[0, 1)`.
    value: f64,
    /// Share of the unit interval that `value` was stretched from since its low bits were last filled, in `(0, 1]`.
    spent: f64,
    /// State of the `SplitMix64` generator of low bits.
    state: u64,
}

impl Variate {
    /// A variate from a number in `[0, 1)`, with the bits below 2^-24 taken from a hash of `salt`.
    ///
    /// A `u` out of the range is clamped to it, NaN counts as zero. Variates of one sample need different salts,
    /// for example the [`seed`] of all its numbers plus a count.
    #[inline]
    pub(crate) fn new(u: f32, salt: u64) -> Self {
        let u = limit(u, ALMOST_ONE_F32);
        let mut variate = Self { value: 0.0, spent: 1.0, state: salt };
        let low = variate.fresh() * (1.0 / 16_777_216.0);
        variate.value = (f64::from(u) + low).min(ALMOST_ONE);
        variate
    }

    /// As [`Self::new`], with the leading 24 bits exclusive-ored with a hash of `key`.
    ///
    /// A fixed key maps the cells of every binary grid onto each other, so that what is stratified stays so
    /// (random digit scrambling, Matoušek 1998); different keys give numbers that share no visible structure.
    #[inline]
    pub(crate) fn scrambled(u: f32, key: u64, salt: u64) -> Self {
        // The cast saturates, and takes NaN to zero.
        let digits = ((u * 16_777_216.0) as u32).min(0xff_ffff) ^ (mix(key.wrapping_add(1)) >> 40) as u32;
        Self::new(digits as f32 * (1.0 / 16_777_216.0), salt)
    }

    /// The variate as a double in `[0, 1)`.
    #[inline]
    pub(crate) fn value(&self) -> f64 {
        self.value
    }

    /// The variate as a float in `[0, 1)`.
    #[inline]
    pub(crate) fn value_f32(&self) -> f32 {
        (self.value as f32).min(ALMOST_ONE_F32)
    }

    /// [`stretch`](Self::stretch) of `[low, low + width)` out of the unit interval.
    #[cfg(test)]
    pub(crate) fn rescale(&mut self, low: f64, width: f64) {
        self.stretch(self.value - low, width, 1.0);
    }

    /// Stretches an interval that was chosen because the value lies in it to `[0, 1)`.
    ///
    /// The value is `offset` above the low end of the interval, which has the size `width` out of `total` that stand
    /// for the whole unit interval. A value outside of it through rounding is clamped. `width` must be above zero.
    #[inline]
    pub(crate) fn stretch(&mut self, offset: f64, width: f64, total: f64) {
        // Also swallows the NaN of 0 / 0.
        self.value = limit64(offset / width, ALMOST_ONE);
        self.spent *= width / total;
        // Written as a negated comparison so that NaN causes a refill, too.
        let enough = self.spent >= REFILL_BELOW;
        if !enough {
            self.refill();
        }
    }

    /// Keeps the leading steps that the value still resolves, and replaces all below by fresh bits.
    #[cold]
    fn refill(&mut self) {
        // The cast truncates, saturates, and maps NaN to zero: no `floor` needed.
        let steps = ((self.spent * (1u64 << 52) as f64) as u64).clamp(1, 1 << 52) as f64;
        let kept = (self.value * steps) as u64 as f64;
        self.value = ((kept + self.fresh()) / steps).min(ALMOST_ONE);
        self.spent = 1.0;
    }

    /// Uniform in `[0, 1)`, a multiple of 2^-53 (`SplitMix64`, Steele et al. 2014).
    #[inline]
    fn fresh(&mut self) -> f64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        (mix(self.state) >> 11) as f64 * STEP
    }
}

/// Finalizer of `SplitMix64`: every input bit changes every output bit with probability one half.
#[inline]
const fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// A hash of all bits of the numbers that one sample is drawn with, the salt of its [`Variate`]s.
#[inline]
pub(crate) fn seed(u: &[f32]) -> u64 {
    u.iter().fold(0x243f_6a88_85a3_08d3, |hash, x| {
        mix(hash.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(u64::from(x.to_bits())))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Pcg32, chi_square_limit};

    /// Levels of choices, far more than any tree has.
    const DEPTH: usize = 200;

    /// The first level at which a choice of probability `share`, or the same choice at this level and the one before,
    /// is made too often or too seldom (chi-square of one degree above 30, which chance exceeds once in 20 million).
    fn first_wrong_level(share: f64, mut choose: impl FnMut(f32, &mut [bool; DEPTH])) -> Option<usize> {
        let count = 100_000;
        let mut pcg = Pcg32::new(1, 1);
        let (mut single, mut double) = ([0; DEPTH], [0; DEPTH]);
        let mut taken = [false; DEPTH];
        for _ in 0..count {
            choose(pcg.next_f32(), &mut taken);
            for level in 0..DEPTH {
                single[level] += u32::from(taken[level]);
                double[level] += u32::from(level > 0 && taken[level] && taken[level - 1]);
            }
        }
        let is_wrong = |taken: u32, share: f64| {
            let n = f64::from(count);
            (f64::from(taken) - share * n).powi(2) / (n * share * (1.0 - share)) > 30.0
        };
        (0..DEPTH).find(|&i| is_wrong(single[i], share) || i > 0 && is_wrong(double[i], share * share))
    }

    #[test]
    fn choices_are_unbiased_at_any_depth() {
        for share in [0.5, 0.3, 0.99] {
            let wrong = first_wrong_level(share, |u, taken| {
                let mut v = Variate::new(u, seed(&[u]));
                for taken in taken {
                    *taken = v.value() < share;
                    if *taken { v.rescale(0.0, share) } else { v.rescale(share, 1.0 - share) }
                }
            });
            assert_eq!(wrong, None, "choices of {share}");
        }
    }

    /// A float has 24 bits, of which each choice between halves takes one. (Uneven choices replace them by the noise of
    /// rounding, so that single levels do not show how few different ways there are.)
    #[test]
    fn a_rescaled_float_is_used_up_after_24_choices() {
        let wrong = first_wrong_level(0.5, |mut v, taken| {
            for taken in taken {
                *taken = v < 0.5;
                v = if *taken { 2.0 * v } else { 2.0 * v - 1.0 };
            }
        });
        std::println!("a float that is rescaled by choices between halves fails at level {wrong:?}");
        assert_eq!(wrong, Some(24));
    }

    #[test]
    fn the_rest_is_uniform_after_an_unlikely_choice() {
        // Only inputs in [0.3, 0.3 + 2^-12) get through: 4096 of 2^24, over and over.
        let (low, width) = (f64::from(0.3_f32), 1.0 / 4096.0);
        let mut counts = [0_u32; 64];
        let mut total = 0;
        for i in 0..1_u32 << 24 {
            let u = i as f32 / 16_777_216.0;
            if !(0.3..0.301).contains(&u) {
                continue;
            }
            for salt in 0..16 {
                let mut v = Variate::new(u, seed(&[u]).wrapping_add(salt));
                if v.value() >= low && v.value() < low + width {
                    v.rescale(low, width);
                    // A second unlikely choice would leave nothing of the input; what counts is that it refills.
                    v.rescale(0.0, 1.0);
                    counts[(v.value() * 64.0) as usize] += 1;
                    total += 1;
                }
            }
        }
        let expected = f64::from(total) / 64.0;
        let statistic: f64 = counts.iter().map(|&c| (f64::from(c) - expected).powi(2) / expected).sum();
        assert!(total > 60_000 && statistic < chi_square_limit(63), "{statistic} of {total}");
    }

    #[test]
    fn leading_bits_are_the_input_s() {
        for u in [0.0, 0.25, 0.999_999_9, ALMOST_ONE_F32] {
            let mut v = Variate::new(u, 7);
            assert!((v.value() - f64::from(u)).abs() < 1.0 / 16_777_216.0);
            assert!(v.value_f32() < 1.0);
            // Sixteen binary digits down, the input's digits are still the ones that decide.
            let mut digits = 0.0;
            for level in 1..=16 {
                let bit = if v.value() < 0.5 { 0.0 } else { 0.5 };
                v.rescale(bit, 0.5);
                digits += bit * 2.0 / f64::from(1 << level);
            }
            assert!((digits - f64::from(u)).abs() < 1.0 / 65_535.0);
        }
    }

    #[test]
    fn any_input_stays_in_the_unit_interval() {
        for u in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, -0.0, 1.0, 2.0, f32::MIN_POSITIVE] {
            let mut v = Variate::new(u, 3);
            for (low, width) in [(0.0, 1.0), (0.0, 0.0), (0.5, 1e-300), (0.9, 0.1), (f64::NAN, f64::NAN), (0.1, 0.7)] {
                assert!((0.0..1.0).contains(&v.value()) && (0.0..1.0).contains(&v.value_f32()));
                v.rescale(low, width);
            }
            assert!((0.0..1.0).contains(&v.value()));
        }
    }
}
