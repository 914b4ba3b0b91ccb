//! How far a build has come, and whether it is to go on.

#[cfg(not(feature = "rayon"))]
use core::cell::Cell;
use core::ops::ControlFlow;
#[cfg(feature = "rayon")]
use core::sync::atomic::{AtomicUsize, Ordering};

/// Called with the share of the build that is done, from 0 to 1.
pub(crate) type Report<'a> = &'a (dyn Fn(f32) -> ControlFlow<()> + Sync);

/// The host does not want the result any more.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cancelled;

/// Share of the build time after which all lights have found their place; the rest is the collapse and the bounds. Only
/// shown to the host: chosen, not measured.
const PLACED: f32 = 0.9;

/// Counts the lights that have found their place, if a host wants to know.
pub(in crate::tlas) struct Progress<'a> {
    report: Option<Report<'a>>,
    total: usize,
    placed: Counter,
}

impl<'a> Progress<'a> {
    pub(in crate::tlas) fn new(report: Option<Report<'a>>, total: usize) -> Self {
        Self { report, total, placed: Counter::default() }
    }

    /// Counts more lights that have found their place.
    pub(in crate::tlas) fn add(&self, count: usize) {
        let Some(report) = self.report else { return };
        let placed = self.placed.add(count);
        if placed < CANCELLED && report(PLACED * placed as f32 / self.total as f32).is_break() {
            self.placed.cancel();
        }
    }

    pub(in crate::tlas) fn check(&self) -> Result<(), Cancelled> {
        if self.placed.get() < CANCELLED { Ok(()) } else { Err(Cancelled) }
    }
}

/// Count from which on the host has cancelled. *Format*: the highest bit, which no number of lights reaches.
const CANCELLED: usize = 1 << (usize::BITS - 1);

/// A number that all threads add to; without threads a plain one, which every target has.
#[derive(Default)]
struct Counter(#[cfg(feature = "rayon")] AtomicUsize, #[cfg(not(feature = "rayon"))] Cell<usize>);

#[cfg(feature = "rayon")]
impl Counter {
    fn add(&self, count: usize) -> usize {
        self.0.fetch_add(count, Ordering::Relaxed) + count
    }

    fn cancel(&self) {
        self.0.fetch_or(CANCELLED, Ordering::Relaxed);
    }

    fn get(&self) -> usize {
        self.0.load(Ordering::Relaxed)
    }
}

#[cfg(not(feature = "rayon"))]
impl Counter {
    fn add(&self, count: usize) -> usize {
        self.0.set(self.0.get() + count);
        self.0.get()
    }

    fn cancel(&self) {
        self.0.set(self.0.get() | CANCELLED);
    }

    fn get(&self) -> usize {
        self.0.get()
    }
}
