//! Loading of damaged and of made-up bytes, and sampling of whatever is accepted.
#![no_main]

#[path = "../checks/mod.rs"]
#[expect(dead_code, reason = "the other targets use the rest")]
mod checks;

libfuzzer_sys::fuzz_target!(|data: &[u8]| checks::bytes(data));
