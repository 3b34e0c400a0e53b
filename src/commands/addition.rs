//! What commands have in common that add a track to a log: how the log is opened, where the result goes, and what is
//! written about where it comes from.

use std::io::Read;

use serde::Serialize;
use sha2::{Digest, Sha256};

use super::progress::Bar;
use super::{CommandError, beside, checked, note, options};
use crate::cli::Addition;
use crate::config::Config;
use crate::log::{Appender, Destination, Log, LogError, NewMessage, NewMetadata, ReadOptions, put_back};
use crate::publish::{Published, Topic};
use crate::track::{Track, TrackPoint};

/// The config that is asked for, with the new topics' prefix: `usual` where nothing asks for another.
pub(super) fn config(args: &Addition, usual: &str) -> Result<Config, CommandError> {
    let mut config = args.config.as_deref().map_or_else(|| Ok(Config::default()), Config::read)?;
    if args.prefix.is_some() {
        config.output.prefix.clone_from(&args.prefix);
        config.check()?;
    }
    config.output.prefix.get_or_insert_with(|| usual.into());
    Ok(config)
}

/// Opens the log, put back where a run that added to it was cut off, and says what is wrong with it.
pub(super) fn open(args: &Addition, bar: &Bar) -> Result<(Log, Vec<String>), CommandError> {
    if put_back(&args.log)?.is_some() {
        let log = args.log.display();
        note(args.voice, &format!("a run that added to {log} was cut off: {log} is as it was before that"));
    }
    let options = ReadOptions { whole_chunks: args.check_chunks, ..options(args.memory, bar) };
    let open = if args.in_place { Log::open_in_place_with } else { Log::open_with };
    Ok(checked(open(&args.log, options)?, args.strict)?)
}

/// Where the track goes: by default beside the log, `what` in its name.
pub(super) fn destination(args: &Addition, what: &str) -> Destination {
    let force = args.force;
    match (&args.sidecar, &args.output) {
        _ if args.in_place => Destination::InPlace,
        (Some(out), _) => Destination::Sidecar { out: out.clone(), force },
        (None, Some(out)) => Destination::New { out: out.clone(), force },
        (None, None) => Destination::New { out: beside(&args.log, what), force },
    }
}

/// Refuses damage that showed when the sources were looked for and read, where only a whole log will do.
pub(super) fn ensure_whole(damaged: &mut Vec<LogError>, log: &Log, args: &Addition) -> Result<(), LogError> {
    let bad = |error: &LogError| matches!(error, LogError::BadChunk { .. } | LogError::Damaged { .. });
    let Some(first) = damaged.iter().position(bad).filter(|_| args.strict || args.in_place) else {
        return Ok(());
    };
    let error = damaged.swap_remove(first);
    if args.strict {
        return Err(error);
    }
    Err(LogError::NotInPlace { path: log.path().to_owned(), source: std::io::Error::other(error) })
}

/// An error where the track has a point that is no number, which happens with samples of absurd size.
pub(super) fn check_finite(track: &Track) -> Result<(), CommandError> {
    let finite = |p: &&TrackPoint| p.state.position.iter().chain(&p.state.velocity).all(|v| v.is_finite());
    match track.points.iter().find(|p| !finite(p)) {
        Some(point) => Err(CommandError::NotFinite { time: point.time }),
        None => Ok(()),
    }
}

/// Writes the messages of `topics`, whose channels are the appender's, on the log's clock.
pub(super) fn write(
    appender: &mut Appender<'_>,
    messages: impl Iterator<Item = Published>,
    topics: &[Topic],
    shift_s: Option<f64>,
) -> Result<(), LogError> {
    for message in messages {
        let Some(channel) = topics.iter().position(|&topic| topic == message.topic) else { continue };
        let time_ns = message.time.plus_seconds(shift_s.unwrap_or(0.0)).to_log();
        appender.write(NewMessage { channel, time_ns, data: &message.data })?;
    }
    Ok(())
}

/// What was read and what was written.
pub(super) fn files(args: &Addition, input: &str, output: &str) -> String {
    let log = if args.in_place { format!("{input}, in place") } else { format!("{input} -> {output}") };
    args.report.as_ref().map_or(log.clone(), |page| format!("{log}, {}", page.display()))
}

/// Where the track comes from, for whoever finds it in an archive.
pub(super) fn metadata(
    log: &Log,
    config: &Config,
    command: &str,
    report: &impl Serialize,
) -> Result<NewMetadata, CommandError> {
    let index = log.index();
    let entries = [
        ("version", env!("CARGO_PKG_VERSION").into()),
        ("command", command.into()),
        ("config", toml::to_string(config).unwrap_or_default()),
        ("input_size", index.file_len.to_string()),
        ("input_data_section_crc", index.data_section_crc.map_or("none".into(), |c| format!("{c:08x}"))),
        ("input_summary_sha256", sha256(log)?),
        ("report", without_file_names(report)),
    ];
    Ok(NewMetadata {
        name: format!("trackfuse:{}", config.output.prefix()),
        entries: entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect(),
    })
}

/// The hash of what stands behind the log's data section.
fn sha256(log: &Log) -> Result<String, LogError> {
    let (mut tail, mut hash, mut buf) = (log.tail(), Sha256::new(), vec![0; 1 << 16]);
    loop {
        let read = tail.read(&mut buf).map_err(|source| LogError::Read {
            path: log.path().to_owned(),
            offset: log.index().data_end,
            source,
        })?;
        if read == 0 {
            return Ok(hash.finalize().iter().map(|b| format!("{b:02x}")).collect());
        }
        hash.update(buf.get(..read).unwrap_or_default());
    }
}

/// The report as JSON, without the names of the files: those may change without the track changing.
fn without_file_names(report: &impl Serialize) -> String {
    let mut value = serde_json::to_value(report).unwrap_or_default();
    if let Some(object) = value.as_object_mut() {
        object.shift_remove("input");
        object.shift_remove("output");
    }
    value.to_string()
}
