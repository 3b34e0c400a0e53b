//! Which channels are which sensor, and their messages as samples.
//!
//! [`judge`] says of every channel whether it could be a source; [`recognise`] makes the same source tables out
//! of the topics' names that a config would hold; [`load`] reads them, recognised or configured, so that there
//! is one way in.

mod candidate;
mod dive;
mod dive_depth;
mod dive_error;
mod dive_ship;
mod events;
mod fix;
mod gathered;
mod glimpse;
mod load;
mod numbers;
mod polar;
mod propose;
mod reading;
mod recognise;
mod recorded;
mod topic;
mod usbl;

pub use candidate::{Candidate, Judged, Judgement, Unfit, judge};
pub use dive::{DiveSamples, load_dive};
pub use dive_error::{DiveError, Span};
pub use events::{RecordedEvent, recorded_events};
pub use glimpse::{Glimpse, glimpse};
pub(crate) use load::DIFFERENT_EPOCHS_S;
pub use load::{Loaded, Samples, SigmaOrigin, Timing, datum, load};
pub use propose::{Proposal, propose, propose_chosen};
pub use recognise::{Choice, Recognised, choices_of, recognise};
pub use recorded::{Recorded, recorded, reference, usual_track};
pub use topic::is_datum_like;
pub use usbl::usbl_fix;

use std::path::Path;

use crate::config::TimeChoice;
use crate::log::LogError;
use crate::log::decode::{DecodeError, PathError, PathMiss};
use crate::printable::{printable, shell_word, toml_string};
use crate::time::Time;

/// Why there are no samples.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// The log can't be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// No topic's name says that it is a sensor.
    #[error(
        "no channel is recognised as a source{}{}", listed("; these would fit: ", candidates),
        if candidates.is_empty() { listed_unusable(unusable) } else { String::new() }
    )]
    Unrecognised {
        /// The log.
        log: String,
        /// Channels that could be sources.
        candidates: Vec<Candidate>,
        /// All other topics, and why they can't be.
        unusable: Vec<(String, String)>,
    },
    /// Several channels would do for one source, or several sources for the datum.
    #[error("{}{}", ambiguity.what, listed("; these would fit: ", &ambiguity.candidates))]
    Ambiguous {
        /// Between what.
        ambiguity: Box<Ambiguity>,
    },
    /// No topic, or several, of a USBL system.
    #[error(
        "{}{}",
        if *several { "several topics look like a USBL system's fixes" } else { "no topic with a position has `usbl` in its name" },
        listed(if *several { ": " } else { "; these would fit: " }, candidates)
    )]
    NoUsbl {
        /// Whether there are several.
        several: bool,
        /// Those, or all topics that hold a position.
        candidates: Vec<Candidate>,
    },
    /// What was measured of a dive doesn't fit together.
    #[error(transparent)]
    Dive(#[from] DiveError),
    /// A path leads to something that is no number.
    #[error("source {name:?}: {} is no finite number in any of {count} messages", printable(path))]
    NoNumber {
        /// The source.
        name: String,
        /// The path.
        path: String,
        /// Number of messages.
        count: usize,
    },
    /// A velocity in the body frame, with nothing to turn it by.
    #[error(
        "source {name:?}: {} is in the body frame, but its messages hold no orientation (a unit quaternion) beside a \
         position to turn it by",
        printable(path)
    )]
    NoOrientation {
        /// The source.
        name: String,
        /// The velocity's path.
        path: String,
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
    #[error("{}topic {topic:?} is not in the log; it has: {}", of_source(name, topic), some_of(topics))]
    NoTopic {
        /// The source.
        name: String,
        /// The topic.
        topic: String,
        /// The topics that the log has.
        topics: Vec<String>,
    },
    /// Nothing of a topic can be read, since the log is damaged where it stands.
    #[error(
        "source {name:?}: no message of topic {topic:?} can be read; {parts} parts of the log can't: {first}"
    )]
    Unreadable {
        /// The source.
        name: String,
        /// The topic.
        topic: String,
        /// How many parts of the log can't be read.
        parts: usize,
        /// What is wrong with the first of them.
        first: String,
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
    #[error("source {name:?}: {}", printable(&miss.to_string()))]
    Miss {
        /// The source.
        name: String,
        /// The step that failed, and what there is.
        miss: PathMiss,
    },
    /// A path leads to something that is no vector.
    #[error(
        "source {name:?}: {} is {found} in all {count} messages, expected an object with x, y, z or an array of \
         three finite numbers",
        printable(path)
    )]
    NoVector {
        /// The source.
        name: String,
        /// The path.
        path: String,
        /// What is there in the first message.
        found: &'static str,
        /// Paths from there on that lead to a vector.
        fits: Vec<String>,
        /// Whether it is a velocity, which the source can do without.
        spare: bool,
        /// Number of messages.
        count: usize,
    },
    /// No message has a time.
    #[error("source {name:?}: none of {count} messages has a usable time{}", asked_for(*choice))]
    NoTime {
        /// The source.
        name: String,
        /// The clock that the config asks for.
        choice: Option<TimeChoice>,
        /// Number of messages.
        count: usize,
    },
    /// All samples have the same time.
    #[error("source {name:?}: all {count} samples are of one instant, {time}, expected a time each")]
    OneInstant {
        /// The source.
        name: String,
        /// That instant.
        time: Time,
        /// Number of samples.
        count: usize,
    },
    /// A topic's messages hold no vector where the usual messages keep one.
    #[error("topic {topic:?}: no {what} where the usual messages keep one, in {}", printable(found))]
    NoVectors {
        /// The topic.
        topic: String,
        /// What was looked for.
        what: &'static str,
        /// What its messages hold.
        found: String,
    },
    /// Two topics that are to be one source, but are not a position and a velocity.
    #[error(
        "{} and {} are not one source: expected a topic with a position and one with a velocity",
        candidates[0], candidates[1]
    )]
    NoPair {
        /// What the topics hold.
        candidates: Box<[Candidate; 2]>,
    },
    /// Two of what there can be one of.
    #[error(
        "the {what} of the reference is given twice, by {} and by {}; expected one",
        printable(&paths[0]), printable(&paths[1])
    )]
    GivenTwice {
        /// Position or velocity.
        what: &'static str,
        /// The message paths.
        paths: [String; 2],
    },
    /// Nothing was measured.
    #[error("source {name:?}: topic {topic:?} has no messages that its path lets through")]
    Empty {
        /// The source.
        name: String,
        /// The topic.
        topic: String,
    },
}

/// Sensors of which it is not clear what to take.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ambiguity {
    /// The log.
    pub log: String,
    /// What can't be decided.
    pub what: String,
    /// Channels that could be meant.
    pub candidates: Vec<Candidate>,
    /// Other channels that would fit.
    pub unused: Vec<Candidate>,
    /// All recognised sources as a config would name them.
    pub choices: Vec<Choice>,
}

impl SourceError {
    /// What to do about it.
    #[must_use]
    pub fn hint(&self) -> Option<String> {
        let hint = match self {
            Self::Log(error) => return error.hint(),
            Self::Unrecognised { log, candidates, .. } if !candidates.is_empty() => choose_hint(log),
            Self::Ambiguous { ambiguity } => choose_hint(&ambiguity.log),
            Self::NoTopic { topic, topics, .. } => {
                if let Some(nearest) = nearest(topic, topics) {
                    return Some(format!("did you mean {nearest:?}?"));
                }
                if topic != "/fused/track" {
                    return None;
                }
                "`trackfuse fuse LOG` writes it: give the log that it wrote, or name another topic".into()
            }
            Self::Miss { miss: PathMiss::Field { field, available, .. }, .. } => {
                format!("did you mean `{}`?", printable(nearest(field, available)?))
            }
            Self::NoUsbl { candidates, .. } => {
                let path = candidates.iter().find_map(|c| c.position.clone());
                let path = toml_string(&path.unwrap_or_else(|| "/topic.field".into()));
                format!("`[usbl]` with `fix = {path}` in a config names the fixes: `--config`")
            }
            Self::Dive(error) => error.hint(),
            Self::NoOrientation { .. } => {
                "`velocity_frame = \"world\"` in this source says that nothing need be turned".into()
            }
            Self::NoVector { fits, .. } if !fits.is_empty() => {
                let fits: Vec<_> = fits.iter().map(|path| format!("`{}`", printable(path))).collect();
                format!("a vector stands at {}", fits.join(", "))
            }
            Self::NoVector { spare: true, .. } => {
                "leave `velocity` out of this source's table in the config to do without it".into()
            }
            Self::NoVectors { topic, what, .. } => {
                format!("name the {what} by its message path: `{}.field`", printable(topic))
            }
            Self::NoTime { .. } | Self::OneInstant { .. } => {
                "`time = \"publish\"` or `time = \"log\"` in this source, of `trackfuse usbl` in `[usbl]`, takes another clock; for a \
                 reference, `--reference-time`"
                    .into()
            }
            _ => return None,
        };
        Some(hint)
    }

    /// Whether the user's words, not the log's bytes, are at fault.
    #[must_use]
    pub fn is_usage(&self) -> bool {
        match self {
            Self::NoVector { fits, .. } => !fits.is_empty(),
            Self::Log(_)
            | Self::Unreadable { .. }
            | Self::Empty { .. }
            | Self::NoTime { .. }
            | Self::OneInstant { .. } => false,
            _ => true,
        }
    }
}

/// The name that is so near to `asked` that it was meant.
fn nearest<'a>(asked: &str, known: &'a [String]) -> Option<&'a str> {
    let near = known.iter().map(|name| (strsim::jaro_winkler(asked, name), name));
    let (score, name) = near.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (score > 0.8).then_some(name)
}

/// Which source is spoken of, unless it has no other name than the topic.
fn of_source(name: &str, topic: &str) -> String {
    if name == topic { String::new() } else { format!("source {name:?}: ") }
}

fn choose_hint(log: &str) -> String {
    let init = init_line(Path::new(log));
    format!(
        "`{init}` writes a config that lists them: choose there, and pass it with `--config`; with `--source TOPIC` for \
         each, the datum first, it is chosen at once"
    )
}

/// The command that writes a config for a log, beside it.
#[must_use]
pub fn init_line(log: &Path) -> String {
    let [log, config] =
        [log.to_owned(), log.with_extension("toml")].map(|p| shell_word(&p.to_string_lossy()));
    format!("trackfuse init {log} -o {config}")
}

fn listed(what: &str, candidates: &[Candidate]) -> String {
    if candidates.is_empty() {
        return String::new();
    }
    let list: Vec<String> = candidates.iter().map(Candidate::to_string).collect();
    format!("{what}{}", list.join(", "))
}

fn listed_unusable(unusable: &[(String, String)]) -> String {
    const SHOWN: usize = 12;
    if unusable.is_empty() {
        return ": the log has no channels".into();
    }
    let mut lines: Vec<String> =
        unusable.iter().take(SHOWN).map(|(topic, why)| format!("{topic:?}: {}", printable(why))).collect();
    if unusable.len() > SHOWN {
        lines.push(format!("and {} more", unusable.len() - SHOWN));
    }
    format!("; no channel would fit:\n  {}", lines.join("\n  "))
}

/// The first topics of many.
fn some_of(topics: &[String]) -> String {
    const SHOWN: usize = 40;
    let mut shown: Vec<String> = topics.iter().take(SHOWN).map(|t| printable(t).into_owned()).collect();
    if topics.len() > SHOWN {
        shown.push(format!("and {} more", topics.len() - SHOWN));
    }
    shown.join(", ")
}

fn asked_for(choice: Option<TimeChoice>) -> &'static str {
    match choice {
        Some(TimeChoice::Stamp) => ", as `time = \"stamp\"` asks for",
        Some(TimeChoice::Publish) => ", as `time = \"publish\"` asks for",
        Some(TimeChoice::Log) => ", as `time = \"log\"` asks for",
        None => "",
    }
}
