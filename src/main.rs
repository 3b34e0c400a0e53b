//! The `trackfuse` program: parse, dispatch, one error print, exit code.

use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};

use clap::Parser;
use trackfuse::cli::{Cli, Command};
use trackfuse::commands;
use trackfuse::log::INTERRUPTION;

/// The signal that came, 0 for none.
static SIGNAL: AtomicUsize = AtomicUsize::new(0);

/// Lets an output be taken back before a signal ends the program; the second signal ends it at once.
fn heed_signals() -> std::io::Result<()> {
    use signal_hook::{consts, flag};
    for signal in [consts::SIGINT, consts::SIGTERM] {
        // They run in this order.
        flag::register_conditional_default(signal, &INTERRUPTION.at_once)?;
        flag::register(signal, &INTERRUPTION.at_once)?;
        flag::register_usize(signal, &SIGNAL, signal as usize)?;
        flag::register(signal, &INTERRUPTION.asked)?;
    }
    Ok(())
}

fn main() -> ExitCode {
    // Without it a signal leaves a temporary file, which the next run sweeps.
    let _ = heed_signals();
    let done = match &Cli::parse().command {
        Command::Fuse(args) => commands::fuse(args),
        Command::Usbl(args) => commands::usbl(args),
        Command::Compare(args) => commands::compare(args),
        Command::Export(args) => commands::export(args),
        Command::Simulate(args) => commands::simulate(args),
        Command::Restore(args) => commands::restore(args),
        Command::Inspect(args) => commands::inspect(args),
        Command::Init(args) => commands::init(args),
        Command::Completions(args) => commands::completions(args),
        Command::Man(args) => commands::man(args),
    };
    match done {
        Ok(outcome) => outcome.into(),
        Err(error) => {
            commands::explain(&error);
            let signal = SIGNAL.load(Ordering::SeqCst);
            if signal != 0 {
                // so that a shell's loop over many logs ends too
                let _ = signal_hook::low_level::emulate_default_handler(signal as i32);
            }
            ExitCode::from(error.exit_code())
        }
    }
}
