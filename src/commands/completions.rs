//! `trackfuse completions`: a script for a shell.

use clap::CommandFactory;

use super::{CommandError, Outcome, put};
use crate::cli::{Cli, Completions};

/// Prints the script that lets a shell complete commands and options.
///
/// # Errors
/// [`CommandError::Print`].
pub fn completions(args: &Completions) -> Result<Outcome, CommandError> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "trackfuse", &mut script);
    put(&script)?;
    Ok(Outcome::Done)
}
