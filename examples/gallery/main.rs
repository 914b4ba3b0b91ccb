//! The program: `cargo run --release -p fanlight-gallery -- --help` lists the options.

use std::process::ExitCode;

fn main() -> ExitCode {
    fanlight_gallery::main()
}
