//! A small path tracer for triangle meshes.
//!
//! What it shares with [`lighting`], [`sources`] and [`weights`], the only files that call `fanlight` for it, is what
//! any renderer has: a scene to cast rays into ([`scene`]), materials ([`material`], [`bsdf`]), lights without a
//! surface ([`lamp`]), the radiance of the sky ([`world`]), and an integrator that asks for directions and for
//! densities of directions ([`path`], and [`photon`] for light that is traced from its source).

extern crate alloc;

mod bitmap;
mod bsdf;
mod camera;
#[path = "../../room/render/daylight.rs"]
mod daylight;
mod facets;
#[path = "../../room/render/file.rs"]
mod file;
#[path = "../../room/render/film.rs"]
mod film;
mod lamp;
mod lighting;
mod material;
mod mesh;
mod model;
mod path;
mod photon;
mod power_table;
#[path = "../../room/render/progressive.rs"]
mod progressive;
mod published;
mod random;
mod scene;
#[path = "../../room/render/sky.rs"]
mod sky;
mod sources;
mod technique;
mod texel_table;
mod vertex;
mod weights;
mod world;

pub(crate) use bitmap::{Bitmap, encode_srgb};
pub(crate) use camera::Camera;
pub(crate) use daylight::Daylight;
pub(crate) use file::{read_rgb, write_rgb};
pub(crate) use film::{Film, Image, Reference};
pub(crate) use lamp::{Diagram, Lamp, LampKind};
pub(crate) use lighting::{Filter, Illumination, Lights, Wrap};
pub(crate) use material::{Lobe, Material};
pub(crate) use mesh::{Copies, Mesh};
pub(crate) use model::{Fog, Model};
pub(crate) use path::PathTracer;
pub(crate) use progressive::{Budget, Progressive};
pub(crate) use published::Published;
pub(crate) use random::Random;
pub(crate) use scene::Point;
pub(crate) use sky::{LUMINANCE, Sky, direction_of};
pub(crate) use technique::{LightChoice, Techniques};
pub(crate) use texel_table::TexelTable;
pub(crate) use world::World;

/// What can go wrong here ends the program, so a message is all that is kept of it.
pub(crate) type Error = Box<dyn core::error::Error + Send + Sync>;
