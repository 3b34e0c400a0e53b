//! `trackfuse restore`: a log that was added to -> the original.

use std::path::Path;

use super::progress::Bar;
use super::{CommandError, Outcome, beside, say};
use crate::cli::Restore;
use crate::log::{Log, ReadOptions, put_back, restore_pending_to};
use crate::printable::printable;
use crate::report::RestoreReport;

/// What the report says of the original's data section.
const NOT_CHECKED: &str = "not checked";
const WRONG: &str = "wrong";

/// Takes off what was added to a log: what a run left half done, else what runs that ended added.
///
/// # Errors
/// [`CommandError::Log`] for a log that nothing was added to, or that can't be the original's; then nothing is
/// written.
pub fn restore(args: &Restore) -> Result<Outcome, CommandError> {
    let half_done = match &args.output {
        Some(out) => restore_pending_to(&args.log, out, args.force)?,
        None => put_back(&args.log)?,
    };
    let report = match half_done {
        Some(len) => RestoreReport { cut_off_run: true, ..report(args, args.output.as_deref(), len) },
        None => take_off(args)?,
    };
    say(args.voice, &text(&report), &report, &report.warnings);
    Ok(if report.warnings.is_empty() { Outcome::Done } else { Outcome::Warned })
}

fn take_off(args: &Restore) -> Result<RestoreReport, CommandError> {
    let bar = Bar::new(args.voice);
    let options = ReadOptions { observer: bar.observer(), ..ReadOptions::default() };
    let open = if args.in_place { Log::open_in_place_with } else { Log::open_with };
    let log = open(&args.log, options)?;
    let mut warnings = log.damage_warnings();
    let mut data_section = NOT_CHECKED;
    let additions = log.additions()?;
    let kept = if args.last { additions.len() - 1 } else { 0 };
    let addition = &additions[kept];
    let output = match &args.output {
        _ if args.in_place => args.log.clone(),
        Some(out) => out.clone(),
        None => beside(&args.log, "restored"),
    };
    if args.in_place {
        log.restore_in_place(addition)?;
    } else {
        data_section = match log.restore_to(addition, &output, args.force)? {
            Some(true) => "right",
            Some(false) => WRONG,
            None => NOT_CHECKED,
        };
        if data_section == WRONG {
            warnings.push(
                "the original's data section is not what its checksum says: it was damaged before trackfuse added \
                 to it, or since"
                    .into(),
            );
        }
        warnings.extend(addition.appended_by_others.map(|at| {
            format!("what another program appended to the log, from offset {at} on, is not in the original")
        }));
    }
    Ok(RestoreReport {
        additions_taken_off: additions.len() - kept,
        additions_left: kept,
        data_section: data_section.into(),
        warnings,
        ..report(args, Some(&output), addition.original_len)
    })
}

/// Of an output of `len` bytes, in place where it is none of its own.
fn report(args: &Restore, output: Option<&Path>, len: u64) -> RestoreReport {
    RestoreReport {
        version: env!("CARGO_PKG_VERSION").into(),
        log: args.log.display().to_string(),
        output: output.unwrap_or(&args.log).display().to_string(),
        bytes: len.to_string(),
        cut_off_run: false,
        additions_taken_off: 0,
        additions_left: 0,
        data_section: NOT_CHECKED.into(),
        warnings: Vec::new(),
    }
}

fn text(report: &RestoreReport) -> String {
    let original = if report.data_section == WRONG { "" } else { "the original, " };
    let what = match (report.cut_off_run, report.additions_taken_off, report.additions_left) {
        (true, ..) => "as it was before a run that was cut off".to_owned(),
        (_, 1, 0) => format!("{original}1 addition taken off"),
        (_, off, 0) => format!("{original}{off} additions taken off"),
        (_, off, left) => format!("{off} of {} additions taken off", off + left),
    };
    let RestoreReport { log, output, bytes, data_section, .. } = report;
    let files = if log == output { format!("{log}, in place") } else { format!("{log} -> {output}") };
    let warnings = report.warnings.iter().map(|warning| format!("warning: {}\n", printable(warning)));
    printable(&format!("{files}: {what}, {bytes} bytes, data section {data_section}")).into_owned()
        + "\n"
        + &warnings.collect::<String>()
}
