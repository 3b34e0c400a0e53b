//! Which channels are which sensor, and their messages as samples.
//!
//! [`recognise`] makes the same source tables out of topic names that a config would hold; [`load`] reads
//! them, recognised or configured, so that there is one way in.

mod load;
mod reading;
mod recognise;

pub use load::{Loaded, SigmaOrigin, Timing, datum, load};
pub use recognise::{Candidate, Recognised, is_datum_like, recognise};

use crate::log::LogError;
use crate::log::decode::{DecodeError, PathError, PathMiss};

/// Why there are no samples.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// The log can't be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// No topic's name says that it is a sensor.
    #[error("no channel is recognised as a source{}", listed("; these would fit", candidates))]
    Unrecognised {
        /// Channels that could be sources.
        candidates: Vec<Candidate>,
    },
    /// Several channels would do for one source, or several sources for the datum.
    #[error("{what}{}", listed("; these would fit", candidates))]
    Ambiguous {
        /// What can't be decided.
        what: String,
        /// Channels that could be meant.
        candidates: Vec<Candidate>,
    },
    /// A path's text is wrong.
    #[error("source {name:?}: {error}")]
    Path {
        /// The source.
        name: String,
        /// What is wrong with it.
        error: PathError,
    },
    /// The log has no such topic.
    #[error("source {name:?}: topic {topic:?} is not in the log; it has: {}", topics.join(", "))]
    NoTopic {
        /// The source.
        name: String,
        /// The topic.
        topic: String,
        /// The topics that the log has.
        topics: Vec<String>,
    },
    /// A channel can't be decoded.
    #[error("source {name:?}: topic {topic:?}: {error}")]
    Decode {
        /// The source.
        name: String,
        /// The topic.
        topic: String,
        /// Why.
        error: DecodeError,
    },
    /// A path doesn't fit the channel's messages.
    #[error("source {name:?}: {miss}")]
    Miss {
        /// The source.
        name: String,
        /// The step that failed, and what there is.
        miss: PathMiss,
    },
    /// A path leads to something that is no vector.
    #[error(
        "source {name:?}: {path} is {found} in all {count} messages, expected an object with x, y, z or an array \
         of three finite numbers"
    )]
    NoVector {
        /// The source.
        name: String,
        /// The path.
        path: String,
        /// What is there in the first message.
        found: String,
        /// Number of messages.
        count: usize,
    },
    /// Nothing was measured.
    #[error("source {name:?}: the topics {} have no messages", topics.join(", "))]
    Empty {
        /// The source.
        name: String,
        /// The topics.
        topics: Vec<String>,
    },
}

impl SourceError {
    /// What to do about it.
    #[must_use]
    pub fn hint(&self) -> Option<String> {
        let table = |candidates: &[Candidate]| {
            let tables: Vec<String> = candidates
                .iter()
                .take(4)
                .map(|c| {
                    let paths = [("position", &c.position), ("velocity", &c.velocity)];
                    let keys = paths.iter().filter_map(|(k, p)| Some(format!("\n{k} = {:?}", p.as_deref()?)));
                    format!("[[source]]\nname = {:?}{}", c.name(), keys.collect::<String>())
                })
                .collect();
            format!(
                "name the sources, and one of them with `datum = true`, in a config and pass it with `--config`:\n\n{}\n",
                tables.join("\n\n")
            )
        };
        match self {
            Self::Log(error) => error.hint(),
            Self::Unrecognised { candidates } | Self::Ambiguous { candidates, .. } => {
                (!candidates.is_empty()).then(|| table(candidates))
            }
            _ => None,
        }
    }

    /// Whether the user's words, not the log's bytes, are at fault.
    #[must_use]
    pub fn is_usage(&self) -> bool {
        !matches!(self, Self::Log(_) | Self::NoVector { .. } | Self::Empty { .. })
    }
}

fn listed(what: &str, candidates: &[Candidate]) -> String {
    if candidates.is_empty() {
        return String::new();
    }
    let list: Vec<String> = candidates.iter().map(Candidate::to_string).collect();
    format!("{what}: {}", list.join(", "))
}
