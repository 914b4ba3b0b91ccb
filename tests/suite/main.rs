//! All acceptance tests, in one binary. They know the crate by its public interface alone.
//!
//! `cargo test NAME` runs a module or a test: `cargo test golden`, `cargo test layering`. Sizes are in
//! [`common::tier`].

#![expect(clippy::incompatible_msrv, reason = "the crate alone is built with its oldest compiler")]

// Shared with the fuzz targets.
#[path = "../fuzz/checks/mod.rs"]
mod checks;
mod common;

mod agreement;
mod build;
mod chi_square;
mod circles;
mod debug;
mod distant;
mod docs;
mod double_check;
mod edits;
mod emission;
mod environment_light;
mod environment_share;
mod errors;
mod few;
// The files are of a machine that writes the least byte first.
#[cfg(target_endian = "little")]
mod frozen;
mod fuzz_regressions;
#[cfg(all(target_arch = "x86_64", target_os = "linux", target_env = "gnu"))]
mod golden;
mod groups;
mod instances;
mod invariance;
mod irradiance;
mod kinds;
mod layering;
mod memory;
mod motion;
mod near;
mod normalization;
mod procedural;
mod profiles;
mod projections;
mod properties;
mod refit;
mod segments;
mod selection;
mod stress;
mod suns;
mod together;
mod visibility;
