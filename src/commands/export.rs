//! `trackfuse export`: a track out of a log.

use std::io::{self, BufWriter, Write};

use serde_json::json;

use super::{CommandError, Outcome, say, show};
use crate::cli::{Export, Format};
use crate::log::{Log, LogError, write_new};
use crate::report::csv;
use crate::source;

/// Writes a track as a table, on stdout or to a file.
///
/// # Errors
/// [`CommandError`] for a log that can't be read, a channel that holds no track, and an output that can't be
/// written.
pub fn export(args: &Export) -> Result<Outcome, CommandError> {
    let Format::Csv = args.format;
    let log = Log::open(&args.log)?;
    let recorded = source::recorded(&log, &args.topic)?;
    let t0 = recorded.origin();
    let warnings = &recorded.warnings;
    let points = recorded.track.points.len();
    if let Some(out) = &args.output {
        let len = write_new(out, args.force, |file| {
            csv::write_csv(&recorded, t0, file)
                .map_err(|source| LogError::Write { path: out.clone(), source })
        })?;
        let text = format!("{} -> {} ({points} points, {len} bytes)\n", args.topic, out.display());
        let summary = json!({
            "log": args.log.display().to_string(),
            "topic": args.topic,
            "t0_ns": t0.ns().to_string(),
            "frame_id": recorded.track.frame_id,
            "output": out.display().to_string(),
            "points": points,
            "bytes": len.to_string(),
            "warnings": warnings,
        });
        say(args.voice, &text, &summary, warnings);
    } else if args.voice.json {
        let rows: Vec<Vec<String>> = csv::rows(&recorded, t0).collect();
        let table = json!({
            "log": args.log.display().to_string(),
            "topic": args.topic,
            "t0_ns": t0.ns().to_string(),
            "frame_id": recorded.track.frame_id,
            "columns": csv::COLUMNS,
            "rows": rows,
            "warnings": warnings,
        });
        show(args.voice, "", &table, warnings)?;
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
