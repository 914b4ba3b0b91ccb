//! Sets `cfg(fanlight_avx512)` where the compiler knows AVX-512, which became stable later than what else the crate
//! needs.

use std::process::Command;

/// First minor version of Rust in which `avx512f` is a stable target feature.
const AVX512: u32 = 89;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(fanlight_avx512)");
    if minor_version().is_some_and(|minor| minor >= AVX512) {
        println!("cargo::rustc-cfg=fanlight_avx512");
    }
}

/// Returns 89 for a compiler that calls itself `rustc 1.89.0 (...)`; `None` for one that does not tell.
fn minor_version() -> Option<u32> {
    let output = Command::new(std::env::var_os("RUSTC")?).arg("--version").output().ok()?;
    core::str::from_utf8(&output.stdout).ok()?.split('.').nth(1)?.parse().ok()
}
