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

/// Counts units of work that are done, if a host wants to know.
pub(crate) struct Progress<'a> {
    report: Option<Report<'a>>,
    total: f64,
    done: Counter,
}

impl<'a> Progress<'a> {
    /// Begins work of `total` units. A host that is there to be told gets shares of this.
    pub(crate) fn new(report: Option<Report<'a>>, total: f64) -> Self {
        Self { report, total, done: Counter::default() }
    }

    /// Counts more units that are done.
    pub(crate) fn add(&self, units: usize) {
        let Some(report) = self.report else { return };
        let done = self.done.add(units);
        // Never 1: that is for the end.
        let share = (done as f64 / self.total).min(LARGEST_SHARE) as f32;
        if done < CANCELLED && report(share).is_break() {
            self.done.cancel();
        }
    }

    /// Whether the host still wants the result.
    pub(crate) fn check(&self) -> Result<(), Cancelled> {
        if self.done.get() < CANCELLED { Ok(()) } else { Err(Cancelled) }
    }

    /// Tells the host that all is done.
    pub(crate) fn finish(&self) -> Result<(), Cancelled> {
        self.check()?;
        match self.report.map(|report| report(1.0)) {
            Some(ControlFlow::Break(())) => Err(Cancelled),
            Some(ControlFlow::Continue(())) | None => Ok(()),
        }
    }
}

/// Largest share that is reported before the end. Only shown to the host: chosen, not measured. Larger would look like
/// the end to a host that rounds.
const LARGEST_SHARE: f64 = 0.99;

/// Count from which on the host has canceled. *Format*: the highest bit, which no number of units reaches.
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
        self.0.set(self.0.get().saturating_add(count));
        self.0.get()
    }

    fn cancel(&self) {
        self.0.set(self.0.get() | CANCELLED);
    }

    fn get(&self) -> usize {
        self.0.get()
    }
}
