//! Scene files: glTF 2.0, as `.gltf` or `.glb`.
//!
//! The table in docs/gallery/README.md says what is honored, what is noted and what is refused. Each file here reads
//! one part of the format: [`container`] the file, [`data`] and [`accessor`] its bytes and arrays, [`hierarchy`] its
//! nodes, [`primitive`] its meshes, [`surface`] its materials, [`lamps`] its lights; [`read`] puts them together.
//! Whatever the bytes are, the outcome is a scene or an error of one line: nothing panics, calls itself as deep as the
//! file says, or takes much more memory than the file has bytes.

extern crate alloc;

mod accessor;
mod base64;
mod container;
mod contents;
mod data;
mod document;
mod extensions;
mod hierarchy;
mod images;
mod instances;
mod lamps;
mod meshopt;
mod notes;
mod primitive;
mod profiles;
mod read;
mod skin;
mod surface;
#[cfg(test)]
mod tests;
mod texture;
mod triangles;
mod write;

pub(crate) use data::Limits;
pub(crate) use read::{Prefixes, Read, read};
pub(crate) use write::write;
