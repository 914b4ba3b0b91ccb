//! Loading of damaged and of made-up bytes, and sampling of whatever is accepted.
#![no_main]

#[path = "../checks/mod.rs"]
mod checks;

libfuzzer_sys::fuzz_target!(|data: &[u8]| checks::bytes(data));
