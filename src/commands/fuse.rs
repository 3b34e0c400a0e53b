//! `trackfuse fuse`: log -> sources -> track -> log.

use super::progress::Bar;
use super::{CommandError, Outcome, addition, html_report, say};
use crate::cli::Addition;
use crate::config::{Config, Output};
use crate::fusion;
use crate::log::{Appender, Encoding, Log, bad_chunks};
use crate::math::geodesy::{Geodetic, LocalFrame};
use crate::publish::{Context, Stream, Topic, fix_messages, messages};
use crate::report::{self, Report, html};
use crate::resolve;
use crate::sample::Source;
use crate::source::{self, Recognised, Samples};
use crate::time::Time;

/// Fuses a log's sources and writes the track beside them.
///
/// # Errors
/// [`CommandError`], and then nothing is written.
pub fn fuse(args: &Addition) -> Result<Outcome, CommandError> {
    let mut config = addition::config(args, Output::FUSED)?;
    let bar = Bar::new(args.voice);
    let (log, mut warnings) = addition::open(args, &bar)?;
    let destination = addition::destination(args, "fused");
    let usual = Encoding::of_profile(&log.index().profile);
    let encoding = *config.output.encoding.get_or_insert(usual);
    let all =
        Topic::channels(&Topic::written(&Topic::FUSED, encoding, true), config.output.prefix(), encoding);
    Appender::check(&log, &destination, &all)?;
    html_report::check(args, &log, &destination)?;

    let named = !config.source.is_empty();
    let Recognised { unused, warnings: of_sources, mut damaged, .. } = choose_sources(&log, &mut config)?;
    warnings.extend(of_sources);
    let Samples { mut loaded, origin, left_out, read } =
        source::load(&log, &config.source, named, config.output.origin)?;
    damaged.extend(read.damaged);
    addition::ensure_whole(&mut damaged, &log, args)?;
    let known = |sentence: &String| warnings.contains(sentence);
    let left_out: Vec<String> = left_out.into_iter().filter(|sentence| !known(sentence)).collect();
    warnings.extend(left_out);
    config.source = loaded.iter().map(|l| l.config.clone()).collect();
    let datum = source::datum(&config.source);
    config.source[datum].datum = true;
    // another source's frame is not the track's
    config.output.origin = config.output.origin.or(loaded[datum].fix_origin);
    // moved: copies would double what millions of samples take
    let sources: Vec<Source> = loaded.iter_mut().map(|l| std::mem::take(&mut l.source)).collect();
    let geodetic = config.output.origin.map(|place| LocalFrame::new(Geodetic::from_degrees(place)));
    let topics = Topic::written(&Topic::FUSED, encoding, geodetic.is_some());
    let channels = Topic::channels(&topics, config.output.prefix(), encoding);
    let compression = config.output.compression;
    let begin = || Appender::begin(&log, &destination, &channels, compression);
    // a new file's copy of the log gets on while the track is fitted; the log itself is not touched before it must be
    let begun = if args.in_place { None } else { Some(begin()?) };
    bar.doing("fitting");
    let plan = resolve::plan(&mut config, &loaded, &sources, datum, origin, &mut warnings)?;
    let fusion = fusion::fuse(&sources, &plan)?;
    addition::check_finite(&fusion.track)?;

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
    let metadata = addition::metadata(&log, &config, "fuse", &report)?;
    let parts = html::fusion::Parts { report: &report, fusion: &fusion, sources: &sources, origin, t0 };
    let page = html_report::prepare(args, &metadata, |provenance, config| {
        html::fusion::page(parts, provenance, config)
    })?;
    let mut appender = begun.map_or_else(begin, Ok)?;
    appender.leave_out(bad_chunks(&damaged));
    bar.doing("writing the track");
    let places: Stream<'_> = Box::new(fix_messages(Topic::Fix, &fusion, context));
    let messages = messages(&fusion, context, &text, &warnings, vec![places]);
    addition::write(&mut appender, messages, &topics, shift_s)?;
    appender.add_metadata(metadata);
    appender.finish()?;
    html_report::publish(page, &output_name)?;
    drop(bar);
    let text = format!("{}\n\n{text}", addition::files(args, &input_name, &output_name));
    say(args.voice, &text, &report, &warnings);
    Ok(if warnings.is_empty() { Outcome::Done } else { Outcome::Warned })
}

/// Fills in the sources where the config names none, and returns what else was found on the way.
fn choose_sources(log: &Log, config: &mut Config) -> Result<Recognised, CommandError> {
    if !config.source.is_empty() {
        return Ok(Recognised::default());
    }
    let mut recognised = source::recognise(log)?;
    config.source = std::mem::take(&mut recognised.sources);
    Ok(recognised)
}
