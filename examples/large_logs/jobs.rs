//! The jobs, each done in a process of its own that says what it took.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use clap::Parser;
use trackfuse::cli::{self, Cli};
use trackfuse::commands;
use trackfuse::config::Config;
use trackfuse::fusion::{self, Fusion};
use trackfuse::log::{Destination, Log, LogError, ReadOptions};
use trackfuse::resolve;
use trackfuse::sample::Source;
use trackfuse::source::{self, Samples};
use trackfuse::time::Time;

use crate::{Job, added, make, peers};

/// The last line that a job prints begins with this.
pub(crate) const TOOK: &str = "took ";

/// Does a job, and prints its seconds and the most memory that the process had, kB.
pub(crate) fn run(job: Job, input: &Path, output: &Path) {
    // made beforehand: it is not what is measured
    let track = added::track(1_700_000_000_000_000_000);
    let start = Instant::now();
    match job {
        Job::Messages => read(input, false),
        Job::WholeChunks => read(input, true),
        Job::IndexedReader => assert_eq!(peers::read_indexed(input), 2 * make::SAMPLES, "messages"),
        Job::Copy => copy(input, output),
        Job::Add => {
            let to = Destination::New { out: output.to_owned(), force: true };
            added::add(input, &to, &track).expect("a log");
        }
        Job::AddInPlace => added::add(output, &Destination::InPlace, &track).expect("a log"),
        Job::Fit => drop(fit(input)),
        Job::Fuse => fuse(&[input.as_os_str(), "-o".as_ref(), output.as_os_str(), "--force".as_ref()]),
        Job::FuseInPlace => fuse(&[output.as_os_str(), "--in-place".as_ref()]),
        Job::Rewrite => peers::rewrite(input, output, &fit(input)),
    }
    let took_s = start.elapsed().as_secs_f64();
    println!("\n{TOOK}{took_s} {}", peak_kb());
}

/// The most memory that this process had so far, kB.
fn peak_kb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or(0)
}

fn read(input: &Path, whole_chunks: bool) {
    let log = Log::open_with(input, ReadOptions { whole_chunks, ..ReadOptions::default() }).expect("a log");
    let topics = ["/tether/track", "/beacon/track"];
    let channels: BTreeSet<u16> =
        topics.iter().flat_map(|topic| log.index().channels_of(topic)).map(|c| c.id).collect();
    let (mut count, mut bytes) = (0_u64, 0);
    let read = log.for_each_message(&channels, |message| {
        count += 1;
        bytes += message.data.len();
        Ok::<_, LogError>(())
    });
    assert!(read.expect("messages").damaged.is_empty() && bytes > 0, "a whole log");
    assert_eq!(count, 2 * make::SAMPLES, "messages");
}

fn copy(input: &Path, output: &Path) {
    let done = Command::new("cp").arg("--reflink=never").args([input, output]).status();
    assert!(done.is_ok_and(|status| status.success()), "cp");
    assert!(Command::new("sync").arg(output).status().is_ok_and(|status| status.success()), "sync");
}

fn fuse(args: &[&std::ffi::OsStr]) {
    let words = ["trackfuse", "fuse", "--quiet"].map(std::ffi::OsStr::new);
    let cli = Cli::parse_from(words.iter().chain(args));
    let cli::Command::Fuse(args) = &cli.command else { panic!("fuse") };
    commands::fuse(args).expect("a track");
}

/// What `fuse` makes of a log's sources.
pub(crate) struct Fitted {
    pub(crate) sources: Vec<Source>,
    pub(crate) origin: Time,
    pub(crate) rate_hz: f64,
    pub(crate) fusion: Fusion,
}

/// The steps of `fuse` up to the track.
fn fit(input: &Path) -> Fitted {
    let mut config = Config::default();
    let log = Log::open(input).expect("a log");
    config.source = source::recognise(&log).expect("sources").sources;
    let Samples { mut loaded, origin, .. } =
        source::load(&log, &config.source, false, None).expect("samples");
    let datum = source::datum(&config.source);
    let sources: Vec<Source> = loaded.iter_mut().map(|l| std::mem::take(&mut l.source)).collect();
    let plan = resolve::plan(&mut config, &loaded, &sources, datum, origin, &mut Vec::new()).expect("a plan");
    let fusion = fusion::fuse(&sources, &plan).expect("a track");
    Fitted { sources, origin, rate_hz: plan.rate_hz, fusion }
}
