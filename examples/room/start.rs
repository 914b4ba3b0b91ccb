//! How the programs begin and end.

use std::process::ExitCode;

use crate::render::Error;

/// Runs a program as its arguments say, `None` being the wish for help; an error ends it with a message.
pub(crate) fn start<A>(
    arguments: Result<Option<A>, Error>,
    help: &str,
    run: impl FnOnce(&A) -> Result<(), Error>,
) -> ExitCode {
    let result = match arguments {
        Ok(Some(arguments)) => run(&arguments),
        Ok(None) => {
            print!("{help}");
            Ok(())
        }
        Err(error) => Err(format!("{error} (--help lists the options)").into()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
