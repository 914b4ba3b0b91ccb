//! Maps between the unit square, where random numbers live, and the domains that are sampled.

pub(crate) mod triangle;
