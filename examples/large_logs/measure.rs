//! Jobs in turn, and the table of what they took.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::Job;
use crate::jobs::TOOK;
use crate::make::{Kind, make};

/// What one job took.
#[derive(Clone, Copy, Debug)]
struct Took {
    s: f64,
    peak_mb: f64,
}

type Rounds = Vec<BTreeMap<Job, Took>>;

/// All jobs on all kinds of logs, `pairs` times each, as Markdown.
pub(crate) fn tables(folder: &Path, pairs: usize, megabytes: u64) -> String {
    let mut columns: Vec<(Kind, Rounds)> = Vec::new();
    for kind in Kind::ALL {
        let input = folder.join("large.mcap");
        make(&input, kind, megabytes);
        let rounds = (0..pairs).map(|i| round(folder, &input, kind, i)).collect();
        columns.push((kind, rounds));
        for name in ["large.mcap", "out.mcap"] {
            let _ = fs::remove_file(folder.join(name));
        }
    }
    table(&columns, pairs, megabytes)
}

/// Every job once.
fn round(folder: &Path, input: &Path, kind: Kind, number: usize) -> BTreeMap<Job, Took> {
    let mut took = BTreeMap::new();
    let output = folder.join("out.mcap");
    let mut jobs = vec![
        Job::Messages,
        Job::IndexedReader,
        Job::Messages,
        Job::WholeChunks,
        Job::Copy,
        Job::Add,
        Job::Fit,
        Job::Fuse,
        Job::Rewrite,
    ];
    // neighbours change places from round to round
    if number % 2 == 1 {
        jobs.reverse();
    }
    for job in jobs {
        took.insert(job, run(job, input, &output));
        eprintln!("{} {number} {job:?}: {:.2} s", kind.name(), took[&job].s);
        let _ = fs::remove_file(&output);
    }
    for job in [Job::AddInPlace, Job::FuseInPlace] {
        fs::copy(input, &output).expect("room on the disk");
        took.insert(job, run(job, input, &output));
        let _ = fs::remove_file(&output);
    }
    took
}

/// A job in a process of its own, after all that was written before is on the disk.
fn run(job: Job, input: &Path, output: &Path) -> Took {
    let _ = Command::new("sync").status();
    let name = <Job as clap::ValueEnum>::to_possible_value(&job).expect("a name");
    let mut command = Command::new(std::env::current_exe().expect("this program"));
    command.arg("--folder").arg(".").args(["--job", name.get_name()]);
    command.arg("--input").arg(input).arg("--output").arg(output).stderr(Stdio::inherit());
    let done = command.output().expect("this program");
    assert!(done.status.success(), "{job:?} failed");
    let text = String::from_utf8_lossy(&done.stdout);
    let line = text.lines().rev().find_map(|line| line.strip_prefix(TOOK)).expect("what it took");
    let mut numbers = line.split(' ').filter_map(|number| number.parse::<f64>().ok());
    let (s, peak_kb) = (numbers.next().expect("seconds"), numbers.next().expect("memory"));
    Took { s, peak_mb: peak_kb / 1024.0 }
}

/// A row: what it says, and its number for one round.
type Row = (&'static str, &'static str, fn(&dyn Fn(Job) -> f64) -> f64);

const ROWS: [Row; 9] = [
    ("add 70,000 points / `cp`", "at most 1.25", |s| s(Job::Add) / s(Job::Copy)),
    ("`fuse` less reading and fit / `cp`", "", |s| (s(Job::Fuse) - s(Job::Fit)) / s(Job::Copy)),
    ("add 70,000 points in place, s", "below 0.3", |s| s(Job::AddInPlace)),
    ("`fuse --in-place` less reading and fit, s", "", |s| s(Job::FuseInPlace) - s(Job::Fit)),
    ("read the sources / IndexedReader", "at most 1", |s| s(Job::Messages) / s(Job::IndexedReader)),
    ("IndexedReader / read the sources", "uncompressed: at least 3", |s| {
        s(Job::IndexedReader) / s(Job::Messages)
    }),
    ("chunks read whole / read the sources", "uncompressed: at least 3", |s| {
        s(Job::WholeChunks) / s(Job::Messages)
    }),
    ("rewriting / `fuse`", "above 1; sonar: at least 3", |s| s(Job::Rewrite) / s(Job::Fuse)),
    ("the same without the fit of both", "", |s| {
        (s(Job::Rewrite) - s(Job::Fit)) / (s(Job::Fuse) - s(Job::Fit))
    }),
];

const JOBS: [Job; 10] = [
    Job::Messages,
    Job::WholeChunks,
    Job::IndexedReader,
    Job::Copy,
    Job::Add,
    Job::AddInPlace,
    Job::Fit,
    Job::Fuse,
    Job::FuseInPlace,
    Job::Rewrite,
];

fn table(columns: &[(Kind, Rounds)], pairs: usize, megabytes: u64) -> String {
    let heads: Vec<&str> = columns.iter().map(|(kind, _)| kind.name()).collect();
    let (head, rule) = (heads.join(" | "), "---|".repeat(heads.len()));
    let mut lines = vec![
        format!("Logs of {megabytes} MB, medians of {pairs} pairs.\n"),
        format!("| ratio | aim | {head} |\n|---|---|{rule}"),
    ];
    for (name, aim, number) in ROWS {
        let cells: Vec<String> = columns.iter().map(|(_, rounds)| ratio(rounds, number)).collect();
        lines.push(format!("| {name} | {aim} | {} |", cells.join(" | ")));
    }
    lines.push(format!("\n| job | {head} |\n|---|{rule}"));
    for job in JOBS {
        let cells: Vec<String> = columns.iter().map(|(_, rounds)| job_cell(rounds, job)).collect();
        lines.push(format!("| {job:?} | {} |", cells.join(" | ")));
    }
    lines.join("\n") + "\n"
}

fn ratio(rounds: &Rounds, number: fn(&dyn Fn(Job) -> f64) -> f64) -> String {
    let of_round = |round: &BTreeMap<Job, Took>| number(&|job| round.get(&job).map_or(f64::NAN, |t| t.s));
    cell(median(rounds.iter().map(of_round)), |v| format!("{v:.2}"))
}

/// Median of the seconds, and the most memory of any round.
fn job_cell(rounds: &Rounds, job: Job) -> String {
    let took = || rounds.iter().filter_map(|round| round.get(&job));
    let peak_mb = took().map(|t| t.peak_mb).fold(0.0, f64::max);
    cell(median(took().map(|t| t.s)), |s| format!("{s:.2} s, {peak_mb:.0} MB"))
}

fn cell(value: f64, text: impl Fn(f64) -> String) -> String {
    if value.is_finite() { text(value) } else { "-".into() }
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    match (values.get(values.len() / 2), values.get(values.len().saturating_sub(1) / 2)) {
        (Some(upper), Some(lower)) => 0.5 * (upper + lower),
        _ => f64::NAN,
    }
}
