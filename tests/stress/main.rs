//! Hostile scenes, seen from hostile points: no panic, no NaN, and how large the errors become.
//!
//! `cargo test --release --test stress -- --ignored --nocapture table` prints the table of `docs/STABILITY.md`.

#[expect(dead_code, reason = "every test uses a part of what they share")]
#[path = "../common/mod.rs"]
mod common;

mod columns;
mod estimate;
mod exact;
mod integral;
mod matrix;
mod measure;
mod numbers;
mod rows;
mod sky;
