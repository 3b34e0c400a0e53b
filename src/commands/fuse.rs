//! `trackfuse fuse`: log -> sources -> track -> log.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use super::{CommandError, Outcome, say};
use crate::cli::Fuse;
use crate::config::{self, Config};
use crate::estimate::characteristic_point::Height;
use crate::estimate::polynomial::Prior;
use crate::estimate::{coverage, extrapolation, spline};
use crate::fusion::{self, Fusion, Plan};
use crate::log::{Appender, Compression, Log, NewMetadata};
use crate::publish::{Labels, Published, Topic, event_message, log_messages, track_messages};
use crate::report::{self, Report};
use crate::sample::Source;
use crate::source::{self, Candidate, Loaded};
use crate::time::Time;
use crate::track::{Method, TrackPoint};

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
    let (loaded, origin, left_out) = source::load(&log, &config.source, named)?;
    warnings.extend(left_out);
    config.source = loaded.iter().map(|l| l.config.clone()).collect();
    let datum = source::datum(&config.source);
    config.source[datum].datum = true;
    let sources: Vec<Source> = loaded.iter().map(|l| l.source.clone()).collect();
    let plan = plan(&config, &loaded, &sources, datum, origin, &mut warnings)?;
    let fusion = fusion::fuse(&sources, &plan)?;
    check_finite(&fusion)?;

    let t0 =
        config.output.t0_ns.map_or_else(|| first_sample(&sources[datum], &fusion, origin), Time::from_ns);
    let shift_s = log_time_shift_s(&loaded[datum]);
    warnings.extend(warnings_of(&loaded, datum, &fusion, shift_s));
    let (input_name, output_name) = (args.log.display().to_string(), output.display().to_string());
    let report = Report::new(&report::Parts {
        input: &input_name,
        output: &output_name,
        t0,
        loaded: &loaded,
        datum,
        unused: &unused,
        plan: &plan,
        fusion: &fusion,
        warnings: &warnings,
    });
    let text = report::render(&report);

    let compression = match config.output.compression {
        config::Compression::Zstd => Compression::Zstd,
        config::Compression::Lz4 => Compression::Lz4,
        config::Compression::None => Compression::None,
    };
    let names: Vec<String> = sources.iter().map(|s| s.name.clone()).collect();
    let labels = Labels { sources: &names, surface_at_zero: surface_at_zero(&config, &sources), t0 };
    let mut appender = Appender::begin(&log, &output, args.force, &channels, compression)?;
    for message in messages(&fusion, labels, &text, &warnings) {
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

/// Every default of the config, resolved for these sources.
fn plan(
    config: &Config,
    loaded: &[Loaded],
    sources: &[Source],
    datum: usize,
    origin: Time,
    warnings: &mut Vec<String>,
) -> Result<Plan, CommandError> {
    let (output, fuse, beyond) = (&config.output, &config.fusion, &config.extrapolation);
    let own_frame = || loaded[datum].frame_id.clone();
    let rate_hz = rate_hz(config, sources, warnings)?;
    Ok(Plan {
        origin,
        frame_id: output.frame_id.clone().unwrap_or_else(own_frame),
        rate_hz,
        datum,
        method: match fuse.method {
            config::FusionMethod::Gdf => Method::WeightedMean,
            config::FusionMethod::Pcf => Method::Polynomial,
            config::FusionMethod::Sff => Method::Spline,
            config::FusionMethod::MovingAverage => Method::MovingAverage,
        },
        coefficients: match fuse.coefficients {
            config::Coefficients::Shared => spline::Coefficients::Shared,
            config::Coefficients::Independent => spline::Coefficients::Independent,
        },
        knot_spacing_s: fuse.knot_spacing_s,
        order: fuse.order,
        window_points: fuse.window_points,
        bridge_max_s: fuse.bridge_max_s,
        extrapolation: (beyond.horizon_s > 0.0).then(|| extrapolation::Settings {
            order: beyond.order,
            window_s: beyond.window_s.unwrap_or_else(|| default_window_s(sources)),
            prior: beyond.prior.then_some(Prior { sigma: PRIOR_SIGMA }),
            horizon_s: beyond.horizon_s,
        }),
        stop_z_m: beyond.stop_z_m,
        heights: config
            .characteristic_point
            .iter()
            .map(|p| Height { name: p.name.clone(), z_m: p.z_m })
            .collect(),
    })
}

/// Most points of a track: 14 h at 100 Hz, 3 GB of messages.
const MAX_POINTS: f64 = 5e6;

/// Most points for each sample, where the rate is not the user's: samples in bursts have a short median
/// interval that says nothing of the log.
const MAX_POINTS_PER_SAMPLE: f64 = 100.0;

/// Points a second, such that the track stays of a size that can be read.
fn rate_hz(config: &Config, sources: &[Source], warnings: &mut Vec<String>) -> Result<f64, CommandError> {
    let pieces = coverage::Coverage::of(sources).pieces(config.fusion.bridge_max_s);
    let seen_s: f64 = pieces.iter().map(|p| p.1 - p.0).sum();
    let span_s = seen_s + config.extrapolation.horizon_s;
    if let Some(rate_hz) = config.output.rate_hz {
        let points = rate_hz * span_s;
        return if points <= MAX_POINTS {
            Ok(rate_hz)
        } else {
            Err(CommandError::TooManyPoints { rate_hz, span_s, points, most: MAX_POINTS })
        };
    }
    let rate_hz = fusion::fastest_rate_hz(sources).unwrap_or(1.0);
    let samples: usize = sources.iter().map(Source::len).sum();
    let for_samples = 1000.0 + MAX_POINTS_PER_SAMPLE * samples as f64;
    let lowered = rate_hz.min(for_samples / seen_s).min(MAX_POINTS / span_s);
    if lowered == rate_hz {
        return Ok(rate_hz);
    }
    warnings.push(format!(
        "the median interval of the fastest source asks for {rate_hz:.2} points a second over {span_s:.0} s: lowered \
         to {lowered:.2}; set `output.rate_hz` for another rate"
    ));
    Ok(lowered)
}

/// An error where the track has a point that is no number, which happens with samples of absurd size.
fn check_finite(fusion: &Fusion) -> Result<(), CommandError> {
    let finite = |p: &&TrackPoint| p.state.position.iter().chain(&p.state.velocity).all(|v| v.is_finite());
    match fusion.track.points.iter().find(|p| !finite(p)) {
        Some(point) => Err(CommandError::NotFinite { time: point.time }),
        None => Ok(()),
    }
}

/// Standard deviation of jerk, m/s^3, and snap, m/s^4, in the extrapolation's prior: the best of several on
/// simulated steep climbs.
const PRIOR_SIGMA: f64 = 0.5;

/// 1.4 s, the best of several on simulated steep climbs, or what 12 samples of the slowest source span.
fn default_window_s(sources: &[Source]) -> f64 {
    let slowest = sources.iter().filter_map(coverage::median_interval_s).fold(0.0, f64::max);
    f64::max(1.4, 12.0 * slowest)
}

/// The datum's first sample that is in the track: T0.
fn first_sample(datum: &Source, fusion: &Fusion, origin: Time) -> Time {
    let inside = |t: f64| fusion.pieces.iter().any(|p| (p.0..=p.1).contains(&t));
    let times = datum.positions.iter().chain(&datum.velocities).map(|s| s.time_s).filter(|&t| inside(t));
    let first = times.fold(f64::INFINITY, f64::min);
    let start = fusion.pieces.first().map_or(0.0, |p| p.0);
    origin.plus_seconds(if first.is_finite() { first } else { start })
}

/// Clocks that differ by more than this count from different epochs.
const DIFFERENT_EPOCHS_S: f64 = 3600.0;

/// Seconds between the datum's clock and the log's, where they are clocks of different epochs.
fn log_time_shift_s(datum: &Loaded) -> Option<f64> {
    Some(datum.timing.delay_s).filter(|d| d.abs() > DIFFERENT_EPOCHS_S)
}

/// Whether z = 0 is the surface: as the config says, else when the data look like it.
fn surface_at_zero(config: &Config, sources: &[Source]) -> bool {
    let heights = || sources.iter().flat_map(|s| &s.positions).map(|p| p.value[2]);
    config.output.surface_at_zero.unwrap_or_else(|| heights().all(|z| z < 2.0) && heights().any(|z| z < -2.0))
}

fn warnings_of(loaded: &[Loaded], datum: usize, fusion: &Fusion, shift_s: Option<f64>) -> Vec<String> {
    let mut warnings: Vec<String> = loaded.iter().flat_map(|l| l.warnings.clone()).collect();
    let of_datum = &loaded[datum];
    for other in loaded {
        let apart_s = other.timing.delay_s - of_datum.timing.delay_s;
        if apart_s.abs() > DIFFERENT_EPOCHS_S {
            warnings.push(format!(
                "{}'s and {}'s clocks are of different epochs, {:.0} s apart: set `time = \"log\"` for both",
                other.source.name,
                of_datum.source.name,
                apart_s.abs()
            ));
        }
    }
    let frames: BTreeMap<&str, &str> = loaded
        .iter()
        .filter(|l| !l.frame_id.is_empty())
        .map(|l| (l.frame_id.as_str(), l.source.name.as_str()))
        .collect();
    if frames.len() > 1 {
        let list: Vec<String> = frames.iter().map(|(frame, name)| format!("{name} in {frame:?}")).collect();
        warnings
            .push(format!("the sources name different frames ({}): they are taken as one", list.join(", ")));
    }
    if let Some(shift) = shift_s {
        warnings.push(format!(
            "the datum's stamps and the log's times are of different epochs: new messages keep the stamps in \
             `timestamp`, and their log times are {shift:.3} s later"
        ));
    }
    warnings.extend(fusion.warnings.iter().cloned());
    warnings
}

/// All new messages in order of time; the summary stands at the track's first instant.
fn messages<'a>(
    fusion: &'a Fusion,
    labels: Labels<'a>,
    text: &str,
    warnings: &[String],
) -> impl Iterator<Item = Published> + 'a {
    let frame = &fusion.track.frame_id;
    let start = fusion.track.points.first().map_or(labels.t0, |p| p.time);
    let head = log_messages(text, warnings, start);
    let events = fusion.events.iter().filter_map(move |e| event_message(e, frame, &labels));
    let mut streams = [
        Box::new(track_messages(Topic::Track, &fusion.track, labels))
            as Box<dyn Iterator<Item = Published> + 'a>,
        Box::new(track_messages(Topic::Pcf, &fusion.plain_pcf, labels)),
        Box::new({
            let mut events: Vec<Published> = events.collect();
            events.sort_by_key(|e| e.time);
            events.into_iter()
        }),
    ]
    .map(Iterator::peekable);
    head.into_iter().chain(std::iter::from_fn(move || {
        let next = (0..streams.len()).filter_map(|i| Some((streams[i].peek()?.time, i))).min()?;
        streams[next.1].next()
    }))
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
