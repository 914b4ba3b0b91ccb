//! Comparisons of renderings: their errors in a table, and their pictures side by side.

mod clock;
mod compare;
mod picture;
mod progress;
mod statistics;

pub(crate) use clock::seconds;
pub(crate) use compare::{Comparison, Contestant, Effort, Role, compare};
pub(crate) use picture::{Picture, contact_sheet, images_of, save};
pub(crate) use progress::with_progress_bar;
