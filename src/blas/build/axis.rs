//! One axis of the wrapped plane, cut into stretches of the image.

use smallvec::SmallVec;

use crate::record::Wrap;

/// A stretch of an axis that is a run of the image's texels, forwards, backwards or one texel held.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TexelRun {
    /// First texel of the run, in the image.
    pub(crate) first: u32,
    /// Last texel of the run, in the image.
    pub(crate) last: u32,
    place: PlaceOnAxis,
}

/// Where a run's texels are, in texels from the footprint's origin.
#[derive(Clone, Copy, Debug)]
enum PlaceOnAxis {
    /// Texel `i` covers `[base + i, base + i + 1]`.
    Forward(f64),
    /// Texel `i` covers `[base - i, base - i + 1]`.
    Backward(f64),
    /// All texels together cover this interval: the edge of a clamped image, or more periods than are worth a look.
    Held(f64, f64),
}

impl TexelRun {
    /// The interval that the texels `from..=to` of this run cover.
    pub(crate) fn interval(&self, from: u32, to: u32) -> [f64; 2] {
        match self.place {
            PlaceOnAxis::Forward(base) => [base + f64::from(from), base + f64::from(to) + 1.0],
            PlaceOnAxis::Backward(base) => [base - f64::from(to), base - f64::from(from) + 1.0],
            PlaceOnAxis::Held(lo, hi) => [lo, hi],
        }
    }
}

/// More copies of the image than this are not distinguished.
///
/// A budget: more finds constant regions in footprints over more copies, and takes longer.
const MAX_COPIES: i64 = 4;

/// The stretches of the texels `from..=to` of a wrapped axis of `n` texels. Intervals count from `origin`.
pub(crate) fn stretches(wrap: Wrap, n: u32, from: i64, to: i64, origin: i64) -> SmallVec<[TexelRun; 4]> {
    let size = i64::from(n);
    let relative = |index: i64| (index - origin) as f64;
    let mut out = SmallVec::new();
    if wrap == Wrap::Clamp {
        if from < 0 {
            let place = PlaceOnAxis::Held(relative(from), relative(0.min(to + 1)));
            out.push(TexelRun { first: 0, last: 0, place });
        }
        if from < size && to >= 0 {
            let (first, last) = (from.max(0) as u32, to.min(size - 1) as u32);
            out.push(TexelRun { first, last, place: PlaceOnAxis::Forward(relative(0)) });
        }
        if to >= size {
            let place = PlaceOnAxis::Held(relative(size.max(from)), relative(to + 1));
            out.push(TexelRun { first: n - 1, last: n - 1, place });
        }
        return out;
    }
    let (first_copy, last_copy) = (from.div_euclid(size), to.div_euclid(size));
    if last_copy - first_copy >= MAX_COPIES {
        let place = PlaceOnAxis::Held(relative(from), relative(to + 1));
        out.push(TexelRun { first: 0, last: n - 1, place });
        return out;
    }
    for copy in first_copy..=last_copy {
        let start = copy * size;
        let (a, b) = ((from - start).max(0) as u32, (to - start).min(size - 1) as u32);
        out.push(if wrap == Wrap::Mirror && copy.rem_euclid(2) == 1 {
            let place = PlaceOnAxis::Backward(relative(start + size - 1));
            TexelRun { first: n - 1 - b, last: n - 1 - a, place }
        } else {
            TexelRun { first: a, last: b, place: PlaceOnAxis::Forward(relative(start)) }
        });
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blas::build::texture::wrap_index;

    /// Every texel of the range is in one stretch, as the texel that the lookup finds.
    #[test]
    fn stretches_agree_with_the_lookup() {
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for n in [1, 2, 5] {
                for from in -9..9 {
                    for to in from..from + 2 * i64::from(n) {
                        let found = stretches(wrap, n, from, to, -3);
                        for index in from..=to {
                            let texel = wrap_index(wrap, index, n);
                            let center = (index + 3) as f64 + 0.5;
                            let holds = |s: &&TexelRun| {
                                (s.first..=s.last).contains(&texel) && {
                                    let [lo, hi] = s.interval(texel, texel);
                                    lo < center && center < hi
                                }
                            };
                            assert_eq!(found.iter().filter(holds).count(), 1, "{wrap:?} {n} {from} {to} {index}");
                        }
                    }
                }
            }
        }
    }
}
