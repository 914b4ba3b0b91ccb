//! Work on large arrays, on several threads with the feature `rayon`. How the work is cut into parts does not depend on
//! the number of threads, so neither does any result. This is the only file that knows `rayon`.

use alloc::vec::Vec;

/// Number of elements from which on work is handed to another thread. Smaller numbers pay for the handing over, larger
/// ones leave threads idle at the end. *Format* as well: a build reports its progress in parts of this size.
pub(crate) const WORTHWHILE: usize = 4096;
/// Number of elements that are summed up in one go. *Format*: sums, and so the bits of a build, depend on it. Smaller
/// parts cost more merging, larger ones occupy fewer threads.
const CHUNK: usize = 1 << 15;

/// Runs both, side by side if they handle many elements.
#[cfg(feature = "rayon")]
pub(crate) fn both(left: impl FnOnce() + Send, right: impl FnOnce() + Send, size: usize) {
    if size >= WORTHWHILE {
        rayon::join(left, right);
    } else {
        left();
        right();
    }
}

/// Runs both, one after the other.
#[cfg(not(feature = "rayon"))]
pub(crate) fn both(left: impl FnOnce(), right: impl FnOnce(), _size: usize) {
    left();
    right();
}

/// Results for the parts of a slice that is not empty, merged from the first to the last.
pub(crate) fn reduce<T: Sync, R: Send>(
    elements: &[T],
    part: impl Fn(&[T]) -> R + Sync + Send,
    merge: impl Fn(R, R) -> R,
) -> R {
    let (first, rest) = elements.split_at(elements.len().min(CHUNK));
    if rest.is_empty() {
        return part(first);
    }
    #[cfg(feature = "rayon")]
    let results: Vec<R> = {
        use rayon::prelude::*;
        elements.par_chunks(CHUNK).map(part).collect()
    };
    #[cfg(not(feature = "rayon"))]
    let results: Vec<R> = elements.chunks(CHUNK).map(part).collect();
    let mut results = results.into_iter();
    let first = results.next().expect("the slice is not empty");
    results.fold(first, merge)
}

/// `element(0..count)` as an array.
pub(crate) fn collect<T: Send>(count: usize, element: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        (0..count).into_par_iter().with_min_len(WORTHWHILE).map(element).collect()
    }
    #[cfg(not(feature = "rayon"))]
    (0..count).map(element).collect()
}

/// Works on every element, side by side if that means to handle many things of some `size`.
#[cfg(feature = "rayon")]
pub(crate) fn for_each<T: Send>(elements: &mut [T], size: usize, work: impl Fn(&mut T) + Sync + Send) {
    use rayon::prelude::*;
    if size >= WORTHWHILE / 4 {
        elements.par_iter_mut().for_each(work);
    } else {
        elements.iter_mut().for_each(work);
    }
}

/// Works on every element, one after the other.
#[cfg(not(feature = "rayon"))]
pub(crate) fn for_each<T>(elements: &mut [T], _size: usize, work: impl Fn(&mut T)) {
    elements.iter_mut().for_each(work);
}

/// Returns the results for all elements in their order. Runs on several threads from `least` elements on.
#[cfg_attr(not(test), expect(dead_code, reason = "the other structures will use it"))]
pub(crate) fn map<T: Sync, R: Send>(elements: &[T], least: usize, result: impl Fn(&T) -> R + Sync + Send) -> Vec<R> {
    #[cfg(feature = "rayon")]
    if elements.len() >= least {
        use rayon::prelude::*;
        return elements.par_iter().map(result).collect();
    }
    #[cfg(not(feature = "rayon"))]
    let _ = least;
    elements.iter().map(result).collect()
}

/// Calls `work` with each chunk of `length` elements, of which the last may be shorter, and its number. Runs on several
/// threads if there is more than one chunk.
#[cfg_attr(not(test), expect(dead_code, reason = "the other structures will use it"))]
pub(crate) fn for_each_chunk<T: Send>(elements: &mut [T], length: usize, work: impl Fn(usize, &mut [T]) + Sync + Send) {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        elements.par_chunks_mut(length).enumerate().for_each(|(number, chunk)| work(number, chunk));
    }
    #[cfg(not(feature = "rayon"))]
    elements.chunks_mut(length).enumerate().for_each(|(number, chunk)| work(number, chunk));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_in_order() {
        let elements: Vec<usize> = (0..10_000).collect();
        for least in [0, usize::MAX] {
            assert!(map(&elements, least, |i| 2 * i).into_iter().eq((0..10_000).map(|i| 2 * i)));
        }
        let mut elements = elements;
        for_each_chunk(&mut elements, 300, |number, chunk| chunk.iter_mut().for_each(|i| *i += number));
        assert!(elements.into_iter().eq((0..10_000).map(|i| i + i / 300)));
    }
}
