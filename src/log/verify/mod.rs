//! Every checksum and index entry of a file held against what the file holds, from the first byte to the last.
//!
//! Shares no step with [`Log::open`](super::Log::open), which believes what it can: here nothing is believed. The
//! file is read once, in order, with one chunk at a time in memory; what is broken is passed over by the help
//! of the summary, where that tells what comes next.
//!
//! | part | held against |
//! |---|---|
//! | chunk | its sizes, its checksum, the log times of its messages |
//! | message index | the messages of its chunk: place, channel, log time, and that none is left out |
//! | attachment | its checksum |
//! | definitions | ids before they are used, and one meaning for each |
//! | summary | all of that: copies, indexes, statistics, offsets, its checksum |

mod against;
mod attachment;
mod chunk_content;
mod content;
mod data_section;
mod findings;
mod sequence;
mod tail;
#[cfg(test)]
mod tests;

use std::path::Path;

use super::LogError;
use super::ReadOptions;
use super::ending::MAGIC;
use super::file::LogFile;
use data_section::DataSection;
use sequence::Sequence;

pub use findings::Finding;

/// How much was checked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Checked {
    /// Bytes that were read.
    pub bytes: u64,
    /// Chunks.
    pub chunks: u64,
    /// Chunks whose checksum is right.
    pub chunk_checksums_right: u64,
    /// Chunks that have none.
    pub chunks_without_checksum: u64,
    /// Chunks with messages that have no message index.
    pub chunks_without_message_index: u64,
    /// Messages, in chunks and outside.
    pub messages: u64,
    /// Messages outside chunks.
    pub loose_messages: u64,
    /// Entries of message indexes.
    pub index_entries: u64,
    /// Attachments.
    pub attachments: u64,
    /// Attachments that have no checksum.
    pub attachments_without_checksum: u64,
    /// Metadata records.
    pub metadata: u64,
    /// Whether the checksum of the data section is right; `None` where there is none, or where its end was
    /// not found.
    pub data_section: Option<bool>,
    /// Whether the checksum of the summary is right.
    pub summary: Option<bool>,
}

/// What is wrong with a log, and what could not be told.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Verification {
    /// What is wrong, mostly in file order; the first hundred.
    pub findings: Vec<Finding>,
    /// How many more there are.
    pub left_out: u64,
    /// What the file has no checksum or index for, or what damage hides; a few words each.
    pub not_checkable: Vec<String>,
    /// How much was checked.
    pub checked: Checked,
}

impl Verification {
    /// Whether nothing is wrong.
    #[must_use]
    pub fn is_clean(&self) -> bool {
        self.findings.is_empty()
    }
}

/// Reads the whole file, as `options` say, and says what is wrong with it.
///
/// # Errors
/// [`LogError::Open`], [`LogError::Read`]; [`LogError::NotMcap`] where the file doesn't start like one.
/// Everything else that is wrong is a [`Finding`].
pub fn verify(path: &Path, options: ReadOptions) -> Result<Verification, LogError> {
    let file = LogFile::open(path, options)?;
    let mut sequence = Sequence::new(&file);
    let mut start = Vec::new();
    sequence.read_into(file.len.min(MAGIC.len() as u64), &mut start)?;
    if start.is_empty() || !MAGIC.starts_with(&start) {
        let found =
            format!("it starts with \"{}\", expected \"{}\"", start.escape_ascii(), MAGIC.escape_ascii());
        return Err(LogError::NotMcap { path: path.to_owned(), found });
    }
    let ending = tail::Ending::of(&file)?;
    let mut data = DataSection::read(&mut sequence, ending.as_ref())?;
    tail::check(&mut sequence, ending.as_ref(), &mut data)?;

    let not_checkable = not_checkable(&data);
    let DataSection { findings, checked, .. } = data;
    Ok(Verification {
        findings: findings.kept,
        left_out: findings.left_out,
        not_checkable,
        checked: Checked { bytes: sequence.position, ..checked },
    })
}

fn not_checkable(data: &DataSection) -> Vec<String> {
    let checked = &data.checked;
    let mut parts = data.not_checkable.clone();
    let counts = [
        (checked.chunks_without_checksum, checked.chunks, "chunks", "checksum"),
        (checked.chunks_without_message_index, checked.chunks, "chunks", "message index"),
        (checked.loose_messages, checked.messages, "messages stand outside chunks and", "index"),
        (checked.attachments_without_checksum, checked.attachments, "attachments", "checksum"),
    ];
    for (n, of, what, lack) in counts.into_iter().filter(|(n, ..)| *n > 0) {
        parts.push(format!("{n} of {of} {what} have no {lack}"));
    }
    parts
}

/// What an error says of the file; one of reading it is passed on.
fn what_of(error: LogError) -> Result<String, LogError> {
    match error {
        LogError::Damaged { what, .. } => Ok(what),
        LogError::UnknownCompression { name, .. } => {
            Ok(format!("the chunk's compression is {}, expected zstd, lz4 or none", findings::quoted(&name)))
        }
        LogError::TooLarge { what, size, limit, .. } => {
            Ok(format!("{what} has {size} bytes, more than the limit of {limit}, and was not looked into"))
        }
        other => Err(other),
    }
}
