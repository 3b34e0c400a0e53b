//! `trackfuse export`: a track out of a log.

use std::io::{self, BufWriter, IsTerminal, Write};
use std::path::PathBuf;

use clap::ValueEnum;

use super::progress::Bar;
use super::{CommandError, Outcome, note, open, say, show};
use crate::cli::{Export, Format};
use crate::export::{Exported, Map, csv, geojson, kml, parquet, tum};
use crate::log::{Log, LogError, write_new};
use crate::printable::printable;
use crate::report::ExportReport;
use crate::source::{self, Recorded};

/// Why a track can't be had in a format.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExportError {
    /// Maps want a place on the earth.
    #[error("topic {topic:?}: no latitude and longitude of its zero is known, expected one for {format}")]
    NoOrigin {
        /// The topic.
        topic: String,
        /// The format.
        format: &'static str,
    },
    /// One place is not two.
    #[error(
        "topic {topic:?}: its zero is known to lie at {}, expected no other `--origin`, got {}",
        degrees(.known), degrees(.given)
    )]
    OtherOrigin {
        /// The topic.
        topic: String,
        /// Latitude and longitude, degrees, and altitude, m, that the log says.
        known: [f64; 3],
        /// Those that were given.
        given: [f64; 3],
    },
    /// An output whose name says another format than there is.
    #[error(
        "output {output:?}: no format has this ending, expected that of csv, parquet, geojson, kml or tum"
    )]
    Ending {
        /// The output.
        output: PathBuf,
    },
    /// Bytes that would steer a terminal.
    #[error("{format} is not for a terminal, expected an output")]
    ForNoTerminal {
        /// The format.
        format: &'static str,
    },
    /// The report holds the table only.
    #[error("`--json` without an output holds the table itself, expected format csv, got {format}")]
    NotInJson {
        /// The format.
        format: &'static str,
    },
}

impl ExportError {
    /// What to do about it.
    #[must_use]
    pub fn hint(&self) -> String {
        let hint = match self {
            Self::Ending { output } if output.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) => {
                return format!("a map in JSON is GeoJSON: `{}`", output.with_extension("geojson").display());
            }
            Self::Ending { .. } => "`--format FORMAT` says what to write, whatever the name",
            Self::OtherOrigin { .. } => {
                "leave `--origin` out; `output.origin` in the config of `fuse` says where a track's zero lies"
            }
            Self::NoOrigin { .. } => {
                "`--origin LAT,LON,ALT` gives it, in degrees and metres; `output.origin` in the config of `fuse` does so once \
                 and for all"
            }
            Self::ForNoTerminal { .. } | Self::NotInJson { .. } => "`-o FILE` names one",
        };
        hint.to_owned()
    }
}

/// A place as `--origin` takes it.
fn degrees([latitude, longitude, altitude]: &[f64; 3]) -> String {
    format!("{latitude},{longitude},{altitude}")
}

/// Writes a track in a format of other tools, on stdout or to a file.
///
/// # Errors
/// [`CommandError`] for a log that can't be read, a channel that holds no track, a format that the track can't be
/// written in, and an output that can't be written.
pub fn export(args: &Export) -> Result<Outcome, CommandError> {
    let format = format(args)?;
    check_output(args, format)?;
    let bar = Bar::new(args.voice);
    let (log, damage) = open(&args.log, args.memory, args.strict, &bar)?;
    if let Some(out) = &args.output {
        log.ensure_other(out)?;
    }
    let topic = args.topic.clone().unwrap_or_else(|| source::usual_track(&log));
    let mut recorded = source::recorded(&log, &topic)?;
    recorded.warnings.splice(..0, damage);
    let map = match format {
        Format::Geojson | Format::Kml => Some(map(args, &topic, format, &log, &mut recorded)?),
        Format::Csv | Format::Parquet | Format::Tum => None,
    };
    drop(bar);
    if recorded.is_own && !recorded.has_phases {
        let what = "have no place for phase, method and acceleration";
        note(args.voice, &format!("the messages of {topic} {what}"));
    }
    let written = Written { exported: Exported { topic: &topic, recorded: &recorded }, map, format };
    let mut report = ExportReport::new(args.log.display().to_string(), &topic, name(format), &recorded);
    if let Some(vertices) = written.map.as_ref().map(Map::vertices).filter(|v| *v < report.points) {
        note(args.voice, &format!("a map's lines are thinned: {vertices} of {} points", report.points));
    }
    let warnings = &recorded.warnings;
    if let Some(out) = &args.output {
        let len = write_new(out, args.force, |file| {
            written.write(file).map_err(|source| LogError::Write { path: out.clone(), source })
        })?;
        let (points, format) = (report.points, name(format));
        let text = format!("{topic} -> {} ({format}, {points} points, {len} bytes)", out.display());
        let mut text = printable(&text).into_owned() + "\n";
        text.extend(warnings.iter().map(|w| format!("warning: {}\n", printable(w))));
        report.output = Some(out.display().to_string());
        report.bytes = Some(len.to_string());
        say(args.voice, &text, &report, warnings);
    } else if args.voice.json {
        report.rows = Some(csv::rows(&recorded, recorded.origin()).collect());
        show(args.voice, "", &report, warnings)?;
    } else {
        let mut stdout = BufWriter::new(io::stdout());
        match written.write(&mut stdout).and_then(|()| stdout.flush()) {
            // a reader that went away wants no more
            Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
                return Err(CommandError::Print(error));
            }
            _ => {}
        }
        super::warn(args.voice, warnings);
    }
    Ok(if warnings.is_empty() { Outcome::Done } else { Outcome::Warned })
}

/// The format that is asked for, else that of the output's ending, else CSV.
fn format(args: &Export) -> Result<Format, ExportError> {
    let ending = args.output.as_deref().and_then(|output| Some((output, output.extension()?)));
    match (args.format, ending) {
        (Some(format), _) => Ok(format),
        (None, None) => Ok(Format::Csv),
        (None, Some((_, ending))) if ending.eq_ignore_ascii_case("txt") => Ok(Format::Csv),
        (None, Some((output, ending))) => ending
            .to_str()
            .and_then(|ending| Format::from_str(ending, true).ok())
            .ok_or_else(|| ExportError::Ending { output: output.to_owned() }),
    }
}

/// Refuses formats that can't go where they should, before any work is done.
fn check_output(args: &Export, format: Format) -> Result<(), ExportError> {
    let name = name(format);
    match format {
        _ if args.output.is_some() => Ok(()),
        Format::Csv => Ok(()),
        _ if args.voice.json => Err(ExportError::NotInJson { format: name }),
        Format::Parquet if io::stdout().is_terminal() => Err(ExportError::ForNoTerminal { format: name }),
        _ => Ok(()),
    }
}

/// The track as a map shows it, with the characteristic points beside it.
fn map(
    args: &Export,
    topic: &str,
    format: Format,
    log: &Log,
    recorded: &mut Recorded,
) -> Result<Map, CommandError> {
    let (named, format) = (topic.to_owned(), name(format));
    let origin = match (recorded.fix_origin, args.origin) {
        (Some(known), Some(given)) if known != given => {
            return Err(ExportError::OtherOrigin { topic: named, known, given }.into());
        }
        (known, given) => known.or(given).ok_or(ExportError::NoOrigin { topic: named, format })?,
    };
    let (events, left_out) = if recorded.is_own && topic.ends_with("/track") {
        source::recorded_events(log, topic)?
    } else {
        Default::default()
    };
    let new: Vec<String> = left_out.into_iter().filter(|w| !recorded.warnings.contains(w)).collect();
    recorded.warnings.extend(new);
    Ok(Map::new(Exported { topic, recorded }, &events, origin))
}

fn name(format: Format) -> &'static str {
    match format {
        Format::Csv => "csv",
        Format::Parquet => "parquet",
        Format::Geojson => "geojson",
        Format::Kml => "kml",
        Format::Tum => "tum",
    }
}

/// What is written.
struct Written<'a> {
    exported: Exported<'a>,
    /// For the formats that are maps.
    map: Option<Map>,
    format: Format,
}

impl Written<'_> {
    fn write(&self, out: &mut (impl Write + Send)) -> io::Result<()> {
        let recorded = self.exported.recorded;
        match (self.format, &self.map) {
            (Format::Geojson, Some(map)) => geojson::write_geojson(map, out),
            (Format::Kml, Some(map)) => kml::write_kml(map, out),
            (Format::Parquet, _) => parquet::write_parquet(self.exported, out),
            (Format::Tum, _) => tum::write_tum(self.exported, out),
            _ => csv::write_csv(recorded, recorded.origin(), out),
        }
    }
}
