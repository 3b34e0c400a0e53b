//! `--report`: the page beside the log, which gets its name when the log has got its own.

use std::io::Write;
use std::path::Path;

use super::CommandError;
use crate::cli::Addition;
use crate::log::{Destination, Log, LogError, NewMetadata, Prepared, check_name};
use crate::printable::shell_word;
use crate::report::html::Page;

/// Refuses the page's name before any work is done.
pub(super) fn check(args: &Addition, log: &Log, destination: &Destination) -> Result<(), CommandError> {
    let Some(page) = &args.report else { return Ok(()) };
    log.ensure_other(page)?;
    check_name(page, args.force)?;
    let folder = |path: &Path| {
        let folder = path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
        folder.canonicalize().ok()
    };
    let out = destination.path(log);
    if page.file_name() == out.file_name() && folder(page) == folder(out) {
        return Err(CommandError::OneName { path: page.clone() });
    }
    Ok(())
}

/// Writes the page, all but its name; it is made of the track's provenance and of its config.
pub(super) fn prepare(
    args: &Addition,
    metadata: &NewMetadata,
    page: impl FnOnce(&[(String, String)], &str) -> Page,
) -> Result<Option<Prepared>, LogError> {
    let Some(out) = &args.report else { return Ok(None) };
    let config = metadata.entries.get("config").map_or("", String::as_str);
    let page = page(&provenance(metadata), config).render();
    let written = |source| LogError::Write { path: out.clone(), source };
    Prepared::new(out, args.force, |file| file.write_all(page.as_bytes()).map_err(written)).map(Some)
}

/// Gives the page its name, now that the log has its own.
pub(super) fn publish(page: Option<Prepared>, log: &str) -> Result<(), CommandError> {
    let lost = |source| CommandError::ReportLost { log: log.to_owned(), source };
    page.map_or(Ok(()), |page| page.publish().map_err(lost))
}

/// Where the track comes from, as the log's metadata say it, and the command as it was given.
fn provenance(metadata: &NewMetadata) -> Vec<(String, String)> {
    let given = std::env::args_os().skip(1).map(|arg| shell_word(&arg.to_string_lossy()));
    let command = std::iter::once("trackfuse".to_owned()).chain(given).collect::<Vec<_>>().join(" ");
    let shown = [
        ("version", "version"),
        ("input_size", "input, bytes"),
        ("input_data_section_crc", "CRC of the input's data section"),
        ("input_summary_sha256", "SHA-256 of its summary"),
    ];
    let of = |(key, name): (&str, &str)| Some((name.to_owned(), metadata.entries.get(key)?.clone()));
    std::iter::once(("command".to_owned(), command)).chain(shown.into_iter().filter_map(of)).collect()
}
