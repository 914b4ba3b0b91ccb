//! Loading of damaged tables of visibility, and sampling with whatever is accepted.
#![no_main]

#[path = "../checks/mod.rs"]
#[expect(dead_code, reason = "the other targets use the rest")]
mod checks;

libfuzzer_sys::fuzz_target!(|data: &[u8]| checks::visibility(data));
