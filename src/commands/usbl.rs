//! `trackfuse usbl`: log -> fixes -> track, prediction and verdicts -> log.

use super::progress::Bar;
use super::{CommandError, Outcome, addition, html_report, say};
use crate::cli::Addition;
use crate::config::{Config, Output};
use crate::estimate::usbl::Warning;
use crate::fusion;
use crate::log::{Appender, Encoding, Log, LogError, bad_chunks, passed_over};
use crate::math::geodesy::{Geodetic, LocalFrame};
use crate::publish::{Context, Stream, Topic, fix_messages, messages, track_messages, usbl_fix_messages};
use crate::report::{UsblParts, UsblReport, html, render_usbl};
use crate::resolve;
use crate::source::{self, DiveSamples, SigmaOrigin};
use crate::time::Time;

/// Cleans a USBL system's fixes and writes the track, a prediction and every fix's verdict beside them.
///
/// # Errors
/// [`CommandError`], and then nothing is written.
pub fn usbl(args: &Addition) -> Result<Outcome, CommandError> {
    let mut config = addition::config(args, Output::USBL)?;
    let bar = Bar::new(args.voice);
    let (log, mut warnings) = addition::open(args, &bar)?;
    let destination = addition::destination(args, "usbl");
    let usual = Encoding::of_profile(&log.index().profile);
    let encoding = *config.output.encoding.get_or_insert(usual);
    let all =
        Topic::channels(&Topic::written(&Topic::USBL, encoding, true), config.output.prefix(), encoding);
    Appender::check(&log, &destination, &all)?;
    html_report::check(args, &log, &destination)?;

    let mut damaged = choose_fixes(&log, &mut config)?;
    warnings.extend(passed_over(&damaged));
    let path = config.usbl.fix.clone().unwrap_or_default();
    let input = source::load_dive(&log, &path, &config.usbl, config.output.origin)?;
    let DiveSamples { fixes: mut loaded, heights, origin, warnings: said, read } = input;
    damaged.extend(read.damaged);
    addition::ensure_whole(&mut damaged, &log, args)?;
    warnings.extend(said.into_iter().filter(|sentence| !warnings.contains(sentence)).collect::<Vec<_>>());
    config.output.origin = config.output.origin.or(loaded.fix_origin);
    let fixes = std::mem::take(&mut loaded.source);
    let geodetic = config.output.origin.map(|place| LocalFrame::new(Geodetic::from_degrees(place)));
    let topics = Topic::written(&Topic::USBL, encoding, geodetic.is_some());
    let channels = Topic::channels(&topics, config.output.prefix(), encoding);
    let compression = config.output.compression;
    let begin = || Appender::begin(&log, &destination, &channels, compression);
    // a new file's copy of the log gets on meanwhile; the log itself is not touched before it must be
    let begun = if args.in_place { None } else { Some(begin()?) };
    bar.doing("cleaning");
    let plan = resolve::dive_plan(&mut config, &loaded, &fixes, origin)?;
    let dive = fusion::usbl::clean(&fixes, &loaded.arrival, &heights, &plan)?;
    addition::check_finite(&dive.fusion.track)?;
    config.usbl.cycle_s = Some(dive.cycle_s);

    let first = dive.fusion.track.points.first().map_or(origin, |p| p.time);
    let t0 = config.output.t0_ns.map_or(first, Time::from_ns);
    config.output.t0_ns = Some(t0.ns());
    let shift_s = resolve::log_time_shift_s(&loaded);
    warnings.extend(resolve::warnings_of(std::slice::from_ref(&loaded), shift_s));
    if plan.sigma_is_guess {
        loaded.sigma[0] = Some((dive.noise_m[0], SigmaOrigin::Estimated));
    }
    let told = dive.pieces.iter().flat_map(|piece| &piece.warnings).chain(&dive.warnings);
    let told = told.filter(|w| !plan.sigma_is_guess || !matches!(w, Warning::Noise { .. }));
    warnings.extend(told.map(|w| w.clone().later(origin.seconds_since(t0)).to_string()));
    let (input_name, output_name) =
        (args.log.display().to_string(), destination.path(&log).display().to_string());
    let of_fixes = loaded.notes.iter().cloned();
    let notes: Vec<String> = of_fixes.chain(log.visibility().note()).chain(encoding.note(usual)).collect();
    let report = UsblReport::new(&UsblParts {
        input: &input_name,
        output: &output_name,
        t0,
        origin: config.output.origin,
        loaded: &loaded,
        fixes: &fixes,
        depth: config.usbl.depth.as_deref().map(|path| (path, heights.len())),
        plan: &plan,
        dive: &dive,
        notes: &notes,
        warnings: &warnings,
    });
    let text = render_usbl(&report);

    let kept = std::slice::from_ref(&dive.kept);
    let context = Context {
        sources: kept,
        origin,
        rate_hz: plan.rate_hz,
        t0,
        surface_at_zero: config.output.surface_at_zero == Some(true),
        log_start: resolve::log_start(&log, shift_s),
        encoding,
        geodetic,
    };
    let metadata = addition::metadata(&log, &config, "usbl", &report)?;
    let parts = html::usbl::Parts { report: &report, dive: &dive, origin, t0 };
    let page = html_report::prepare(args, &metadata, |provenance, config| {
        html::usbl::page(parts, provenance, config)
    })?;
    let mut appender = begun.map_or_else(begin, Ok)?;
    appender.leave_out(bad_chunks(&damaged));
    bar.doing("writing the track");
    let judged = usbl_fix_messages(&dive.fixes, &dive.judged, &plan.frame_id, context);
    let prediction = track_messages(Topic::Prediction, &dive.prediction, context);
    let places = fix_messages(Topic::TrackFix, &dive.fusion, context);
    let more: Vec<Stream<'_>> = vec![Box::new(prediction), Box::new(judged), Box::new(places)];
    let messages = messages(&dive.fusion, context, &text, &warnings, more);
    addition::write(&mut appender, messages, &topics, shift_s)?;
    appender.add_metadata(metadata);
    appender.finish()?;
    html_report::publish(page, &output_name)?;
    drop(bar);
    let text = format!("{}\n\n{text}", addition::files(args, &input_name, &output_name));
    say(args.voice, &text, &report, &warnings);
    Ok(if warnings.is_empty() { Outcome::Done } else { Outcome::Warned })
}

/// Fills in the fixes' path where the config names none, and returns what could not be read on the way.
fn choose_fixes(log: &Log, config: &mut Config) -> Result<Vec<LogError>, CommandError> {
    if config.usbl.fix.is_some() {
        return Ok(Vec::new());
    }
    let (path, damaged) = source::usbl_fix(log)?;
    config.usbl.fix = Some(path);
    Ok(damaged)
}
