//! The tree over one triangle's barycentric domain (Ogaki, "Generalized Light Portals", HPG 2020).
//!
//! A node has [`ARITY`] children; their values are the average weights of the texture over them. The tree knows nothing
//! of the triangle's shape, only of its texture coordinates, so that every triangle with the same texture and
//! coordinates can share it.
//!
//! `build` makes trees from images and functions; `walk` descends in them. Both rest on the numbering of the cells
//! ([`barycentric`]) and on the nodes ([`node`]).

mod barycentric;
mod build;
mod code;
mod node;
mod validate;
mod walk;

pub(crate) use barycentric::{ARITY, EDGE_CELLS, Lattice, LatticeCell};
pub(crate) use build::{ImageTree, RegisteredFunction, build_images, build_procedural, check_uv, image_work};
pub use build::{Procedural, Texture};
#[cfg(test)]
pub(crate) use build::{TexturePyramid, build};
pub(crate) use node::{CellNode, LEAF, MAX_AVERAGE, Root, averages, below, holds, mean, places, storable};
pub(crate) use validate::{validate, validate_roots};
pub(crate) use walk::{
    CHILD_CENTERS, CHILD_STRIPS, CellTarget, Draw, Follow, Guide, child_corners, child_values, descend, descend_below,
};
