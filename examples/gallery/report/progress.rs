//! A bar that moves while one waits.

use indicatif::{ProgressBar, ProgressStyle};

/// Runs a task that tells how much of it is done, with a bar that moves where standard error is a terminal.
pub(crate) fn with_progress_bar<T>(name: &str, task: impl FnOnce(&dyn Fn(f64)) -> T) -> T {
    const STEPS: f64 = 1000.0;
    let bar = ProgressBar::new(STEPS as u64).with_message(name.to_owned());
    if let Ok(style) = ProgressStyle::with_template("{msg:36} {wide_bar} {elapsed:>4}") {
        bar.set_style(style);
    }
    let result = task(&|done| bar.set_position((STEPS * done) as u64));
    bar.finish_and_clear();
    result
}
