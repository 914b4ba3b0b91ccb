//! The tree over one triangle's barycentric domain (Ogaki, "Generalized Light Portals", HPG 2020).
//!
//! A node has [`ARITY`] children; their values are the average weights of the
//! texture over them. The tree knows nothing of the triangle's shape, only of its texture coordinates, so that
//! every triangle with the same texture and coordinates can share it.

mod axis;
mod barycentric;
mod build;
mod cell;
mod code;
mod coverage;
mod descend;
mod footprint;
mod grow;
mod node;
mod polygon;
mod procedural;
mod pyramid;
mod texture;
mod touched;
mod validate;

pub(crate) use barycentric::{ARITY, Cell as Domain, Lattice};
pub(crate) use build::build;
pub(crate) use cell::{Cell, at_corners, centers};
pub(crate) use coverage::{MAX_AVERAGE, storable};
pub(crate) use descend::{Draw, Follow, Guide, Parts, Shape, Worth, Worths, descend, descend_below};
pub(crate) use footprint::check_uv;
pub(crate) use node::{Block, LEAF, Root, averages, below, holds, mean};
pub use procedural::Procedural;
pub(crate) use procedural::{Function, build_procedural};
pub(crate) use pyramid::Prepared;
pub use texture::Texture;
pub(crate) use validate::{validate, validate_roots};
