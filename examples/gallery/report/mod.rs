//! Comparisons of renderings: their errors in a table, and their pictures side by side.

mod compare;
mod picture;
mod progress;
#[path = "../../room/table.rs"]
mod table;

pub(crate) use compare::{Comparison, Contestant, Effort, compare};
pub(crate) use picture::{Picture, contact_sheet, save};
pub(crate) use progress::with_progress_bar;
