//! `trackfuse inspect`: log -> what is in it.

use super::progress::Bar;
use super::{CommandError, Outcome, open, show};
use crate::cli::Inspect;
use crate::config::Config;
use crate::inspect::inspect as look_into;
use crate::log::{LogError, WholePart};
use crate::report;

/// Says what is in a log.
///
/// # Errors
/// [`CommandError::Log`] for a log that can't be opened, [`CommandError::Broken`] where a part of it is whole.
pub fn inspect(args: &Inspect) -> Result<Outcome, CommandError> {
    let bar = Bar::new(args.voice);
    let log =
        open(&args.log, args.memory, &bar).map_err(|error| match (&error, WholePart::of(&args.log)) {
            (LogError::CutOff { .. } | LogError::Damaged { .. }, Some(whole)) => {
                CommandError::Broken { error, whole: Box::new(whole) }
            }
            _ => error.into(),
        })?;
    let inspection = look_into(&log, &Config::default().output.prefix);
    drop(bar);
    let text = report::render_inspection(&inspection);
    show(args.voice, &text, &inspection, &inspection.warnings)?;
    Ok(if inspection.warnings.is_empty() { Outcome::Done } else { Outcome::Warned })
}
