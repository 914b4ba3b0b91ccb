//! Plain geometry that knows nothing of light.

mod aabb;
mod cone;
mod polygon;
mod triangle;

pub(crate) use aabb::Aabb;
pub(crate) use cone::{Cone, angle};
pub(crate) use polygon::Polygon;
pub(crate) use triangle::{Triangle, intersect, normal_and_area, subdivision_centers};
