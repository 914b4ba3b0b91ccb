//! Descends from a triangle to a cell of its barycentric domain.

mod cell;
mod descend;
mod guide;
mod target;

pub(crate) use cell::{CHILD_CENTERS, CHILD_STRIPS, child_corners, child_values};
pub(crate) use descend::{descend, descend_below};
pub(crate) use guide::{Draw, Follow, Guide};
pub(crate) use target::CellTarget;
