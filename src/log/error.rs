//! What can go wrong between a log and this program.

use std::{
    io,
    path::{Path, PathBuf},
};

use super::{Damage, disk, nearby};
use crate::printable::shell_word;

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
    /// The log is damaged, and only a whole one was asked for.
    #[error("{path:?} is {first}{}", more_damage(*.more))]
    NotWhole {
        /// The log.
        path: PathBuf,
        /// What is wrong with it first.
        first: Damage,
        /// How much more is.
        more: usize,
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
    /// Another run reads or writes the file.
    #[error("{path:?} is in use by another run of trackfuse")]
    InUse {
        /// The log or the output.
        path: PathBuf,
    },
    /// A log can't be changed in place; it was not touched.
    #[error("cannot change {path:?} in place: {source}")]
    NotInPlace {
        /// The log.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A run that changed the log in place was cut off.
    #[error("{path:?} is not whole: a run that added to it was cut off")]
    Pending {
        /// The log.
        path: PathBuf,
    },
    /// What a run that was cut off saved of a log can't be put back; nothing was touched.
    #[error("the original can't be put back from {path:?}: {what}; nothing was touched")]
    BadUndo {
        /// What was saved.
        path: PathBuf,
        /// Why.
        what: String,
    },
    /// A log could not be written, nor be made what it was; all that is needed for that lies beside it.
    #[error("cannot write {path:?}, nor put the original back yet: {source}")]
    NotPutBack {
        /// The log.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// There is nothing to take off.
    #[error("{path:?} holds nothing that trackfuse added{}", if *moved { " and left in its place" } else { "" })]
    NothingAdded {
        /// The log.
        path: PathBuf,
        /// Whether it holds an original's end that another program moved.
        moved: bool,
    },
    /// Somebody wanted the program to end; what it was writing was taken back.
    #[error("interrupted while writing {path:?}: it is as it was before")]
    Interrupted {
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
            Self::Open { path, .. } => return nearby::hint(path),
            Self::NotMcap { path, .. } if path.extension().is_some_and(|e| e == "toml") => {
                "the log comes first; a config goes behind `--config`"
            }
            Self::NotMcap { found, .. } if found == EMPTY => "its recording, or its copy, never began",
            Self::NotMcap { .. } => "trackfuse reads MCAP; `mcap convert` makes one of a ROS bag",
            Self::Write { path, source } => return write_hint(path, source),
            Self::CutOff { .. } | Self::Damaged { .. } | Self::BadChunk { .. } => {
                "`trackfuse inspect --verify` names all that is wrong; repair a copy, and keep this one"
            }
            Self::NotWhole { .. } => "without `--strict`, what can be trusted is used, and the rest is named",
            Self::TopicTaken { .. } => {
                "choose another name with `--prefix`, or take off what was added with `trackfuse restore LOG`"
            }
            Self::TooLarge { .. } => "`--memory-limit 4GB`, say, takes larger ones into memory",
            Self::OutputExists { .. } => "`--force` replaces it, `-o` names another",
            Self::OutputIsInput { .. } => {
                "`-o` names another output; `--in-place` adds to the log itself, where a command has it"
            }
            Self::InUse { .. } => "wait until it has ended",
            Self::NotInPlace { .. } => "`-o` writes a new log, and leaves this one as it is",
            Self::Pending { path } | Self::NotPutBack { path, .. } => {
                let log = shell_word(&path.display().to_string());
                return Some(format!(
                    "`trackfuse restore {log}` puts the original back, bit for bit; keep the file \
                     `.trackfuse-undo` beside it until then"
                ));
            }
            Self::BadUndo { .. } => {
                "`trackfuse inspect --verify` on a copy of the log, elsewhere, tells whether the log is whole: then remove \
                 the file; else keep both"
            }
            Self::NothingAdded { moved: true, .. } => {
                "another program rewrote the log: only a log as trackfuse wrote it leads back to the original"
            }
            Self::NothingAdded { .. } => "give the log that `fuse` wrote; a sidecar holds no original",
            _ => return None,
        };
        Some(hint.to_owned())
    }
}

/// What is found of a file without a byte.
pub(super) const EMPTY: &str = "the file is empty";

fn write_hint(path: &Path, source: &io::Error) -> Option<String> {
    let hint = match source.kind() {
        io::ErrorKind::NotFound => {
            return Some(format!(
                "`mkdir -p {}` makes it",
                shell_word(&disk::folder(path).to_string_lossy())
            ));
        }
        io::ErrorKind::IsADirectory => "`-o` names a file",
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "`-o` names an output in a folder that you may write to"
        }
        io::ErrorKind::StorageFull => "free some space, or let `-o` name an output on another disk",
        _ => return None,
    };
    Some(hint.to_owned())
}

fn more_damage(more: usize) -> String {
    if more == 0 { String::new() } else { format!(" (and {more} more)") }
}
