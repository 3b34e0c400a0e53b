//! `trackfuse fuse`: log -> sources -> track -> log.

use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use super::{CommandError, Outcome, say};
use crate::cli::Fuse;
use crate::config::Config;
use crate::fusion::{self, Fusion};
use crate::log::{Appender, Log, NewMetadata};
use crate::publish::{Context, Topic, messages};
use crate::report::{self, Report};
use crate::resolve;
use crate::sample::Source;
use crate::source::{self, Candidate};
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
    let log = Log::open(&args.log)?;
    let output = args.output.clone().unwrap_or_else(|| beside(&args.log));
    let channels = Topic::ALL.map(|topic| topic.channel(&config.output.prefix));
    Appender::check(&log, &output, args.force, &channels)?;

    let named = !config.source.is_empty();
    let (unused, mut warnings) = choose_sources(&log, &mut config)?;
    let (loaded, origin, left_out) = source::load(&log, &config.source, named, config.output.origin)?;
    warnings.extend(left_out);
    config.source = loaded.iter().map(|l| l.config.clone()).collect();
    config.output.origin = config.output.origin.or(loaded.iter().find_map(|l| l.fix_origin));
    let datum = source::datum(&config.source);
    config.source[datum].datum = true;
    let sources: Vec<Source> = loaded.iter().map(|l| l.source.clone()).collect();
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
    let (input_name, output_name) = (args.log.display().to_string(), output.display().to_string());
    let report = Report::new(&report::Parts {
        input: &input_name,
        output: &output_name,
        t0,
        fix_origin: config.output.origin,
        loaded: &loaded,
        datum,
        unused: &unused,
        plan: &plan,
        fusion: &fusion,
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
    };
    let mut appender = Appender::begin(&log, &output, args.force, &channels, config.output.compression)?;
    for message in messages(&fusion, context, &text, &warnings) {
        appender.write(crate::log::NewMessage {
            channel: message.topic as usize,
            time_ns: message.time.plus_seconds(shift_s.unwrap_or(0.0)).to_log(),
            data: &message.data,
        })?;
    }
    appender.write_metadata(&metadata(&log, &config, &report)?)?;
    appender.finish()?;
    let text = format!("{input_name} -> {output_name}\n\n{text}");
    say(args.voice, &text, &report, &warnings);
    Ok(if warnings.is_empty() { Outcome::Done } else { Outcome::Warned })
}

/// `dive.mcap` -> `dive.fused.mcap`.
fn beside(log: &Path) -> PathBuf {
    let stem = log.file_stem().unwrap_or(log.as_os_str());
    let mut name = stem.to_owned();
    name.push(".fused.mcap");
    log.with_file_name(name)
}

/// Fills in the sources where the config names none, and returns the channels that were passed over, with
/// what is to be said of them.
fn choose_sources(log: &Log, config: &mut Config) -> Result<(Vec<Candidate>, Vec<String>), CommandError> {
    if !config.source.is_empty() {
        return Ok((Vec::new(), Vec::new()));
    }
    let recognised = source::recognise(log, &config.output.prefix)?;
    config.source = recognised.sources;
    Ok((recognised.unused, recognised.warnings))
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
        ("input_summary_sha256", Sha256::digest(log.tail()?).iter().map(|b| format!("{b:02x}")).collect()),
        ("report", without_file_names(report)),
    ];
    Ok(NewMetadata {
        name: format!("trackfuse:{}", config.output.prefix),
        entries: entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect(),
    })
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
