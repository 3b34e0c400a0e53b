//! `trackfuse export`: a track out of a log.

use std::io::{self, BufWriter, Write};

use super::progress::Bar;
use super::{CommandError, Outcome, open, say, show};
use crate::cli::{Export, Format};
use crate::log::{LogError, write_new};
use crate::printable::printable;
use crate::report::{ExportReport, csv};
use crate::source;

/// Writes a track as a table, on stdout or to a file.
///
/// # Errors
/// [`CommandError`] for a log that can't be read, a channel that holds no track, and an output that can't be
/// written.
pub fn export(args: &Export) -> Result<Outcome, CommandError> {
    let Format::Csv = args.format;
    let bar = Bar::new(args.voice);
    let (log, damage) = open(&args.log, args.memory, args.strict, &bar)?;
    if let Some(out) = &args.output {
        log.ensure_other(out)?;
    }
    let mut recorded = source::recorded(&log, &args.topic)?;
    recorded.warnings.splice(..0, damage);
    drop(bar);
    let t0 = recorded.origin();
    let warnings = &recorded.warnings;
    let mut report = ExportReport::new(args.log.display().to_string(), &args.topic, &recorded);
    if let Some(out) = &args.output {
        let len = write_new(out, args.force, |file| {
            csv::write_csv(&recorded, t0, file)
                .map_err(|source| LogError::Write { path: out.clone(), source })
        })?;
        let text = format!("{} -> {} ({} points, {len} bytes)", args.topic, out.display(), report.points);
        let mut text = printable(&text).into_owned() + "\n";
        text.extend(warnings.iter().map(|w| format!("warning: {}\n", printable(w))));
        report.output = Some(out.display().to_string());
        report.bytes = Some(len.to_string());
        say(args.voice, &text, &report, warnings);
    } else if args.voice.json {
        report.rows = Some(csv::rows(&recorded, t0).collect());
        show(args.voice, "", &report, warnings)?;
    } else {
        let mut stdout = BufWriter::new(io::stdout().lock());
        match csv::write_csv(&recorded, t0, &mut stdout).and_then(|()| stdout.flush()) {
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
