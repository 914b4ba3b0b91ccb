//! Choosing one of a few weights.

use crate::math::{at_least, at_most, only_if};
use crate::warp::variate::Variate;

/// Returns the sum of the weights, in the precision that [`pick`] needs.
#[inline]
pub(crate) fn sum(weights: &[f32]) -> f64 {
    weights.iter().fold(0.0, |sum, &w| sum + f64::from(w))
}

/// Returns the probability of an index among all: `weights[i] / total`, or zero if its weight is zero.
#[inline]
pub(crate) fn pmf(weights: &[f32], i: usize) -> f64 {
    match weights[i] {
        0.0 => 0.0,
        weight => f64::from(weight) / sum(weights),
    }
}

/// Share of the largest weight that every possible choice keeps. *Proved*: the product of twenty such shares is a
/// positive `f64`, so no probability of a walk vanishes.
///
/// Larger: more samples go where next to nothing is expected. Smaller: a wrong estimate causes a brighter firefly, and
/// products of shares could underflow.
const LEAST_CHOICE_SHARE: f32 = 1e-12;

/// Least and largest weight. *Proved*: a sum of 64 weights is a finite `f32`, and a quotient of two
/// sums is a normal `f64`.
///
/// Wider: sums could overflow. Narrower: weights of very bright or very dark scenes become
/// equal.
const WEIGHT_RANGE: (f32, f32) = (1e-30, 1e30);

/// Makes the weight of every possible choice positive, whatever overflow or underflow has made of it, and every other
/// weight zero.
#[inline(always)]
pub(crate) fn keep_possible<const N: usize>(weights: &mut [f32; N], possible: impl Fn(usize) -> bool) {
    let mut largest = 0;
    for (i, weight) in weights.iter_mut().enumerate() {
        *weight = only_if(possible(i), within_range(*weight));
        largest = largest.max(weight.to_bits());
    }
    keep_least(weights, largest);
}

/// [`keep_possible`] of what is positive.
#[inline(always)]
pub(crate) fn keep_positive(weights: &mut [f32]) {
    let mut largest = 0_i32;
    for weight in weights.iter_mut() {
        *weight = only_if(*weight > 0.0, within_range(*weight));
        // Signed, as more machines compare such vectors.
        let bits = weight.to_bits() as i32;
        largest = if bits > largest { bits } else { largest };
    }
    keep_least(weights, largest as u32);
}

/// Returns the nearest weight for which sums and quotients are finite; also for the NaN of 0 · ∞.
#[inline(always)]
pub(crate) fn within_range(weight: f32) -> f32 {
    at_most(at_least(weight, WEIGHT_RANGE.0), WEIGHT_RANGE.1)
}

/// Raises every positive weight to its least share. `largest` holds the bits of the largest weight: bits of positive
/// numbers are ordered as the numbers are, and the maximum of integers can be taken in any order, so that loops become
/// vectors.
#[inline(always)]
pub(crate) fn keep_least(weights: &mut [f32], largest: u32) {
    let least = LEAST_CHOICE_SHARE * f32::from_bits(largest);
    for weight in weights {
        *weight = only_if(*weight > 0.0, at_least(*weight, least));
    }
}

/// Returns the sum of the weights up to each, in the precision that a choice needs. Sums never decrease, and a
/// weight of zero adds nothing.
#[inline(always)]
fn ends<const N: usize>(weights: &[f32; N]) -> [f64; N] {
    let mut ends = [0.0; N];
    let mut end = 0.0;
    // By pairs, which halves the chain of dependent sums.
    for i in (0..N).step_by(2) {
        let (first, second) = (f64::from(weights[i]), f64::from(weights[i + 1]));
        ends[i] = end + first;
        end += first + second;
        ends[i + 1] = end;
    }
    ends
}

/// Chooses an index in proportion to its weight, and stretches the variate for the next choice.
///
/// `weights` are finite and not negative, `total` is their [`sum`]. The index has the probability
/// `weights[i] / total`, and a weight of zero is never chosen: what rounding leaves over at the end goes to the
/// last positive weight. Without any positive weight the answer is 0.
#[inline]
pub(crate) fn pick(weights: &[f32], total: f64, variate: &mut Variate) -> usize {
    let target = variate.value() * total;
    let (mut chosen, mut low, mut below) = (0, 0.0, 0.0);
    for (i, &w) in weights.iter().enumerate() {
        if w > 0.0 {
            // Taken before the comparison, so that the last positive weight stands if none of them passes.
            (chosen, low) = (i, below);
            below += f64::from(w);
            if target < below {
                break;
            }
        }
    }
    variate.stretch(target - low, f64::from(weights[chosen]), total);
    chosen
}

/// Returns the sum of an array's weights as [`pick_wide`] forms it.
#[inline(always)]
pub(crate) fn sum_wide<const N: usize>(weights: &[f32; N]) -> f64 {
    ends(weights)[N - 1]
}

/// Returns the probability with which [`pick_wide`] picks an index.
#[inline(always)]
pub(crate) fn pmf_wide<const N: usize>(weights: &[f32; N], i: usize) -> f64 {
    match weights[i] {
        0.0 => 0.0,
        weight => f64::from(weight) / ends(weights)[N - 1],
    }
}

/// [`pick`] of an array's weights, without branches. Returns the index with its probability, or `None` where all
/// weights are zero.
#[inline(always)]
pub(crate) fn pick_wide<const N: usize>(weights: &[f32; N], variate: &mut Variate) -> Option<(usize, f64)> {
    let ends = ends(weights);
    let total = ends[N - 1];
    if total == 0.0 {
        return None;
    }
    let target = variate.value() * total;
    // A value below one leaves the target below the total, so that a weight is found, and never one of zero. Counted:
    // the steps of a binary search would depend on each other.
    let chosen = ends[..N - 1].iter().map(|&end| u32::from(target >= end)).sum::<u32>() as usize;
    // The end before, or zero: products with 0 and 1 are exact.
    let low = ends[chosen.saturating_sub(1)] * f64::from(u8::from(chosen > 0));
    let width = f64::from(weights[chosen]);
    variate.stretch(target - low, width, total);
    Some((chosen, width / total))
}

/// [`pick`] of two weights, without branches.
#[inline]
pub(crate) fn pick_pair([first, second]: [f32; 2], variate: &mut Variate) -> usize {
    let (first, second) = (f64::from(first), f64::from(second));
    let total = first + second;
    let target = variate.value() * total;
    let upper = target >= first && second > 0.0;
    // A branch here would be a coin toss for the predictor, and compilers turn a choice between floats into one.
    // Products with 0 and 1 are exact.
    let one = f64::from(u8::from(upper));
    let (low, width) = (first * one, second * one + first * (1.0 - one));
    variate.stretch(target - low, width, total);
    usize::from(upper)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Pcg32, chi_square, chi_square_limit};
    use crate::warp::variate::seed;

    #[test]
    fn frequencies_follow_the_weights_at_any_depth() {
        let weights = [1.0, 0.0, 5.0, 1e-3, 0.0, 2.0, 0.25, 0.0];
        let total = sum(&weights);
        let mut counts = [[0.0; 8]; 60];
        let mut pcg = Pcg32::new(5, 5);
        let n = 200_000;
        for _ in 0..n {
            let u = pcg.next_f32();
            let mut v = Variate::new(u, seed(&[u]));
            for level in &mut counts {
                level[pick(&weights, total, &mut v)] += 1.0;
            }
        }
        let expected = weights.map(|w| f64::from(w) / total * f64::from(n));
        let (mut statistic, mut degrees) = (0.0, 0);
        for level in &counts {
            let (s, d) = chi_square(level, &expected);
            statistic += s;
            degrees += d;
        }
        assert!(statistic < chi_square_limit(degrees), "{statistic} with {degrees} degrees of freedom");
    }

    #[test]
    fn possible_weights_stay_possible() {
        let mut weights = [0.0, f32::INFINITY, f32::NAN, 1.0, 1e-45, 7.0, 0.0, 3.0];
        keep_possible(&mut weights, |i| i < 5);
        assert!(weights[..5].iter().all(|w| *w > 0.0 && w.is_finite()), "{weights:?}");
        assert_eq!(weights[5..], [0.0; 3]);
        assert!((0..5).all(|i| pmf(&weights, i) > 0.0));
        assert_eq!(pmf(&weights, 5), 0.0);
        assert_eq!(pmf(&[0.0; 3], 1), 0.0);
    }

    #[test]
    fn zero_weights_are_never_chosen() {
        for u in [0.0, 0.5, 1.0 - f32::EPSILON / 2.0, 1.0, f32::NAN] {
            for weights in [[0.0, 1.0, 0.0, 0.0], [0.0, 1e-45, 0.0, 0.0], [0.0, f32::MAX, 0.0, 0.0]] {
                let mut v = Variate::new(u, 1);
                assert_eq!(pick(&weights, sum(&weights), &mut v), 1);
                // A total that is too large or too small must not matter either.
                assert_eq!(pick(&weights, sum(&weights) * 1.5, &mut v), 1);
                assert_eq!(pick(&weights, sum(&weights) * 0.5, &mut v), 1);
            }
            let mut v = Variate::new(u, 1);
            assert_eq!(pick(&[0.0; 4], 0.0, &mut v), 0);
            assert!((0.0..1.0).contains(&v.value()));
        }
    }

    #[test]
    fn a_pair_is_picked_as_two_weights_are() {
        let mut pcg = Pcg32::new(6, 5);
        for i in 0..100_000 {
            let mut weights = [pcg.next_f32(), pcg.next_f32()];
            weights[i % 2] *= [1.0, 0.0, 1e-20][i % 3];
            let mut a = Variate::new(pcg.next_f32(), i as u64);
            let mut b = a;
            assert_eq!(pick(&weights, sum(&weights), &mut a), pick_pair(weights, &mut b));
            assert_eq!(a.value(), b.value());
        }
    }

    #[test]
    fn an_array_is_picked_as_a_slice_is() {
        let mut pcg = Pcg32::new(8, 5);
        for i in 0..100_000 {
            let weights: [f32; 8] = core::array::from_fn(|lane| {
                let zero = (i >> lane) & 1 == 1;
                if zero { 0.0 } else { pcg.next_f32() * [1.0, 1e-20, 1e20, 1e-12][(i + lane) % 4] }
            });
            let u = [pcg.next_f32(), 0.0, 1.0 - f32::EPSILON / 2.0][i % 3];
            let (mut a, mut b) = (Variate::new(u, i as u64), Variate::new(u, i as u64));
            let total = sum(&weights);
            match pick_wide(&weights, &mut b) {
                None => assert_eq!(total, 0.0),
                Some((lane, share)) => {
                    assert_eq!(lane, pick(&weights, total, &mut a));
                    assert_eq!(share, pmf_wide(&weights, lane));
                    assert!((share / pmf(&weights, lane) - 1.0).abs() < 1e-15);
                    assert!(share > 0.0);
                    assert!((a.value() - b.value()).abs() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn the_variate_is_stretched_over_the_chosen_weight() {
        let weights = [1.0, 2.0, 1.0];
        let mut v = Variate::new(0.5, 9);
        assert_eq!(pick(&weights, sum(&weights), &mut v), 1);
        assert!((v.value() - 0.5).abs() < 1e-6);
    }
}
