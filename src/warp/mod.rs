//! Maps between uniform numbers and what is drawn with them.

pub(crate) mod discrete;
pub(crate) mod equal_area;
pub(crate) mod variate;
