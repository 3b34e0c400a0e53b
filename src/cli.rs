//! The command line; these doc comments are its help.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::config::TimeChoice;
use crate::estimate::characteristic_point::Height;

/// Where was the vehicle really? Reads an MCAP recording of a sea trial, fuses its position and velocity
/// channels into one 3-D track, and writes that track back beside them.
#[derive(Debug, Parser)]
#[command(
    version = concat!(env!("CARGO_PKG_VERSION"), env!("TRACKFUSE_COMMIT")),
    max_term_width = 100,
    after_help = "Examples:
  trackfuse inspect dive.mcap                what is in it, and what `fuse` would take of it
  trackfuse fuse dive.mcap                   writes dive.fused.mcap, for Foxglove or Lichtblick
  trackfuse export dive.fused.mcap -o dive.kml

`trackfuse COMMAND --help` tells more, with examples."
)]
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
    /// The original is not touched: the output is a new log whose data section begins with every byte of the
    /// original's. `--in-place` appends to the log itself. `trackfuse restore` leads back from both.
    #[command(after_help = "Examples:
  trackfuse fuse dive.mcap                       writes dive.fused.mcap
  trackfuse fuse dive.mcap --config dive.toml    names sources, heights, horizon, ...
  trackfuse fuse dive.mcap --in-place            adds to dive.mcap: needs no second copy of a large log
  trackfuse fuse dive.mcap --sidecar track.mcap  writes the new channels only, for viewers that merge logs
  trackfuse fuse dive.mcap --report dive.html    writes a report with plots for the browser, too

Exit codes: 0 done; 1 failed, nothing written; 2 usage or config wrong, sources ambiguous, output
exists; 3 done, with warnings that a person must read")]
    Fuse(Addition),
    /// Clean a USBL system's fixes of a dive: a track through silences, a prediction, and what was thrown out and why
    ///
    /// The fixes are those of the one topic with `usbl` in its name, or those that `[usbl]` in a config names. Writes the
    /// smoothed track, what a causal method predicts as the fixes come in, and every fix with its verdict.
    #[command(after_help = "Examples:
  trackfuse usbl dive.mcap                       writes dive.usbl.mcap
  trackfuse usbl dive.mcap --config dive.toml    names the fixes, a depth channel, the speed limit, ...
  trackfuse compare dive.usbl.mcap --estimate /usbl/prediction --reference /usbl/track

Exit codes: 0 done; 1 failed, nothing written; 2 usage or config wrong, fixes ambiguous, output exists;
3 done, with warnings that a person must read")]
    Usbl(Addition),
    /// Get the original log, bit for bit, out of a log that trackfuse added to
    ///
    /// Where a run with `--in-place` was cut off, this puts the original back. Else it takes off what runs that
    /// ended have added: their outputs hold all that the original had.
    Restore(Restore),
    /// Hold a track against a reference channel of the same log
    ///
    /// Errors phase by phase and at characteristic points (Zhang 2025, eq. 12 and 13), 3-D and by axis, and
    /// whether the track's 95 % bands hold the reference.
    Compare(Compare),
    /// Get a track out of a log, for other tools: as a table, on a map, as a trajectory
    Export(Export),
    /// Make a log with known truth from a scenario file
    Simulate(Simulate),
    /// Show what is in a log: channels, rates, gaps, clocks, sources, and what is wrong with it
    ///
    /// Of a large log no more is read than that takes: some seconds for 50 GB. With `--verify` all of it is.
    Inspect(Inspect),
    /// Write a commented config for a log: its sources, and every other key with its default
    Init(Init),
    /// Print a script that lets a shell complete trackfuse's commands and options
    Completions(Completions),
    /// Print trackfuse's manual page, or write those of all commands
    Man(Man),
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

/// What a log may take.
#[derive(Args, Clone, Copy, Debug)]
pub struct Memory {
    /// What one chunk or record of the log may take in memory
    #[arg(long, value_name = "SIZE", default_value = "1GiB", value_parser = bytes)]
    pub memory_limit: u64,
}

/// Such as `512MB` or `2GiB`.
fn bytes(text: &str) -> Result<u64, String> {
    let units = [("GiB", 1 << 30), ("MiB", 1 << 20), ("GB", 1_000_000_000), ("MB", 1_000_000), ("B", 1)];
    let (number, unit) =
        units.iter().find_map(|&(name, unit)| Some((text.strip_suffix(name)?, unit))).unwrap_or((text, 1));
    let number: Option<u64> = number.trim().parse().ok();
    let bytes = number.and_then(|n| n.checked_mul(unit)).filter(|bytes| (1..=1 << 40).contains(bytes));
    bytes.ok_or_else(|| format!("expected a size up to 1024GiB, such as 512MB or 4GiB, got {text:?}"))
}

/// Arguments of commands that add a track to a log.
#[expect(clippy::struct_excessive_bools, reason = "each is a flag")]
#[derive(Args, Debug)]
pub struct Addition {
    /// The log to read
    pub log: PathBuf,
    /// A config; without one, sources are recognised by their topics' names
    #[arg(long, short, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// The log to write [default: LOG with .fused.mcap, or .usbl.mcap, for .mcap]
    #[arg(long, short, value_name = "OUT")]
    pub output: Option<PathBuf>,
    /// Append to LOG itself. Cut off at any moment, the next run or `trackfuse restore` puts LOG back
    #[arg(long, conflicts_with_all = ["output", "sidecar"])]
    pub in_place: bool,
    /// Write the new channels only, as a log of their own
    #[arg(long, value_name = "OUT", conflicts_with = "output")]
    pub sidecar: Option<PathBuf>,
    /// Write a report with plots beside it: one page for browser and paper, which needs no network
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
    /// Replace an existing output
    #[arg(long)]
    pub force: bool,
    /// Refuse a log that is damaged, instead of using what can be trusted; reads all of it, for its checksum
    #[arg(long)]
    pub strict: bool,
    /// Prefix of the new topics [default: the config's, else /fused or /usbl]
    #[arg(long)]
    pub prefix: Option<String>,
    /// Read every chunk with sources whole and check its checksum, also uncompressed ones of which less would do
    #[arg(long)]
    pub check_chunks: bool,
    /// What the log may take.
    #[command(flatten)]
    pub memory: Memory,
    /// How to talk.
    #[command(flatten)]
    pub voice: Voice,
}

/// Arguments of `restore`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  trackfuse restore dive.fused.mcap              writes dive.fused.restored.mcap: dive.mcap as it was
  trackfuse restore dive.mcap --in-place         takes off what `fuse --in-place` added to it
  trackfuse restore dive.mcap                    after a run was cut off: puts dive.mcap back

Exit codes: 0 done; 1 failed, nothing written; 2 output exists; 3 done, with warnings that a person must
read, such as that the original is damaged")]
pub struct Restore {
    /// The log that was added to
    pub log: PathBuf,
    /// The log to write [default: LOG with .restored.mcap for .mcap; LOG itself after a run was cut off]
    #[arg(long, short, value_name = "OUT")]
    pub output: Option<PathBuf>,
    /// Make LOG itself the original again
    #[arg(long, conflicts_with = "output")]
    pub in_place: bool,
    /// Take off only what was added last [default: everything]
    #[arg(long)]
    pub last: bool,
    /// Replace an existing output
    #[arg(long)]
    pub force: bool,
    /// How to talk.
    #[command(flatten)]
    pub voice: Voice,
}

/// Arguments of `simulate`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  trackfuse simulate sample_logs/steep_climb.scenario.toml -o climb.mcap
  trackfuse fuse climb.mcap && trackfuse compare climb.fused.mcap --reference /reference/ins
  trackfuse simulate sample_logs/usbl_dive.scenario.toml -o dive.mcap
  trackfuse usbl dive.mcap; trackfuse compare dive.usbl.mcap --estimate /usbl/track --reference /reference/ins

Exit codes: 0 done; 1 failed, nothing written; 2 scenario wrong, or output exists")]
pub struct Simulate {
    /// The scenario file (TOML; see `sample_logs`): of a dive seen by USBL with a table `[dive]`, else of a climb
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

/// Arguments of `compare`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  trackfuse compare dive.fused.mcap --reference /ins/odom
  trackfuse compare dive.fused.mcap --reference /ins/pose.position --reference /ins/twist.linear
  trackfuse compare dive.mcap --estimate /beacon/track --reference /ins/odom   a sensor instead of a track

Exit codes: 0 done; 1 failed, or no instant in common; 2 usage wrong, such as a topic that isn't there;
3 done, with warnings that a person must read, such as frames that differ")]
pub struct Compare {
    /// The log that holds both
    pub log: PathBuf,
    /// Topic of the track [default: /fused/track, else the log's only one]
    #[arg(long, value_name = "TOPIC")]
    pub estimate: Option<String>,
    /// Topic of the reference, or message paths of its position and of its velocity
    #[arg(long, value_name = "TOPIC", required = true)]
    pub reference: Vec<String>,
    /// What counts as a reference sample's time [default: its stamp, else publish, else log time]
    #[arg(long, value_enum, value_name = "CLOCK")]
    pub reference_time: Option<TimeChoice>,
    /// A further height to compare at, such as exit=-2, in metres, Z up [default: those on the events topic]
    #[arg(long, value_name = "NAME=Z", value_parser = height, allow_hyphen_values = true)]
    pub height: Vec<Height>,
    /// Refuse a log that is damaged, instead of using what can be trusted; reads all of it, for its checksum
    #[arg(long)]
    pub strict: bool,
    /// What the log may take.
    #[command(flatten)]
    pub memory: Memory,
    /// How to talk.
    #[command(flatten)]
    pub voice: Voice,
}

fn height(text: &str) -> Result<Height, String> {
    let expected = || format!("expected NAME=Z, such as exit=-2, got {text:?}");
    let (name, z) = text.split_once('=').ok_or_else(expected)?;
    let z_m: f64 = z.trim().parse().map_err(|_| expected())?;
    if z_m.is_finite() { Ok(Height { name: name.trim().to_owned(), z_m }) } else { Err(expected()) }
}

/// Arguments of `export`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  trackfuse export dive.fused.mcap > dive.csv
  trackfuse export dive.fused.mcap -o dive.parquet                         for pandas, DuckDB, MATLAB
  trackfuse export dive.fused.mcap -o dive.kml                             for Google Earth
  trackfuse export dive.fused.mcap -o dive.geojson --origin 59.4,10.5,0    for QGIS and web maps
  trackfuse export dive.fused.mcap -o dive.tum                             for evo
  trackfuse export dive.fused.mcap --topic /fused/pcf -o pcf.csv

Maps hold at most 20,000 vertices, chosen to keep the track's shape; all other formats hold every point.

Exit codes: 0 done; 1 failed, nothing written; 2 output exists, no such topic, or a map without an
origin; 3 done, with warnings that a person must read, such as messages that can't be read")]
pub struct Export {
    /// The log to read
    pub log: PathBuf,
    /// Topic of the track; a channel with a position will do too [default: /fused/track, else the log's only track]
    #[arg(long, value_name = "TOPIC")]
    pub topic: Option<String>,
    /// Format [default: what FILE's ending says, else csv]
    #[arg(long, value_enum)]
    pub format: Option<Format>,
    /// Latitude and longitude in degrees, and altitude above the WGS 84 ellipsoid in metres, of the track's zero,
    /// for maps [default: the log's]
    #[arg(long, value_name = "LAT,LON,ALT", value_parser = origin, allow_hyphen_values = true)]
    pub origin: Option<[f64; 3]>,
    /// The file to write [default: stdout]
    #[arg(long, short, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Replace an existing output
    #[arg(long)]
    pub force: bool,
    /// Refuse a log that is damaged, instead of using what can be trusted; reads all of it, for its checksum
    #[arg(long)]
    pub strict: bool,
    /// What the log may take.
    #[command(flatten)]
    pub memory: Memory,
    /// How to talk.
    #[command(flatten)]
    pub voice: Voice,
}

fn origin(text: &str) -> Result<[f64; 3], String> {
    let expected = || {
        format!(
            "expected latitude and longitude in degrees and altitude in metres, such as 59.4,10.5,0, got {text:?}"
        )
    };
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|number| number.trim().parse()).collect();
    let place: [f64; 3] = numbers.ok().and_then(|n| n.try_into().ok()).ok_or_else(expected)?;
    let on_earth = place[0].abs() <= 90.0 && place[1].abs() <= 360.0 && place[2].abs() <= 1e5;
    if on_earth { Ok(place) } else { Err(expected()) }
}

/// Formats of other tools.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Comma-separated values; every column's name holds its unit
    Csv,
    /// Apache Parquet: the same columns, with types and the track's provenance
    Parquet,
    /// GeoJSON: lines coloured by phase, and characteristic points
    Geojson,
    /// KML, for Google Earth: the same
    Kml,
    /// Trajectory of the TUM benchmark, as evo reads it; its orientation means nothing
    Tum,
}

/// Arguments of `inspect`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  trackfuse inspect dive.mcap                of 50 GB, in seconds
  trackfuse inspect dive.mcap --verify       reads all of it, and checks all that can be checked
  trackfuse inspect dive.mcap --json | jq '.channels[].topic'

Exit codes: 0 done; 1 the log can't be opened; 3 done, with warnings that a person must read")]
pub struct Inspect {
    /// The log to look into
    pub log: PathBuf,
    /// Read all of the log, and check every checksum and index entry of it
    #[arg(long)]
    pub verify: bool,
    /// What the log may take.
    #[command(flatten)]
    pub memory: Memory,
    /// How to talk.
    #[command(flatten)]
    pub voice: Voice,
}

/// Arguments of `init`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  trackfuse init dive.mcap -o dive.toml && trackfuse fuse dive.mcap --config dive.toml
  trackfuse init dive.mcap --source /gps/fix --source /odometry -o dive.toml    the datum first
  trackfuse init dive.mcap --source /gps/fix,/dvl/twist -o dive.toml            one source of two topics

Exit codes: 0 done; 1 failed, nothing written; 2 output exists; 3 done, with warnings that a person
must read, such as that the config names no source until one is chosen in it")]
pub struct Init {
    /// The log to write a config for
    pub log: PathBuf,
    /// A topic to take as a source, the datum's first; two with a comma between them for a position and a velocity
    /// that are of one source, as topics are whose names say so, such as /gps/pose and /gps/twist [default: what the
    /// topics' names tell]
    #[arg(long, value_name = "TOPIC")]
    pub source: Vec<String>,
    /// The config to write [default: stdout]
    #[arg(long, short, value_name = "CONFIG")]
    pub output: Option<PathBuf>,
    /// Replace an existing output
    #[arg(long)]
    pub force: bool,
    /// What the log may take.
    #[command(flatten)]
    pub memory: Memory,
    /// How to talk.
    #[command(flatten)]
    pub voice: Voice,
}

/// Arguments of `completions`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  trackfuse completions bash > ~/.local/share/bash-completion/completions/trackfuse
  trackfuse completions fish > ~/.config/fish/completions/trackfuse.fish
  trackfuse completions zsh > _trackfuse                                  in a folder of $fpath")]
pub struct Completions {
    /// The shell
    #[arg(value_enum)]
    pub shell: clap_complete::Shell,
}

/// Arguments of `man`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  trackfuse man | man -l -
  trackfuse man -o ~/.local/share/man/man1       trackfuse.1, trackfuse-fuse.1, ...

Exit codes: 0 done; 1 failed; 2 a page exists")]
pub struct Man {
    /// The folder to write the pages to, one a command [default: that of trackfuse itself, to stdout]
    #[arg(long, short, value_name = "FOLDER")]
    pub output: Option<PathBuf>,
    /// Replace existing pages
    #[arg(long)]
    pub force: bool,
}
