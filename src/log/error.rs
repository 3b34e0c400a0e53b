//! What can go wrong between a log and this program.

use std::{io, path::PathBuf};

/// Why new channels can't be put into a log without making old messages hard to find.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Obstacle {
    /// Messages stand in the data section itself, where an indexed reader doesn't look.
    #[error("messages stand outside chunks, the first near offset {offset}")]
    LooseMessages {
        /// Where the first of them, or the schemas and channels before it, begins.
        offset: u64,
    },
    /// A chunk holds messages, but no index tells which.
    #[error("the chunk at offset {offset} has no message index")]
    NoMessageIndex {
        /// Where the chunk begins.
        offset: u64,
    },
    /// Bytes between the indexed parts of the data section aren't records.
    #[error("bytes that are no record stand at offset {offset} of the data section")]
    Garbage {
        /// Where they begin.
        offset: u64,
    },
}

/// Why a log could not be read, or its successor not written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LogError {
    /// The file could not be opened.
    #[error("cannot open {path:?}: {source}")]
    Open {
        /// The log.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The file could be opened, but not read.
    #[error("cannot read {path:?} at offset {offset}: {source}")]
    Read {
        /// The log.
        path: PathBuf,
        /// Where reading failed.
        offset: u64,
        /// What the system said.
        source: io::Error,
    },
    /// The file is something else.
    #[error("{path:?} is not an MCAP: {found}")]
    NotMcap {
        /// The file.
        path: PathBuf,
        /// What stands there instead.
        found: String,
    },
    /// The file begins as an MCAP, but its end is missing.
    #[error("{path:?} is cut off: {what}, after {len} bytes")]
    CutOff {
        /// The log.
        path: PathBuf,
        /// What is missing.
        what: &'static str,
        /// Length of the file in bytes.
        len: u64,
    },
    /// The file contradicts itself or the format.
    #[error("{path:?} is damaged at offset {offset}: {what}")]
    Damaged {
        /// The log.
        path: PathBuf,
        /// Where.
        offset: u64,
        /// What was found, and what was expected.
        what: String,
    },
    /// A whole chunk that can't be decoded: its checksum is wrong, or its content is not what its header says.
    #[error("{path:?} is damaged at offset {offset}: {what}")]
    BadChunk {
        /// The log.
        path: PathBuf,
        /// Where the chunk begins.
        offset: u64,
        /// What was found, and what was expected.
        what: String,
    },
    /// A part of the file is larger than this program takes into memory.
    #[error("{path:?}: {what} at offset {offset} claims {size} bytes, more than the limit of {limit}")]
    TooLarge {
        /// The log.
        path: PathBuf,
        /// Where it begins.
        offset: u64,
        /// What it is.
        what: &'static str,
        /// What it claims, in bytes.
        size: u64,
        /// What is allowed, in bytes.
        limit: u64,
    },
    /// A chunk is compressed in a way that this program doesn't know.
    #[error("{path:?}: the chunk at offset {offset} is compressed with {name:?}, expected zstd, lz4 or none")]
    UnknownCompression {
        /// The log.
        path: PathBuf,
        /// Where the chunk begins.
        offset: u64,
        /// The compression's name.
        name: String,
    },
    /// New channels would hide old messages from indexed readers.
    #[error("cannot safely add channels to {path:?}: {obstacle}")]
    NotAppendable {
        /// The log.
        path: PathBuf,
        /// Why.
        obstacle: Obstacle,
    },
    /// The log already has a channel of this name.
    #[error("{path:?} already has the topic {topic:?}")]
    TopicTaken {
        /// The log.
        path: PathBuf,
        /// The topic.
        topic: String,
    },
    /// All 65,535 ids are used.
    #[error("{path:?} has no free {kind} id left")]
    IdsExhausted {
        /// The log.
        path: PathBuf,
        /// `schema` or `channel`.
        kind: &'static str,
    },
    /// Something stands where the output shall go.
    #[error("{path:?} exists")]
    OutputExists {
        /// The output.
        path: PathBuf,
    },
    /// Input and output are one file.
    #[error("the output {path:?} is the input itself")]
    OutputIsInput {
        /// The output.
        path: PathBuf,
    },
    /// The output could not be written; nothing of it remains.
    #[error("cannot write {path:?}: {source}")]
    Write {
        /// The output.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

impl LogError {
    /// Damage found while a chunk was read is the chunk's.
    pub(super) fn of_chunk(self) -> Self {
        match self {
            Self::Damaged { path, offset, what } => Self::BadChunk { path, offset, what },
            other => other,
        }
    }

    /// What the user can do about it, for a line of its own.
    #[must_use]
    pub fn hint(&self) -> Option<String> {
        let hint = match self {
            Self::NotMcap { .. } => "trackfuse reads MCAP; `mcap convert` makes one of a ROS bag",
            Self::CutOff { .. } | Self::Damaged { .. } | Self::BadChunk { .. } => {
                "`mcap recover IN -o OUT` saves what is readable (it drops private records and bad chunks)"
            }
            Self::NotAppendable { .. } => {
                "keep the original and add to an indexed copy: `mcap recover LOG -o COPY` makes one, but drops \
                 private records"
            }
            Self::TopicTaken { .. } => {
                "choose another name with `--prefix`, or give the log that these channels were added to"
            }
            Self::TooLarge { .. } => "`--memory-limit 4GB`, say, takes larger ones into memory",
            Self::OutputExists { .. } => "`--force` replaces it, `-o` names another",
            Self::OutputIsInput { .. } => "`-o` names another output",
            _ => return None,
        };
        Some(hint.to_owned())
    }
}
