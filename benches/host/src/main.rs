//! Compares fanlight with what a plain path tracer has without it: `cargo bench -p fanlight-host --bench host`.

use std::process::ExitCode;

fn main() -> ExitCode {
    match fanlight_host::run() {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
