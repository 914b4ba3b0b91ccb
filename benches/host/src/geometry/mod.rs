//! Plain geometry that scenes are made of.

mod mesh;
mod plane;
mod rectangle;
mod shapes;

pub(crate) use mesh::Mesh;
pub(crate) use plane::{Plane, rectangle_outline};
pub(crate) use rectangle::Rectangle;
pub(crate) use shapes::{icosphere, sphere};
