//! Work on large arrays, side by side with the feature `rayon`. How it is cut into parts does not depend on the number
//! of threads, so neither does any result.

use alloc::vec::Vec;

/// From this size on work is worth handing to another thread. *Chosen*; affects time alone.
pub(crate) const WORTHWHILE: usize = 4096;
/// Elements that are summed up in one go. *Chosen*; it fixes the order of sums, so that another value changes bits.
pub(crate) const SUM_CHUNK: usize = 1 << 15;

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
    let (first, rest) = elements.split_at(elements.len().min(SUM_CHUNK));
    if rest.is_empty() {
        return part(first);
    }
    #[cfg(feature = "rayon")]
    let results: Vec<R> = {
        use rayon::prelude::*;
        elements.par_chunks(SUM_CHUNK).map(part).collect()
    };
    #[cfg(not(feature = "rayon"))]
    let results: Vec<R> = elements.chunks(SUM_CHUNK).map(part).collect();
    let mut results = results.into_iter();
    let first = results.next().expect("the slice is not empty");
    results.fold(first, merge)
}

/// Returns the sum of `element(0..count)`.
pub(crate) fn sum(count: usize, element: impl Fn(usize) -> f64 + Sync + Send) -> f64 {
    let part = |chunk: usize| (chunk * SUM_CHUNK..((chunk + 1) * SUM_CHUNK).min(count)).map(&element).sum::<f64>();
    let chunks = count.div_ceil(SUM_CHUNK);
    #[cfg(feature = "rayon")]
    let parts: Vec<f64> = {
        use rayon::prelude::*;
        (0..chunks).into_par_iter().map(part).collect()
    };
    #[cfg(not(feature = "rayon"))]
    let parts: Vec<f64> = (0..chunks).map(part).collect();
    parts.into_iter().sum()
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

/// Maps all items, side by side if they are `threshold` or more. Each one is mapped alone and their order stays: the
/// first failure in this order is the one that is returned.
#[cfg(feature = "rayon")]
pub(crate) fn map<T: Sync, R: Send, F: Send>(
    items: &[T],
    threshold: usize,
    map: impl Fn(&T) -> Result<R, F> + Sync + Send,
) -> Result<Vec<R>, F> {
    if items.len() < threshold {
        return items.iter().map(map).collect();
    }
    use rayon::prelude::*;
    let mapped: Vec<Result<R, F>> = items.par_iter().map(map).collect();
    mapped.into_iter().collect()
}

/// Maps all items, one after the other.
#[cfg(not(feature = "rayon"))]
pub(crate) fn map<T, R, F>(items: &[T], _threshold: usize, map: impl Fn(&T) -> Result<R, F>) -> Result<Vec<R>, F> {
    items.iter().map(map).collect()
}

/// Passes every chunk of a slice to `work`, with the chunk's index. All chunks have `chunk_len` elements, which is
/// above zero, but perhaps the last one.
#[cfg(feature = "rayon")]
pub(crate) fn for_each_chunk<T: Send>(
    elements: &mut [T],
    chunk_len: usize,
    work: impl Fn(usize, &mut [T]) + Sync + Send,
) {
    use rayon::prelude::*;
    elements.par_chunks_mut(chunk_len).enumerate().for_each(|(index, chunk)| work(index, chunk));
}

/// Passes every chunk of a slice to `work`, one after the other.
#[cfg(not(feature = "rayon"))]
pub(crate) fn for_each_chunk<T>(elements: &mut [T], chunk_len: usize, work: impl Fn(usize, &mut [T])) {
    elements.chunks_mut(chunk_len).enumerate().for_each(|(index, chunk)| work(index, chunk));
}
