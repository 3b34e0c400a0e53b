//! Sources recognised by their topics' names: a sensor's word in the name, a position or velocity in the
//! message. What is not clear is not guessed.

use std::collections::{BTreeMap, BTreeSet};

use super::candidate::{Candidate, Judged, Judgement, judge};
use super::topic::{is_datum_like, is_reference, sensor_word};
use super::{Ambiguity, SourceError, Unfit};
use crate::config::SourceConfig;
use crate::log::{Log, LogError, passed_over};
use crate::printable::printable;

/// What a log's topics say.
#[derive(Debug, Default)]
pub struct Recognised {
    /// The sources, as a config would name them; the datum first.
    pub sources: Vec<SourceConfig>,
    /// Channels that would fit, but whose names don't say that they are a sensor.
    pub unused: Vec<Candidate>,
    /// Sensors that can't be read, a sentence each.
    pub warnings: Vec<String>,
    /// What could not be read of the parts that were looked into.
    pub damaged: Vec<LogError>,
}

/// A source as a person may choose it: of several paths one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Choice {
    /// What to call it.
    pub name: String,
    /// Paths of its position.
    pub positions: Vec<String>,
    /// Paths of its velocity.
    pub velocities: Vec<String>,
}

/// Recognises the sources of a log.
///
/// Channels that this program wrote are passed over, and so are parts of the log that are damaged.
///
/// # Errors
/// [`SourceError::Unrecognised`] where no topic holds a sensor's word, [`SourceError::Ambiguous`] where
/// several channels offer the same for one sensor, or several sensors could be the datum;
/// [`SourceError::Log`] instead where a part of the log that was looked into is damaged, and where nothing can be read
/// of a sensor: without it another would become the datum.
pub fn recognise(log: &Log) -> Result<Recognised, SourceError> {
    let mut judgement = judge(log);
    let lost = |channel: &Judged| {
        let topic = &channel.topic;
        channel.verdict == Err(Unfit::Unreadable) && sensor_word(topic).is_some() && !is_reference(topic)
    };
    match judgement.sources() {
        Ok(mut recognised) if !judgement.channels.iter().any(lost) => {
            recognised.warnings.splice(..0, passed_over(&judgement.damaged));
            recognised.damaged = judgement.damaged;
            Ok(recognised)
        }
        // What was not found may be what can't be read.
        _ if !judgement.damaged.is_empty() => Err(judgement.damaged.swap_remove(0).into()),
        other => other,
    }
}

/// Candidates as a config would name them: each by its topic's first part, and a number where that is taken.
#[must_use]
pub fn choices_of(candidates: &[Candidate]) -> Vec<Choice> {
    let mut choices: Vec<Choice> = Vec::new();
    for candidate in candidates {
        let first = candidate.topic.split('/').find(|part| !part.is_empty()).unwrap_or("source");
        let numbered = (2..).map(|n| format!("{first}-{n}"));
        let mut names = std::iter::once(first.to_owned()).chain(numbered);
        let name = names.find(|name| choices.iter().all(|c| c.name != *name)).unwrap_or_default();
        let (positions, velocities) =
            (candidate.position.iter().cloned().collect(), candidate.velocity.iter().cloned().collect());
        choices.push(Choice { name, positions, velocities });
    }
    choices
}

impl Judgement {
    /// The candidates, and all other topics with why they can't be sources, each by topic.
    fn by_topic(&self) -> (Vec<Candidate>, BTreeMap<&str, &Unfit>) {
        let (mut fit, mut unfit) = (BTreeMap::new(), BTreeMap::new());
        for channel in &self.channels {
            match &channel.verdict {
                Ok(candidate) => drop(fit.entry(channel.topic.as_str()).or_insert(candidate)),
                Err(why) => drop(unfit.entry(channel.topic.as_str()).or_insert(why)),
            }
        }
        unfit.retain(|topic, _| !fit.contains_key(topic));
        (fit.into_values().cloned().collect(), unfit)
    }

    /// The sources that the topics' names tell.
    ///
    /// # Errors
    /// [`SourceError::Unrecognised`] and [`SourceError::Ambiguous`], as [`recognise`].
    pub fn sources(&self) -> Result<Recognised, SourceError> {
        let (all, unusable) = self.by_topic();
        let (sensors, unused): (Vec<_>, Vec<_>) =
            all.into_iter().partition(|c| sensor_word(&c.topic).is_some());
        let mut groups: BTreeMap<(String, String), Vec<&Candidate>> = BTreeMap::new();
        for candidate in &sensors {
            groups.entry(sensor_word(&candidate.topic).unwrap_or_default()).or_default().push(candidate);
        }
        if groups.is_empty() {
            let unusable = unusable.iter().map(|(topic, why)| ((*topic).to_owned(), why.to_string()));
            let (log, candidates, unusable) = (self.log.clone(), unused, unusable.collect());
            return Err(SourceError::Unrecognised { log, candidates, unusable });
        }
        let mut choices: Vec<Choice> = Vec::new();
        for ((before, word), members) in &groups {
            let unique = choices.iter().all(|c| c.name != *word);
            choices.push(Choice {
                name: if unique { word.clone() } else { format!("{before}{word}") },
                positions: members.iter().filter_map(|c| c.position.clone()).collect(),
                velocities: members.iter().filter_map(|c| c.velocity.clone()).collect(),
            });
        }
        let datum = match datum_among(&choices) {
            Ok(datum) => datum,
            Err(what) => {
                let (log, candidates) = (self.log.clone(), sensors.clone());
                let ambiguity = Box::new(Ambiguity { log, what, candidates, unused, choices });
                return Err(SourceError::Ambiguous { ambiguity });
            }
        };
        let mut sources: Vec<SourceConfig> = choices.iter().map(source_of).collect();
        sources[..=datum].rotate_right(1);
        sources[0].datum = true;
        let read: BTreeSet<&(String, String)> = groups.keys().collect();
        let warnings = unusable
            .iter()
            .filter(|(topic, _)| {
                sensor_word(topic).is_some_and(|word| !read.contains(&word)) && !is_reference(topic)
            })
            .map(|(topic, why)| format!("{} looks like a sensor's and is not used: {why}", printable(topic)))
            .collect();
        Ok(Recognised { sources, unused, warnings, damaged: Vec::new() })
    }
}

/// Which of the choices is the datum, or what is not clear.
fn datum_among(choices: &[Choice]) -> Result<usize, String> {
    for choice in choices {
        let several = [("position", choice.positions.len()), ("velocity", choice.velocities.len())];
        if let Some((what, _)) = several.iter().find(|(_, count)| *count > 1) {
            return Err(format!("several channels hold a {what} of {}", printable(&choice.name)));
        }
    }
    let datums: Vec<usize> = (0..choices.len()).filter(|&i| is_datum_like(&choices[i].name)).collect();
    match (datums.as_slice(), choices.len()) {
        (&[datum], _) => Ok(datum),
        (_, 1) => Ok(0),
        _ => {
            Err("it is not clear which source is the datum, whose bias and clock are zero by definition"
                .into())
        }
    }
}

/// A choice as a source, of several paths the first.
pub(super) fn source_of(choice: &Choice) -> SourceConfig {
    SourceConfig {
        name: choice.name.clone(),
        position: choice.positions.first().cloned(),
        velocity: choice.velocities.first().cloned(),
        ..SourceConfig::default()
    }
}
