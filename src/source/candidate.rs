//! Channel by channel: whether it could be a source, with the paths into its messages, or why it can't.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use super::SourceError;
use super::fix::fix;
use super::polar::is_polar;
use super::recorded::config_of;
use super::topic::{is_reference, sensor_word, vector_is};
use crate::log::decode::{Decoder, MessagePath, Value};
use crate::log::{Channel, Index, Log, LogError};
use crate::printable::printable;
use crate::sample::Quantity;

/// Schemas of an earlier run's results, known even where its metadata record is lost.
const OWN_SCHEMAS: [&str; 7] = [
    "trackfuse.TrackPoint",
    "trackfuse.CharacteristicPoint",
    "trackfuse.Residual",
    "trackfuse.UsblFix",
    "trackfuse_msgs/msg/CharacteristicPoint",
    "trackfuse_msgs/msg/Residual",
    "trackfuse_msgs/msg/UsblFix",
];

/// What the topics of every run are called below its prefix.
const OWN_NAMES: [&str; 5] = ["track", "scene", "pose", "log", "path"];

/// What those of `fuse` are called besides, and what where it knows latitudes.
const FUSED_NAMES: [&str; 3] = ["pcf", "events", "residuals"];
const FUSED_PLACES: [&str; 2] = ["fix", "geojson"];

/// The same of `usbl`, which leaves `fix` to the sensor.
const USBL_NAMES: [&str; 2] = ["prediction", "fixes"];
const USBL_PLACES: [&str; 2] = ["track_fix", "geojson"];

/// Where the usual messages keep a position, the most specific first.
const POSITION_FIELDS: [&str; 6] =
    ["pose.pose.position", "pose.position", "transform.translation", "position", "point", "vector"];

/// Where they keep a velocity.
const VELOCITY_FIELDS: [&str; 5] =
    ["twist.twist.linear", "twist.linear", "linear_velocity", "velocity", "vector"];

/// A channel that could be a source, or a part of one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Candidate {
    /// Its topic.
    pub topic: String,
    /// Message path of its position.
    pub position: Option<String>,
    /// Message path of its velocity.
    pub velocity: Option<String>,
}

impl fmt::Display for Candidate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match (&self.position, &self.velocity) {
            (Some(_), Some(_)) => "position and velocity",
            (Some(_), None) => "position",
            _ => "velocity",
        };
        write!(f, "{} ({what})", printable(&self.topic))
    }
}

/// Why a channel can't be a source.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unfit {
    /// This program made it.
    #[error("written by trackfuse")]
    Own,
    /// It is there to judge a track by.
    #[error("by its name a reference, which a track is judged by")]
    Reference,
    /// Its messages can't be decoded.
    #[error("{0}")]
    Undecodable(String),
    /// It has no messages.
    #[error("no messages")]
    Silent,
    /// No message of it was found, and parts of the log can't be read.
    #[error("no message of it can be read: parts of the log can't be")]
    Unreadable,
    /// It is seen from a ship, which `trackfuse usbl` can place.
    #[error(
        "range, bearing and depression: `trackfuse usbl` takes them, with the ship's position and heading"
    )]
    Polar,
    /// Its messages hold no vector where one is looked for; the names of their first fields.
    #[error("no position or velocity in {0}")]
    NoVector(String),
}

/// A channel and what it is fit for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Judged {
    /// The channel's id.
    pub id: u16,
    /// Its topic.
    pub topic: String,
    /// Where it could be a source, how; else why not.
    pub verdict: Result<Candidate, Unfit>,
}

/// All channels of a log, by id.
#[derive(Debug)]
pub struct Judgement {
    /// Where the log is.
    pub(super) log: String,
    /// The channels.
    pub channels: Vec<Judged>,
    /// Parts of the log that could not be read.
    pub damaged: Vec<LogError>,
}

/// Judges every channel of a log by its name and its first message.
///
/// Those that this program wrote can't be sources.
#[must_use]
pub fn judge(log: &Log) -> Judgement {
    let index = log.index();
    let own = own_topics(log);
    let (mut decoders, mut verdicts) = (BTreeMap::new(), BTreeMap::new());
    let silent = silent(index);
    for channel in index.channels.values() {
        let schema = index.schema_of(channel);
        let (encoding, name, data) =
            schema.map_or(("", "", &[][..]), |s| (s.encoding.as_str(), s.name.as_str(), s.data.as_slice()));
        let unfit = if own.contains(&channel.topic) {
            Unfit::Own
        } else if is_reference(&channel.topic) {
            Unfit::Reference
        } else if silent.contains(&channel.id) {
            Unfit::Silent
        } else {
            match Decoder::new(&channel.message_encoding, encoding, name, data) {
                Ok(decoder) => {
                    decoders.insert(channel.id, decoder);
                    continue;
                }
                Err(error) => Unfit::Undecodable(error.to_string()),
            }
        };
        verdicts.insert(channel.id, Err(unfit));
    }
    let (first, damaged) = log.first_messages(&decoders.keys().copied().collect::<BTreeSet<_>>());
    for (id, decoder) in decoders {
        let verdict = match first.get(&id).map(|message| decoder.decode(&message.data)) {
            None if damaged.is_empty() => Err(Unfit::Silent),
            None => Err(Unfit::Unreadable),
            Some(Err(error)) => Err(Unfit::Undecodable(error.to_string())),
            Some(Ok(value)) => fit(&index.channels[&id].topic, &value),
        };
        verdicts.insert(id, verdict);
    }
    let channels = verdicts
        .into_iter()
        .map(|(id, verdict)| Judged { id, topic: index.channels[&id].topic.clone(), verdict })
        .collect();
    Judgement { log: log.path().display().to_string(), channels, damaged }
}

/// The topics of earlier runs as their metadata records tell them, and where those are lost their schemas.
fn own_topics(log: &Log) -> BTreeSet<String> {
    let index = log.index();
    let own_schema = |c: &Channel| {
        let name = index.schema_of(c).map(|s| s.name.as_str());
        name.filter(|name| OWN_SCHEMAS.contains(name))
    };
    let prefix_of = |topic: &str| topic.rsplit_once('/').map(|(prefix, _)| prefix.to_owned());
    let schemas: Vec<(&str, &str)> =
        index.channels.values().filter_map(|c| Some((c.topic.as_str(), own_schema(c)?))).collect();
    let recorded = index.metadata.iter().filter_map(|m| m.name.strip_prefix("trackfuse:"));
    let prefixes: BTreeSet<String> =
        recorded.map(str::to_owned).chain(schemas.iter().filter_map(|(topic, _)| prefix_of(topic))).collect();
    let below = |prefix: &String| {
        let judges_fixes = |(topic, schema): &(&str, &str)| {
            schema.ends_with("UsblFix") && prefix_of(topic).as_ref() == Some(prefix)
        };
        let record = log.metadata(&format!("trackfuse:{prefix}")).ok().flatten();
        let is_usbl = match record.as_ref().and_then(|record| record.get("command")) {
            Some(command) => command == "usbl",
            None => schemas.iter().any(judges_fixes),
        };
        let has_places = record.is_none_or(|record| config_of(&record).output.origin.is_some());
        let (names, places): (&[&str], &[&str]) =
            if is_usbl { (&USBL_NAMES, &USBL_PLACES) } else { (&FUSED_NAMES, &FUSED_PLACES) };
        let places = places.iter().filter(|_| has_places);
        let names = OWN_NAMES.iter().chain(names).chain(places);
        names.map(|name| format!("{prefix}/{name}")).collect::<Vec<_>>()
    };
    let own = prefixes.iter().flat_map(below);
    own.chain(schemas.iter().map(|(topic, _)| (*topic).to_owned())).collect()
}

/// What a topic of the log holds by its first message, whatever its name.
///
/// # Errors
/// [`SourceError::NoTopic`]; [`SourceError::Empty`]; [`SourceError::Decode`]; [`SourceError::NoVectors`] where it
/// holds neither a position nor a velocity.
pub(super) fn of_topic(log: &Log, topic: &str) -> Result<Candidate, SourceError> {
    let (index, name) = (log.index(), topic.to_owned());
    let topic = name.clone();
    let Some(channel) = index.channels_of(&topic).next() else {
        let topics: BTreeSet<String> = index.channels.values().map(|c| c.topic.clone()).collect();
        return Err(SourceError::NoTopic { name, topic, topics: topics.into_iter().collect() });
    };
    let schema = index.schema_of(channel);
    let (encoding, schema_name, data) =
        schema.map_or(("", "", &[][..]), |s| (s.encoding.as_str(), s.name.as_str(), s.data.as_slice()));
    let (first, damaged) = log.first_messages(&[channel.id].into());
    let Some(message) = first.get(&channel.id) else {
        return Err(damaged.into_iter().next().map_or(SourceError::Empty { name, topic }, SourceError::Log));
    };
    let decoded = Decoder::new(&channel.message_encoding, encoding, schema_name, data)
        .and_then(|decoder| decoder.decode(&message.data));
    let value = decoded.map_err(|error| SourceError::Decode { name, topic: topic.clone(), error })?;
    let nothing = |_| SourceError::NoVectors {
        topic: topic.clone(),
        what: "position or velocity",
        found: fields_of(&value),
    };
    fit(&topic, &value).map_err(nothing)
}

/// Channels that have no messages, as far as the statistics tell: looking for one would read the whole log.
fn silent(index: &Index) -> BTreeSet<u16> {
    let Some(statistics) = &index.statistics else { return BTreeSet::new() };
    let counts = &statistics.channel_message_counts;
    let sum = counts.values().try_fold(0_u64, |sum, count| sum.checked_add(*count));
    if sum != Some(statistics.message_count) {
        return BTreeSet::new();
    }
    let none = |id: &u16| counts.get(id).is_none_or(|count| *count == 0);
    index.channels.keys().copied().filter(none).collect()
}

/// The vectors of a topic's first message.
fn fit(topic: &str, message: &Value) -> Result<Candidate, Unfit> {
    let path_of = |quantity: Quantity| {
        let fields: &[&str] = match quantity {
            Quantity::Position => &POSITION_FIELDS,
            Quantity::Velocity => &VELOCITY_FIELDS,
        };
        let named = |f: &str| f != "vector" || vector_is(topic, quantity);
        let fits = |f: &&&str| vector_at(message, f) && named(f);
        // a sensor may begin before it has anything to say
        let may_fit = |f: &&&str| sensor_word(topic).is_some() && absent_at(message, f) && named(f);
        let found = fields.iter().find(fits).or_else(|| fields.iter().find(may_fit));
        found.map(|f| format!("{}.{f}", quoted(topic)))
    };
    // the message itself is a latitude, longitude and altitude
    let place = || fix(message).map(|_| quoted(topic));
    let (position, velocity) = (path_of(Quantity::Position).or_else(place), path_of(Quantity::Velocity));
    if position.is_some() || velocity.is_some() {
        Ok(Candidate { topic: topic.to_owned(), position, velocity })
    } else if is_polar(message) {
        Err(Unfit::Polar)
    } else {
        Err(Unfit::NoVector(fields_of(message)))
    }
}

/// What a message is, with the names of its first fields.
fn fields_of(value: &Value) -> String {
    const SHOWN: usize = 8;
    let Value::Object(fields) = value else { return value.kind().to_owned() };
    let mut names: Vec<&str> = fields.iter().take(SHOWN).map(|(name, _)| &**name).collect();
    if fields.len() > SHOWN {
        names.push("...");
    }
    names.join(", ")
}

fn vector_at(value: &Value, fields: &str) -> bool {
    let leaf = fields.split('.').try_fold(value, |v, name| v.field(name));
    leaf.and_then(Value::as_vector3).is_some()
}

/// Whether there is a place for a vector, but no value in it.
fn absent_at(value: &Value, fields: &str) -> bool {
    let leaf = fields.split('.').try_fold(value, |v, name| v.field(name));
    let axis =
        |v: &Value, name: &str| v.field(name).is_some_and(|c| *c == Value::Null || c.as_f64().is_some());
    leaf.is_some_and(|v| *v == Value::Null || ["x", "y", "z"].iter().all(|name| axis(v, name)))
}

/// The topic as a path begins with it.
pub(super) fn quoted(topic: &str) -> String {
    MessagePath { topic: topic.to_owned(), steps: Vec::new() }.to_string()
}
