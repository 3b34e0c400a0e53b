//! The commands: each holds the order of its steps, and nothing else.

mod addition;
mod compare;
mod completions;
mod export;
mod fuse;
mod html_report;
mod init;
mod inspect;
mod man;
mod progress;
mod restore;
mod simulate;
mod usbl;

pub use compare::compare;
pub use completions::completions;
pub use export::{ExportError, export};
pub use fuse::fuse;
pub use init::init;
pub use inspect::inspect;
pub use man::man;
pub use restore::restore;
pub use simulate::simulate;
pub use usbl::usbl;

use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anstyle::{AnsiColor, Style};

use crate::cli::{Memory, Voice};
use crate::config::{ConfigError, why_unread};
use crate::estimate::EstimateError;
use crate::log::{Log, LogError, ReadOptions};
use crate::printable::printable;
use crate::resolve::ResolveError;
use crate::simulate::SimulateError;
use crate::source::SourceError;
use crate::time::Time;
use progress::Bar;

/// How the words look that lines begin with, on terminals that show colours and where `NO_COLOR` is not set.
const ERROR: Style = AnsiColor::Red.on_default().bold();
const WARNING: Style = AnsiColor::Yellow.on_default().bold();
const HINT: Style = AnsiColor::Cyan.on_default().bold();

/// How a command ended that did what it should.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Done.
    Done,
    /// Done, with warnings that a person must read.
    Warned,
}

/// Why a command wrote nothing.
#[derive(Debug, thiserror::Error)]
pub enum CommandError {
    /// The config.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The log.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The sources.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// The estimator.
    #[error("{0}")]
    Estimate(#[from] EstimateError),
    /// The simulator.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// What was asked can't be done for these sources.
    #[error(transparent)]
    Resolve(#[from] ResolveError),
    /// The track is no track.
    #[error("the track is not finite at {time}: some samples are too large to compute with")]
    NotFinite {
        /// The first such point.
        time: Time,
    },
    /// A track and its reference share no instant.
    #[error("the track and the reference have no instant in common: {estimate} and {reference} since T0")]
    NothingInCommon {
        /// When the track is known.
        estimate: String,
        /// When the reference is.
        reference: String,
    },
    /// The track can't be had in a format.
    #[error(transparent)]
    Export(#[from] ExportError),
    /// A scenario, with its file.
    #[error("{path}: {error}")]
    Scenario {
        /// The file.
        path: String,
        /// What is wrong with it.
        error: Box<SimulateError>,
    },
    /// What was found can't be printed.
    #[error("the result can't be printed: {0}")]
    Print(io::Error),
    /// Two outputs would bear one name.
    #[error("the log and its report can't both be {path:?}")]
    OneName {
        /// That name.
        path: PathBuf,
    },
    /// The log is written, and its report can't get its name.
    #[error("{log} is written, but its report is not: {source}")]
    ReportLost {
        /// The log.
        log: String,
        /// Why the report isn't.
        source: LogError,
    },
    /// A scenario that can't be read.
    #[error("scenario {path}: {}", why_unread(source))]
    File {
        /// The file.
        path: String,
        /// What the system said.
        source: io::Error,
    },
}

impl CommandError {
    /// What to do about it.
    #[must_use]
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Config(error) => error.hint(),
            Self::Log(error) => error.hint(),
            Self::Source(error) => error.hint(),
            Self::Resolve(error) => Some(error.hint()),
            Self::Export(error) => Some(error.hint()),
            Self::Estimate(error) => error.hint(),
            Self::File { .. } => {
                Some("a scenario is a TOML file, such as `sample_logs/steep_climb.scenario.toml`".into())
            }
            Self::NothingInCommon { .. } => {
                Some("`--reference-time log` takes the reference's log times instead of its stamps".into())
            }
            _ => None,
        }
    }

    /// 2 where the user's words are at fault, 3 where a log is written all the same, else 1.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        if matches!(self, Self::ReportLost { .. }) {
            return 3;
        }
        let usage = match self {
            Self::Config(_)
            | Self::Resolve(_)
            | Self::OneName { .. }
            | Self::Export(_)
            | Self::File { .. } => true,
            Self::Source(SourceError::Log(error)) | Self::Log(error) => is_usage(error),
            Self::Source(error) => error.is_usage(),
            Self::Simulate(error) => is_of_scenario(error),
            Self::Scenario { error, .. } => is_of_scenario(error),
            Self::Print(_)
            | Self::Estimate(_)
            | Self::NotFinite { .. }
            | Self::ReportLost { .. }
            | Self::NothingInCommon { .. } => false,
        };
        if usage { 2 } else { 1 }
    }
}

fn is_usage(error: &LogError) -> bool {
    matches!(
        error,
        LogError::OutputExists { .. } | LogError::OutputIsInput { .. } | LogError::TopicTaken { .. }
    )
}

fn is_of_scenario(error: &SimulateError) -> bool {
    !matches!(error, SimulateError::Diverged { .. } | SimulateError::Log(_))
}

impl From<Outcome> for ExitCode {
    fn from(outcome: Outcome) -> Self {
        match outcome {
            Outcome::Done => Self::SUCCESS,
            Outcome::Warned => Self::from(3),
        }
    }
}

/// Opens a command's log, and says what is wrong with it; refuses it then where only a whole one will do. `bar`
/// shows how long work on it gets on.
fn open(path: &Path, memory: Memory, strict: bool, bar: &Bar) -> Result<(Log, Vec<String>), LogError> {
    checked(Log::open_with(path, options(memory, bar))?, strict)
}

/// How a command reads its log; `bar` shows how long work on it gets on.
fn options(memory: Memory, bar: &Bar) -> ReadOptions {
    let (memory_limit, observer) = (memory.memory_limit, bar.observer());
    ReadOptions { memory_limit, observer, ..ReadOptions::default() }
}

/// A log with what is wrong with it; refuses it where only a whole one will do.
fn checked(log: Log, strict: bool) -> Result<(Log, Vec<String>), LogError> {
    if strict {
        log.ensure_as_summed_up()?;
    }
    let warnings = log.damage_warnings();
    Ok((log, warnings))
}

/// Prints why a command wrote nothing, and what to do about it, on stderr.
pub fn explain(error: &CommandError) {
    let mut stderr = anstream::stderr().lock();
    let text = error.to_string();
    let lines: Vec<_> = text.lines().map(printable).collect();
    let _ = writeln!(stderr, "{ERROR}error:{ERROR:#} {}", lines.join("\n"));
    if let Some(hint) = error.hint() {
        let _ = writeln!(stderr, "{HINT}hint:{HINT:#} {hint}");
    }
}

/// `dive.mcap` -> `dive.fused.mcap`.
fn beside(log: &Path, what: &str) -> PathBuf {
    let mut name = log.file_stem().unwrap_or(log.as_os_str()).to_owned();
    name.push(format!(".{what}.mcap"));
    log.with_file_name(name)
}

/// Prints what is worth knowing, and no reason to look into it.
fn note(voice: Voice, text: &str) {
    if !voice.quiet {
        let _ = writeln!(anstream::stderr(), "{HINT}note:{HINT:#} {}", printable(text));
    }
}

/// Prints the summary of what a command wrote elsewhere: see [`print`].
fn say(voice: Voice, text: &str, json: &impl serde::Serialize, warnings: &[String]) {
    if let Err(error) = print(voice, text, json, warnings) {
        let _ = writeln!(
            anstream::stderr(),
            "{WARNING}warning:{WARNING:#} the output is written, but its summary can't be printed: {error}"
        );
    }
}

/// Prints what a command is there to print: see [`print`].
fn show(
    voice: Voice,
    text: &str,
    json: &impl serde::Serialize,
    warnings: &[String],
) -> Result<(), CommandError> {
    print(voice, text, json, warnings).map_err(CommandError::Print)
}

/// Prints a command's result on stdout, and its warnings on stderr where they would not be seen otherwise:
/// the text holds them too.
fn print(
    voice: Voice,
    text: &str,
    json: &impl serde::Serialize,
    warnings: &[String],
) -> Result<(), io::Error> {
    let mut stdout = io::stdout().lock();
    let printed = if voice.json {
        let json = serde_json::to_string_pretty(json).unwrap_or_default();
        writeln!(stdout, "{json}")
    } else {
        write!(anstream::AutoStream::auto(&mut stdout), "{}", coloured(text))
    };
    if voice.json || !stdout.is_terminal() {
        warn(voice, warnings);
    }
    match printed.and_then(|()| stdout.flush()) {
        // a reader that went away wants no more
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(error),
        _ => Ok(()),
    }
}

/// The text, with what a person must read of it in colour.
fn coloured(text: &str) -> String {
    text.replace("\nwarning:", &format!("\n{WARNING}warning:{WARNING:#}"))
}

/// Prints bytes that are for other programs on stdout.
fn put(bytes: &[u8]) -> Result<(), CommandError> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(bytes).and_then(|()| stdout.flush()) {
        // a reader that went away wants no more
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(CommandError::Print(error)),
        _ => Ok(()),
    }
}

/// Prints warnings on stderr, unless nobody wants them there.
fn warn(voice: Voice, warnings: &[String]) {
    if !voice.quiet {
        let mut stderr = anstream::stderr().lock();
        for warning in warnings {
            let _ = writeln!(stderr, "{WARNING}warning:{WARNING:#} {}", printable(warning));
        }
    }
}
