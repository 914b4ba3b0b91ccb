//! Maps between the unit square, where random numbers live, and the domains that are sampled.

pub(crate) mod discrete;
pub(crate) mod equal_area;
pub(crate) mod projected_cap;
mod projected_triangle;
pub(crate) mod spherical_cap;
pub(crate) mod spherical_ellipse;
mod spherical_triangle;
pub(crate) mod triangle;
pub(crate) mod variate;

pub(crate) use discrete::{
    keep_least, keep_positive, keep_possible, pick, pick_pair, pick_wide, pmf, pmf_wide, sum, sum_wide, within_range,
};
pub(crate) use projected_triangle::ProjectedTriangle;
pub(crate) use spherical_triangle::{COLUMNS, SphericalColumns, SphericalTriangle};
pub(crate) use variate::{Variate, seed};
