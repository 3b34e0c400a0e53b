//! The command line; these doc comments are its help.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

/// Where was the vehicle really? Reads an MCAP recording of a sea trial, fuses its position and velocity
/// channels into one 3-D track, and writes that track back beside them.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 100)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Fuse a log's sources into one track, extrapolate it, and write both beside the original channels
    ///
    /// The original is never touched: the output is a new log whose data section begins with every byte of
    /// the original's.
    Fuse(Fuse),
    /// Make a log with known truth from a scenario file
    Simulate(Simulate),
    /// Show what is in a log: channels, rates, gaps, clocks, sources, and what is wrong with it
    ///
    /// Of a large log no more is read than that takes: some seconds for 50 GB.
    Inspect(Inspect),
    /// Write a commented config for a log: its sources, and every other key with its default
    Init(Init),
}

/// How a command talks.
#[derive(Args, Clone, Copy, Debug)]
pub struct Voice {
    /// Print one JSON object on stdout instead of text
    #[arg(long)]
    pub json: bool,
    /// Print no warnings on stderr
    #[arg(long, short)]
    pub quiet: bool,
}

/// Arguments of `fuse`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  trackfuse fuse dive.mcap                       writes dive.fused.mcap
  trackfuse fuse dive.mcap --config dive.toml    names sources, heights, horizon, ...

Exit codes: 0 done; 1 failed, nothing written; 2 usage or config wrong, sources ambiguous, output
exists; 3 done, with warnings that a person must read")]
pub struct Fuse {
    /// The log to read
    pub log: PathBuf,
    /// A config; without one, sources are recognised by their topics' names
    #[arg(long, short, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// The log to write [default: LOG with .fused.mcap for .mcap]
    #[arg(long, short, value_name = "OUT")]
    pub output: Option<PathBuf>,
    /// Replace an existing output
    #[arg(long)]
    pub force: bool,
    /// Prefix of the new topics [default: the config's, else /fused]
    #[arg(long)]
    pub prefix: Option<String>,
    /// How to talk.
    #[command(flatten)]
    pub voice: Voice,
}

/// Arguments of `simulate`.
#[derive(Args, Debug)]
pub struct Simulate {
    /// The scenario file (TOML; see `sample_logs`)
    pub scenario: PathBuf,
    /// The log to write
    #[arg(long, short, value_name = "LOG")]
    pub output: PathBuf,
    /// Replace an existing output
    #[arg(long)]
    pub force: bool,
    /// How to talk.
    #[command(flatten)]
    pub voice: Voice,
}

/// Arguments of `inspect`.
#[derive(Args, Debug)]
#[command(
    after_help = "Exit codes: 0 done; 1 the log can't be opened; 3 done, with warnings that a person must read"
)]
pub struct Inspect {
    /// The log to look into
    pub log: PathBuf,
    /// How to talk.
    #[command(flatten)]
    pub voice: Voice,
}

/// Arguments of `init`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  trackfuse init dive.mcap -o dive.toml && trackfuse fuse dive.mcap --config dive.toml

Exit codes: 0 done; 1 failed, nothing written; 2 output exists; 3 done, with warnings that a person
must read, such as that the config names no source until one is chosen in it")]
pub struct Init {
    /// The log to write a config for
    pub log: PathBuf,
    /// The config to write [default: stdout]
    #[arg(long, short, value_name = "CONFIG")]
    pub output: Option<PathBuf>,
    /// Replace an existing output
    #[arg(long)]
    pub force: bool,
    /// How to talk.
    #[command(flatten)]
    pub voice: Voice,
}
