//! `trackfuse inspect`: log -> what is in it.

use super::progress::Bar;
use super::{CommandError, Outcome, open, options, show, warn};
use crate::cli::Inspect;
use crate::inspect::{inspect as look_into, verified};
use crate::log::verify::verify;
use crate::report;

/// Says what is in a log, and what is wrong with it.
///
/// # Errors
/// [`CommandError::Log`] for a log that can't be opened.
pub fn inspect(args: &Inspect) -> Result<Outcome, CommandError> {
    let bar = Bar::new(args.voice);
    let verification = args.verify.then(|| verify(&args.log, options(args.memory, &bar))).transpose()?;
    let (log, _) = open(&args.log, args.memory, false, &bar).inspect_err(|_| {
        // What a log that can't be opened has wrong with it is not for a report of what is in it.
        warn(args.voice, &verification.as_ref().map(verified::warnings).unwrap_or_default());
    })?;
    let mut inspection = look_into(&log);
    if let Some(verification) = verification {
        verified::add(&mut inspection, verification);
    }
    drop(bar);
    let text = report::render_inspection(&inspection);
    show(args.voice, &text, &inspection, &inspection.warnings)?;
    Ok(if inspection.warnings.is_empty() { Outcome::Done } else { Outcome::Warned })
}
