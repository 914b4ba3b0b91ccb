//! Plain geometry that knows nothing of light.

mod aabb;
mod cone;
mod horizon;
mod motion;
mod placement;
mod polygon;
mod triangle;

pub(crate) use aabb::Aabb;
pub(crate) use cone::{Cone, angle};
pub(crate) use horizon::{HORIZON_ROUNDING, horizon, is_below};
pub(crate) use motion::{area_vectors, between, cofactors, determinants};
pub(crate) use placement::{ForwardMap, Placement, norm};
pub(crate) use polygon::Polygon;
pub(crate) use triangle::{Triangle, barycentrics_of, cross_plane, intersect, normal_and_area, subdivision_centers};
