//! `trackfuse init`: log -> a config for it.

use std::io::Write;
use std::path::Path;

use super::progress::Bar;
use super::{CommandError, Outcome, open, show};
use crate::cli::Init;
use crate::config::{SourceTable, template};
use crate::log::{LogError, write_new};
use crate::printable::{printable, shell_word};
use crate::report::InitReport;
use crate::report::inspection::TakenSource;
use crate::source;

/// Writes a config for a log, or prints it.
///
/// # Errors
/// [`CommandError`] for a log that can't be read and an output that can't be written; then nothing is.
pub fn init(args: &Init) -> Result<Outcome, CommandError> {
    let bar = Bar::new(args.voice);
    let (log, mut warnings) = open(&args.log, args.memory, false, &bar)?;
    if let Some(output) = &args.output {
        log.ensure_other(output)?;
    }
    let proposal = if args.source.is_empty() {
        source::propose(&log)?
    } else {
        source::propose_chosen(&log, &args.source)?
    };
    warnings.extend(proposal.all_warnings());
    drop(bar);
    let input = args.log.display().to_string();
    let config = template(&head(&input, args.output.as_deref(), &warnings), &proposal.tables);
    if let Some(output) = &args.output {
        let failed = |source| LogError::Write { path: output.clone(), source };
        write_new(output, args.force, |file| file.write_all(config.as_bytes()).map_err(failed))?;
    }

    let report = InitReport {
        version: env!("CARGO_PKG_VERSION").into(),
        input,
        output: args.output.as_ref().map(|path| path.display().to_string()),
        sources: proposal.tables.iter().filter(|t| !t.commented).map(taken).collect(),
        undecided: proposal.undecided,
        config,
        warnings,
    };
    show(args.voice, &text(&report), &report, &report.warnings)?;
    Ok(if report.warnings.is_empty() { Outcome::Done } else { Outcome::Warned })
}

/// The lines at the config's head.
fn head(input: &str, output: Option<&Path>, warnings: &[String]) -> Vec<String> {
    let config = output.map_or("CONFIG".into(), |path| path.display().to_string());
    let mut head =
        vec![format!("Config for `trackfuse fuse {} --config {}`.", shell_word(input), shell_word(&config))];
    head.extend(warnings.iter().map(|warning| format!("warning: {warning}")));
    head.push(String::new());
    head
}

/// The config, or what was written where.
fn text(report: &InitReport) -> String {
    let Some(output) = &report.output else { return report.config.clone() };
    let names = report.sources.iter().map(|s| {
        let mark = if s.datum { " (datum)" } else { "" };
        format!("{}{mark}", s.name)
    });
    let names: Vec<String> = names.collect();
    let sources = if names.is_empty() { "no source yet".to_owned() } else { names.join(", ") };
    let mut text = printable(&format!("{} -> {output}: {sources}", report.input)).into_owned() + "\n";
    text.extend(report.warnings.iter().map(|w| format!("warning: {}\n", printable(w))));
    text
}

fn taken(table: &SourceTable) -> TakenSource {
    TakenSource {
        name: table.name.clone(),
        datum: table.datum,
        position: table.positions.first().cloned(),
        velocity: table.velocities.first().cloned(),
    }
}
