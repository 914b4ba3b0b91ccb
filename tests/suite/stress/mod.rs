//! Hostile scenes, seen from hostile points: no panic, no NaN, and how large the errors become.
//!
//! `cargo test --release --test suite -- --ignored --nocapture table` prints the table of `docs/STABILITY.md`.

mod columns;
mod estimate;
mod exact;
mod integral;
mod matrix;
mod measure;
mod numbers;
mod rows;
mod sky;
