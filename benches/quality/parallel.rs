//! Work that is spread over all processors.

use core::num::NonZero;

/// Maps items, each with its number, on all processors. The order stays.
pub(crate) fn parallel<T: Sync, R: Send>(items: &[T], map: impl Fn(usize, &T) -> R + Sync) -> Vec<R> {
    let threads = std::thread::available_parallelism().map_or(1, NonZero::get);
    // Small blocks in alternation, as neighboring items can be as costly.
    let share = |thread: usize| -> Vec<(usize, R)> {
        (thread..items.len()).step_by(threads).map(|i| (i, map(i, &items[i]))).collect()
    };
    let mut results: Vec<(usize, R)> = std::thread::scope(|scope| {
        let handles: Vec<_> = (0..threads)
            .map(|thread| {
                scope.spawn({
                    let share = &share;
                    move || share(thread)
                })
            })
            .collect();
        handles.into_iter().flat_map(|handle| handle.join().expect("no measurement panics")).collect()
    });
    results.sort_by_key(|(i, _)| *i);
    results.into_iter().map(|(_, result)| result).collect()
}
