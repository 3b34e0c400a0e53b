//! The `trackfuse` program: parse, dispatch, one error print, exit code.

use std::process::ExitCode;

use clap::Parser;
use trackfuse::cli::{Cli, Command};
use trackfuse::commands;

fn main() -> ExitCode {
    let done = match &Cli::parse().command {
        Command::Fuse(args) => commands::fuse(args),
        Command::Compare(args) => commands::compare(args),
        Command::Export(args) => commands::export(args),
        Command::Simulate(args) => commands::simulate(args),
        Command::Inspect(args) => commands::inspect(args),
        Command::Init(args) => commands::init(args),
    };
    match done {
        Ok(outcome) => outcome.into(),
        Err(error) => {
            commands::explain(&error);
            ExitCode::from(error.exit_code())
        }
    }
}
