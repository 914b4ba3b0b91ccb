//! A small path tracer of one room that daylight enters through its windows.
//!
//! What it shares with [`lighting`], the only file that calls `fanlight`, is what any renderer has: a scene to cast
//! rays into ([`scene`]), the radiance of the sky in RGB ([`sky`]), and an integrator that asks for directions and
//! for densities of directions ([`path`], and [`photon`] for those in which light comes in).

mod camera;
mod daylight;
mod file;
mod film;
mod lighting;
mod mask;
mod path;
mod photon;
mod progressive;
mod room;
mod scene;
mod sky;
mod window;
mod world;

pub(crate) use camera::Camera;
pub(crate) use daylight::Daylight;
pub(crate) use file::{read_rgb, write_rgb};
pub(crate) use film::{Film, Image, Reference};
pub(crate) use path::{PathTracer, Strategy};
pub(crate) use progressive::{Budget, Progressive};
pub(crate) use room::Opening;
pub(crate) use sky::Sky;
pub(crate) use window::Window;
pub(crate) use world::World;

/// What can go wrong here ends the program, so a message is all that is kept of it.
pub(crate) type Error = Box<dyn core::error::Error + Send + Sync>;
