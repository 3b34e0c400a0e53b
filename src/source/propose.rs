//! A log's sources as a config proposes them to a person.

use std::collections::BTreeSet;

use super::candidate::of_topic;
use super::recognise::source_of;
use super::topic::sensor_words;
use super::{
    Ambiguity, Candidate, Recognised, Samples, SourceError, choices_of, datum, glimpse, is_datum_like, load,
    recognise,
};
use crate::config::{SourceConfig, SourceTable};
use crate::log::Log;
use crate::printable::printable;

/// Above a source that a person must choose.
const CHOOSE: &str = "To be chosen by a person: take the # away from the keys of what sees the vehicle.";

/// What a config says of a log's sources.
#[derive(Clone, Debug, PartialEq)]
pub struct Proposal {
    /// The tables: sources, then what could be sources, as comments.
    pub tables: Vec<SourceTable>,
    /// What a person must decide before the config names a source.
    pub undecided: Option<String>,
    /// What a person must read.
    pub warnings: Vec<String>,
}

/// How much of the log is looked at to see whether the sources hold what they seem to hold.
const BUDGET_BYTES: u64 = 64 << 20;

/// The sources that `fuse` takes without a config, as tables that make it take the same.
///
/// # Errors
/// [`SourceError`] where the log can't be read.
pub fn propose(log: &Log) -> Result<Proposal, SourceError> {
    let recognised = match recognise(log) {
        Ok(recognised) => recognised,
        Err(SourceError::Unrecognised { candidates, .. }) => {
            let what = if candidates.is_empty() {
                "no channel holds a position or velocity that can be read"
            } else {
                "no topic's name says that it is a sensor's"
            };
            return Ok(Proposal::to_choose(what.into(), &candidates));
        }
        Err(SourceError::Ambiguous { ambiguity }) => {
            let Ambiguity { what, choices, unused, .. } = *ambiguity;
            let likely = choices.iter().position(|c| is_datum_like(&c.name)).unwrap_or(0);
            let mut proposal = Proposal::to_choose(what, &unused);
            let tables = choices.into_iter().enumerate().map(|(i, choice)| SourceTable {
                name: choice.name,
                positions: choice.positions,
                velocities: choice.velocities,
                datum: i == likely,
                commented: true,
                remarks: Vec::new(),
            });
            let mut tables: Vec<SourceTable> = tables.collect();
            tables.append(&mut proposal.tables);
            proposal.tables = tables;
            remark(&mut proposal.tables, CHOOSE);
            return Ok(proposal);
        }
        Err(other) => return Err(other),
    };
    checked(log, &recognised)
}

/// The sources that a person chose, the datum first: each a topic, or two with a comma between them, of which one
/// holds its position and the other its velocity. Topics whose names say so are of one sensor too: see `paired`.
///
/// # Errors
/// [`SourceError::NoTopic`], [`SourceError::Decode`], [`SourceError::NoVectors`] for a topic that can't be one;
/// [`SourceError::Log`].
pub fn propose_chosen(log: &Log, topics: &[String]) -> Result<Proposal, SourceError> {
    let mut candidates = Vec::new();
    for text in topics {
        let of_log = |topic: &str| log.index().channels_of(topic).next().is_some();
        candidates.push(match text.split_once(',') {
            Some((first, second)) if !of_log(text) => both(of_topic(log, first)?, of_topic(log, second)?)?,
            _ => of_topic(log, text)?,
        });
    }
    let candidates = paired(candidates);
    let mut sources: Vec<SourceConfig> = choices_of(&candidates).iter().map(source_of).collect();
    if let Some(first) = sources.first_mut() {
        first.datum = true;
    }
    checked(log, &Recognised { sources, ..Recognised::default() })
}

/// One source of two topics.
fn both(first: Candidate, second: Candidate) -> Result<Candidate, SourceError> {
    let joined = joined(&first, &second).or_else(|| joined(&second, &first));
    joined.ok_or_else(|| SourceError::NoPair { candidates: [first, second].into() })
}

/// The position of `of_position` with the velocity of `of_velocity`: what else they hold is not used.
fn joined(of_position: &Candidate, of_velocity: &Candidate) -> Option<Candidate> {
    let (position, velocity) = (of_position.position.clone()?, of_velocity.velocity.clone()?);
    Some(Candidate { topic: of_position.topic.clone(), position: Some(position), velocity: Some(velocity) })
}

/// A topic that holds a position alone and one that holds a velocity alone are one source where their names differ in
/// nothing but what they measure, as `/gps/pose` and `/gps/twist` do, and no third one's name is the same.
fn paired(candidates: Vec<Candidate>) -> Vec<Candidate> {
    let mut sensors: Vec<(BTreeSet<String>, Vec<Candidate>)> = Vec::new();
    for candidate in candidates {
        let words = sensor_words(&candidate.topic);
        match sensors.iter_mut().find(|(known, _)| !words.is_empty() && *known == words) {
            Some((_, topics)) => topics.push(candidate),
            None => sensors.push((words, vec![candidate])),
        }
    }
    let one_each = |(_, topics): (_, Vec<Candidate>)| match topics.as_slice() {
        [a, b] if [a, b].iter().all(|c| c.position.is_none() || c.velocity.is_none()) => {
            joined(a, b).or_else(|| joined(b, a)).map_or(topics, |one| vec![one])
        }
        _ => topics,
    };
    sensors.into_iter().flat_map(one_each).collect()
}

/// The sources with what stands against them.
fn checked(log: &Log, recognised: &Recognised) -> Result<Proposal, SourceError> {
    match kept(log, &recognised.sources) {
        Ok((sources, left_out)) => Ok(Proposal::of(recognised, &sources, left_out)),
        Err(error @ SourceError::Log(_)) => Err(error),
        // What stands against one of the sources stands against `fuse` without a config too.
        Err(error) => {
            let mut proposal = Proposal::of(recognised, &recognised.sources, Vec::new());
            proposal.tables.iter_mut().for_each(|table| table.commented = true);
            proposal.undecided = Some(error.to_string());
            Ok(proposal)
        }
    }
}

/// The sources less what `fuse` leaves out of them, with a sentence on each. Reads all their messages only where
/// a look at some does not show that they hold everything.
fn kept(log: &Log, sources: &[SourceConfig]) -> Result<(Vec<SourceConfig>, Vec<String>), SourceError> {
    let (glimpses, excerpt) = glimpse(log, sources, BUDGET_BYTES);
    if excerpt.damaged.is_empty() && glimpses.iter().all(|g| g.lacks.is_empty()) {
        return Ok((sources.to_vec(), Vec::new()));
    }
    let Samples { loaded, left_out, .. } = load(log, sources, false, None)?;
    let mut kept: Vec<SourceConfig> = loaded.into_iter().map(|l| l.config).collect();
    let datum = datum(&kept);
    if let Some(source) = kept.get_mut(datum) {
        source.datum = true;
    }
    Ok((kept, left_out))
}

impl Proposal {
    /// Sources that are clear, and other channels that would fit.
    fn of(recognised: &Recognised, sources: &[SourceConfig], left_out: Vec<String>) -> Self {
        let sources = sources.iter().map(|source| SourceTable {
            name: source.name.clone(),
            positions: source.position.iter().cloned().collect(),
            velocities: source.velocity.iter().cloned().collect(),
            datum: source.datum,
            ..SourceTable::default()
        });
        let mut tables: Vec<SourceTable> = sources.collect();
        let names: BTreeSet<String> = tables.iter().map(|t| t.name.clone()).collect();
        let mut others = to_choose(&recognised.unused, &names);
        remark(
            &mut others,
            "These hold positions or velocities too; their names don't say that they are a sensor's.",
        );
        tables.append(&mut others);
        let warnings = recognised.warnings.iter().cloned().chain(left_out).collect();
        Self { tables, undecided: None, warnings }
    }

    /// Channels of which a person must choose.
    fn to_choose(what: String, candidates: &[Candidate]) -> Self {
        let mut tables = to_choose(candidates, &BTreeSet::new());
        remark(&mut tables, CHOOSE);
        let likely = tables.iter().position(|t| is_datum_like(&t.name)).unwrap_or(0);
        if let Some(table) = tables.get_mut(likely) {
            table.datum = true;
        }
        Self { tables, undecided: Some(what), warnings: Vec::new() }
    }

    /// All that a person must read.
    #[must_use]
    pub fn all_warnings(&self) -> Vec<String> {
        let undecided = self.undecided.as_ref().map(|what| {
            format!(
                "the config names no source yet, and `fuse` refuses it until it does: {}",
                printable(what)
            )
        });
        undecided.into_iter().chain(self.warnings.iter().cloned()).collect()
    }
}

/// Candidates as comments, under names that are not taken.
fn to_choose(candidates: &[Candidate], taken: &BTreeSet<String>) -> Vec<SourceTable> {
    let choices = choices_of(candidates).into_iter().map(|choice| SourceTable {
        name: if taken.contains(&choice.name) { format!("{} (other)", choice.name) } else { choice.name },
        positions: choice.positions,
        velocities: choice.velocities,
        commented: true,
        ..SourceTable::default()
    });
    choices.collect()
}

fn remark(tables: &mut [SourceTable], text: &str) {
    if let Some(first) = tables.first_mut() {
        first.remarks = vec![text.to_owned()];
    }
}
