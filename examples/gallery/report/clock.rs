//! Time that all threads of the program have spent on a processor: what another program takes away does not count.

use rustix::time::{ClockId, clock_gettime};

/// Seconds of all threads together.
pub(crate) fn seconds() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}
