//! Time that a thread has spent on a processor.

use rustix::time::{ClockId, clock_gettime};

/// Returns the CPU time of the calling thread, in seconds. Time in which another process had the core does not count.
pub(crate) fn thread_seconds() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}
