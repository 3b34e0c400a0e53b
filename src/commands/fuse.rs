//! `trackfuse fuse`: log -> sources -> track -> log.

use std::io::Read;

use sha2::{Digest, Sha256};

use super::progress::Bar;
use super::{CommandError, Outcome, beside, checked, html_report, note, options, say};
use crate::cli::Fuse;
use crate::config::Config;
use crate::fusion::{self, Fusion};
use crate::log::{
    Appender, Destination, Encoding, Log, LogError, NewMessage, NewMetadata, ReadOptions, bad_chunks,
    put_back,
};
use crate::math::geodesy::{Geodetic, LocalFrame};
use crate::publish::{Context, Published, Topic, messages};
use crate::report::{self, Report, html};
use crate::resolve;
use crate::sample::Source;
use crate::source::{self, Recognised, Samples};
use crate::time::Time;
use crate::track::TrackPoint;

/// Fuses a log's sources and writes the track beside them.
///
/// # Errors
/// [`CommandError`], and then nothing is written.
pub fn fuse(args: &Fuse) -> Result<Outcome, CommandError> {
    let mut config = args.config.as_deref().map_or_else(|| Ok(Config::default()), Config::read)?;
    if let Some(prefix) = &args.prefix {
        config.output.prefix.clone_from(prefix);
        config.check()?;
    }
    if put_back(&args.log)?.is_some() {
        let log = args.log.display();
        note(args.voice, &format!("a run that added to {log} was cut off: {log} is as it was before that"));
    }
    let bar = Bar::new(args.voice);
    let options = ReadOptions { whole_chunks: args.check_chunks, ..options(args.memory, &bar) };
    let open = if args.in_place { Log::open_in_place_with } else { Log::open_with };
    let (log, mut warnings) = checked(open(&args.log, options)?, args.strict)?;
    let destination = destination(args);
    let usual = Encoding::of_profile(&log.index().profile);
    let encoding = *config.output.encoding.get_or_insert(usual);
    let all = Topic::channels(&Topic::written(encoding, true), &config.output.prefix, encoding);
    Appender::check(&log, &destination, &all)?;
    html_report::check(args, &log, &destination)?;

    let named = !config.source.is_empty();
    let Recognised { unused, warnings: of_sources, mut damaged, .. } = choose_sources(&log, &mut config)?;
    warnings.extend(of_sources);
    let Samples { mut loaded, origin, left_out, read } =
        source::load(&log, &config.source, named, config.output.origin)?;
    damaged.extend(read.damaged);
    ensure_whole(&mut damaged, &log, args)?;
    let known = |sentence: &String| warnings.contains(sentence);
    let left_out: Vec<String> = left_out.into_iter().filter(|sentence| !known(sentence)).collect();
    warnings.extend(left_out);
    config.source = loaded.iter().map(|l| l.config.clone()).collect();
    config.output.origin = config.output.origin.or(loaded.iter().find_map(|l| l.fix_origin));
    let datum = source::datum(&config.source);
    config.source[datum].datum = true;
    // moved: copies would double what millions of samples take
    let sources: Vec<Source> = loaded.iter_mut().map(|l| std::mem::take(&mut l.source)).collect();
    let geodetic = config.output.origin.map(|place| LocalFrame::new(Geodetic::from_degrees(place)));
    let topics = Topic::written(encoding, geodetic.is_some());
    let channels = Topic::channels(&topics, &config.output.prefix, encoding);
    let compression = config.output.compression;
    let begin = || Appender::begin(&log, &destination, &channels, compression);
    // a new file's copy of the log gets on while the track is fitted; the log itself is not touched before it must be
    let begun = if args.in_place { None } else { Some(begin()?) };
    bar.doing("fitting");
    let plan = resolve::plan(&mut config, &loaded, &sources, datum, origin, &mut warnings)?;
    let fusion = fusion::fuse(&sources, &plan)?;
    check_finite(&fusion)?;

    let t0 = config
        .output
        .t0_ns
        .map_or_else(|| resolve::first_sample(&sources[datum], &fusion, origin), Time::from_ns);
    config.output.t0_ns = Some(t0.ns());
    let shift_s = resolve::log_time_shift_s(&loaded[datum]);
    warnings.extend(resolve::warnings_of(&loaded, shift_s));
    warnings.extend(fusion.warnings.iter().cloned());
    let (input_name, output_name) =
        (args.log.display().to_string(), destination.path(&log).display().to_string());
    let of_sources = loaded.iter().flat_map(|l| l.notes.iter().cloned());
    let notes: Vec<String> = of_sources.chain(log.visibility().note()).chain(encoding.note(usual)).collect();
    let report = Report::new(&report::Parts {
        input: &input_name,
        output: &output_name,
        t0,
        fix_origin: config.output.origin,
        loaded: &loaded,
        sources: &sources,
        unchecked_chunks: read.unchecked,
        datum,
        unused: &unused,
        plan: &plan,
        fusion: &fusion,
        notes: &notes,
        warnings: &warnings,
    });
    let text = report::render(&report);

    let context = Context {
        sources: &sources,
        origin,
        rate_hz: plan.rate_hz,
        t0,
        surface_at_zero: config.output.surface_at_zero == Some(true),
        log_start: resolve::log_start(&log, shift_s),
        encoding,
        geodetic,
    };
    let metadata = metadata(&log, &config, &report)?;
    let parts = html::fusion::Parts { report: &report, fusion: &fusion, sources: &sources, origin, t0 };
    let page = html_report::prepare(args, parts, &metadata)?;
    let mut appender = begun.map_or_else(begin, Ok)?;
    appender.leave_out(bad_chunks(&damaged));
    bar.doing("writing the track");
    write(&mut appender, messages(&fusion, context, &text, &warnings), &topics, shift_s)?;
    appender.add_metadata(metadata);
    appender.finish()?;
    html_report::publish(page, &output_name)?;
    drop(bar);
    let text = format!("{}\n\n{text}", files(args, &input_name, &output_name));
    say(args.voice, &text, &report, &warnings);
    Ok(if warnings.is_empty() { Outcome::Done } else { Outcome::Warned })
}

/// What was read and what was written.
fn files(args: &Fuse, input: &str, output: &str) -> String {
    let log = if args.in_place { format!("{input}, in place") } else { format!("{input} -> {output}") };
    args.report.as_ref().map_or(log.clone(), |page| format!("{log}, {}", page.display()))
}

/// Writes the messages of `topics`, whose channels are the appender's, on the log's clock.
fn write(
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

/// Refuses damage that showed when the sources were looked for and read, where only a whole log will do.
fn ensure_whole(damaged: &mut Vec<LogError>, log: &Log, args: &Fuse) -> Result<(), LogError> {
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

/// Where the track goes.
fn destination(args: &Fuse) -> Destination {
    let force = args.force;
    match (&args.sidecar, &args.output) {
        _ if args.in_place => Destination::InPlace,
        (Some(out), _) => Destination::Sidecar { out: out.clone(), force },
        (None, Some(out)) => Destination::New { out: out.clone(), force },
        (None, None) => Destination::New { out: beside(&args.log, "fused"), force },
    }
}

/// Fills in the sources where the config names none, and returns what else was found on the way.
fn choose_sources(log: &Log, config: &mut Config) -> Result<Recognised, CommandError> {
    if !config.source.is_empty() {
        return Ok(Recognised::default());
    }
    let mut recognised = source::recognise(log, &config.output.prefix)?;
    config.source = std::mem::take(&mut recognised.sources);
    Ok(recognised)
}

/// An error where the track has a point that is no number, which happens with samples of absurd size.
fn check_finite(fusion: &Fusion) -> Result<(), CommandError> {
    let finite = |p: &&TrackPoint| p.state.position.iter().chain(&p.state.velocity).all(|v| v.is_finite());
    match fusion.track.points.iter().find(|p| !finite(p)) {
        Some(point) => Err(CommandError::NotFinite { time: point.time }),
        None => Ok(()),
    }
}

/// Where the track comes from, for whoever finds it in an archive.
fn metadata(log: &Log, config: &Config, report: &Report) -> Result<NewMetadata, CommandError> {
    let index = log.index();
    let entries = [
        ("version", report.version.clone()),
        ("command", "fuse".into()),
        ("config", toml::to_string(config).unwrap_or_default()),
        ("input_size", index.file_len.to_string()),
        ("input_data_section_crc", index.data_section_crc.map_or("none".into(), |c| format!("{c:08x}"))),
        ("input_summary_sha256", sha256(log)?),
        ("report", without_file_names(report)),
    ];
    Ok(NewMetadata {
        name: format!("trackfuse:{}", config.output.prefix),
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
fn without_file_names(report: &Report) -> String {
    let mut value = serde_json::to_value(report).unwrap_or_default();
    if let Some(object) = value.as_object_mut() {
        object.shift_remove("input");
        object.shift_remove("output");
    }
    value.to_string()
}
