//! `trackfuse man`: manual pages, made of the help.

use std::io::Write;

use clap::CommandFactory;
use clap_mangen::Man as Page;

use super::{CommandError, Outcome, put};
use crate::cli::{Cli, Man};
use crate::log::{LogError, write_new};

/// Prints the manual page of the program, or writes those of all commands to a folder.
///
/// # Errors
/// [`CommandError`] where they can't be printed or written.
pub fn man(args: &Man) -> Result<Outcome, CommandError> {
    let mut program = Cli::command().disable_help_subcommand(true);
    // gives the commands their full names, and the options that all have
    program.build();
    let Some(folder) = &args.output else {
        put(&rendered(&Page::new(program))?)?;
        return Ok(Outcome::Done);
    };
    let commands: Vec<_> = program.get_subcommands().cloned().collect();
    for command in std::iter::once(program).chain(commands) {
        let page = Page::new(command);
        let path = folder.join(page.get_filename());
        let text = rendered(&page)?;
        let failed = |source| LogError::Write { path: path.clone(), source };
        write_new(&path, args.force, |file| file.write_all(&text).map_err(failed))?;
    }
    Ok(Outcome::Done)
}

fn rendered(page: &Page) -> Result<Vec<u8>, CommandError> {
    let mut text = Vec::new();
    page.render(&mut text).map_err(CommandError::Print)?;
    Ok(text)
}
