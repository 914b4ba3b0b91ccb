//! Choosing one of a few weights.

use crate::warp::variate::Variate;

/// Sum of the weights, in the precision that [`pick`] wants.
#[inline]
pub(crate) fn sum<const N: usize>(weights: &[f32; N]) -> f64 {
    weights.iter().fold(0.0, |sum, &w| sum + f64::from(w))
}

/// Chooses an index in proportion to its weight, and stretches the variate for the next choice.
///
/// `weights` are finite and not negative, `total` is their [`sum`]. The index has the probability
/// `weights[i] / total`, and a weight of zero is never chosen: what rounding leaves over at the end goes to the
/// last positive weight. Without any positive weight the answer is 0.
#[inline]
pub(crate) fn pick<const N: usize>(weights: &[f32; N], total: f64, variate: &mut Variate) -> usize {
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
    fn the_variate_is_stretched_over_the_chosen_weight() {
        let weights = [1.0, 2.0, 1.0];
        let mut v = Variate::new(0.5, 9);
        assert_eq!(pick(&weights, sum(&weights), &mut v), 1);
        assert!((v.value() - 0.5).abs() < 1e-6);
    }
}
