//! `trackfuse inspect`: log -> what is in it.

use super::{CommandError, Outcome, show};
use crate::cli::Inspect;
use crate::config::Config;
use crate::inspect::inspect as look_into;
use crate::log::Log;
use crate::report;

/// Says what is in a log.
///
/// # Errors
/// [`CommandError::Log`] for a log that can't be opened.
pub fn inspect(args: &Inspect) -> Result<Outcome, CommandError> {
    let log = Log::open(&args.log)?;
    let inspection = look_into(&log, &Config::default().output.prefix);
    let text = report::render_inspection(&inspection);
    show(args.voice, &text, &inspection, &inspection.warnings)?;
    Ok(if inspection.warnings.is_empty() { Outcome::Done } else { Outcome::Warned })
}
