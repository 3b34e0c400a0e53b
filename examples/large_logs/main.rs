//! What reading, adding and fusing cost on large logs, beside `cp` and beside the mcap crate's own ways.
//!
//! ```sh
//! cargo run --release --example large_logs -- --folder /somewhere/with/10/GB
//! ```
//!
//! makes three logs of 2 GB, one after the other, and prints the table of `docs/performance.md`: medians of ratios,
//! each of two jobs that ran one after the other. Every job is a process of its own, reads a log that the system has
//! in its cache, and ends with its bytes on the disk.

mod added;
mod jobs;
mod make;
mod measure;
mod peers;

use std::path::PathBuf;

use clap::{Parser, ValueEnum};

/// What reading, adding and fusing cost on large logs, as Markdown tables
#[derive(Parser)]
struct Arguments {
    /// Where the logs and their copies go; they are deleted again
    #[arg(long)]
    folder: PathBuf,
    /// Pairs of each comparison
    #[arg(long, default_value_t = 5)]
    pairs: usize,
    /// Size of each log, MB
    #[arg(long, default_value_t = 2000)]
    megabytes: u64,
    /// Do one job and say what it took, on INPUT and OUTPUT
    #[arg(long, hide = true)]
    job: Option<Job>,
    #[arg(long, hide = true)]
    input: Option<PathBuf>,
    #[arg(long, hide = true)]
    output: Option<PathBuf>,
}

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
enum Job {
    /// Hands the sources' messages on.
    Messages,
    /// The same, every chunk read whole.
    WholeChunks,
    /// The same by the mcap crate's IndexedReader.
    IndexedReader,
    /// `cp --reflink=never` and `sync`.
    Copy,
    /// Adds a track of 70,000 points to a new file.
    Add,
    /// Adds the same track to the log itself.
    AddInPlace,
    /// Reads the sources and fits the track, as `fuse` does.
    Fit,
    /// `trackfuse fuse`.
    Fuse,
    /// `trackfuse fuse --in-place`.
    FuseInPlace,
    /// What `fuse` does, by the mcap crate's reader and writer.
    Rewrite,
}

fn main() {
    let arguments = Arguments::parse();
    match (arguments.job, &arguments.input, &arguments.output) {
        (Some(job), Some(input), Some(output)) => jobs::run(job, input, output),
        _ => print!("{}", measure::tables(&arguments.folder, arguments.pairs, arguments.megabytes)),
    }
}
