//! Scene files.
//!
//! | glTF | here |
//! | --- | --- |
//! | material's name starts with the prefix | a portal |
//! | alpha mode `MASK` | holes where alpha is below the cutoff |
//! | alpha mode `BLEND`, or transmission with a roughness below one half | a clear pane |
//! | transmission with a roughness of one half and more | paper: scatters light to both sides |
//! | metallic | glossy; everything else is diffuse |
//! | emissive | emits light, from both sides if the material is double-sided |

mod read;
mod surface;
mod write;

pub(crate) use read::read;
pub(crate) use write::write;
