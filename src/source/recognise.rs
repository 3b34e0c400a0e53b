//! Sources recognised by their topics' names: a sensor's word in the name, a position or velocity in the
//! message. What is not clear is not guessed.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use super::SourceError;
use crate::config::SourceConfig;
use crate::log::decode::{Decoder, Value};
use crate::log::{Index, Log};
use crate::printable::{printable, toml_string};

/// Words of class I sensors, the default datum, then those of class II. The second number of each is
/// whether the word must stand alone, since it is part of other words.
const DATUM_WORDS: [(&str, bool); 3] = [("tether", false), ("wire", true), ("gauge", false)];
const OTHER_WORDS: [(&str, bool); 4] =
    [("beacon", false), ("acoustic", false), ("usbl", false), ("lbl", true)];

/// Topics with one of these words hold what a track is judged by, never what it is made of.
const REFERENCE_WORDS: [&str; 4] = ["truth", "reference", "ins", "gt"];

/// Schemas of an earlier run's results, known even where its metadata record is lost.
const OWN_SCHEMAS: [&str; 3] =
    ["trackfuse.TrackPoint", "trackfuse.CharacteristicPoint", "trackfuse.Residual"];

/// Where the usual messages keep a position, the most specific first.
const POSITION_FIELDS: [&str; 5] = ["pose.pose.position", "pose.position", "position", "point", "vector"];

/// Where they keep a velocity.
const VELOCITY_FIELDS: [&str; 4] = ["twist.twist.linear", "twist.linear", "velocity", "vector"];

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

/// What a log's topics say.
#[derive(Clone, Debug, PartialEq)]
pub struct Recognised {
    /// The sources, as a config would name them; the datum first.
    pub sources: Vec<SourceConfig>,
    /// Channels that would fit, but whose names don't say that they are a sensor.
    pub unused: Vec<Candidate>,
    /// Sensors that can't be read, a sentence each.
    pub warnings: Vec<String>,
}

/// A source as a hint proposes it: of several paths the first, the others as comments.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Choice {
    /// What to call it.
    pub name: String,
    /// Paths of its position.
    pub positions: Vec<String>,
    /// Paths of its velocity.
    pub velocities: Vec<String>,
}

/// The text of a config with these sources; the first that looks like a datum is it, else the first.
pub(super) fn config_of(choices: &[Choice]) -> String {
    let datum = choices.iter().position(|c| is_datum_like(&c.name)).unwrap_or(0);
    let tables = choices.iter().enumerate().map(|(i, choice)| {
        let mut lines = vec!["[[source]]".to_owned(), format!("name = {}", toml_string(&choice.name))];
        for (key, paths) in [("position", &choice.positions), ("velocity", &choice.velocities)] {
            let or = |j: usize| if j == 0 { "" } else { "# " };
            let keys = paths.iter().enumerate();
            lines.extend(keys.map(|(j, path)| format!("{}{key} = {}", or(j), toml_string(path))));
        }
        if i == datum && choices.len() > 1 {
            lines.push("datum = true".to_owned());
        }
        lines.join("\n") + "\n"
    });
    tables.collect::<Vec<_>>().join("\n")
}

/// The candidates as a config would name them: each by its topic's first part, and a number where that is taken.
fn choices_of(candidates: &[Candidate]) -> Vec<Choice> {
    let mut choices: Vec<Choice> = Vec::new();
    for candidate in candidates.iter().take(4) {
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

/// Recognises the sources of a log.
///
/// Channels whose topics begin with `prefix`, and those that this program wrote, are passed over.
///
/// # Errors
/// [`SourceError::Unrecognised`] where no topic holds a sensor's word, [`SourceError::Ambiguous`] where
/// several channels offer the same for one sensor, or several sensors could be the datum.
pub fn recognise(log: &Log, prefix: &str) -> Result<Recognised, SourceError> {
    let (all, unusable) = candidates(log, prefix)?;
    let (sensors, unused): (Vec<_>, Vec<_>) = all.into_iter().partition(|c| sensor_word(&c.topic).is_some());
    let mut groups: BTreeMap<(String, String), Vec<&Candidate>> = BTreeMap::new();
    for candidate in &sensors {
        groups.entry(sensor_word(&candidate.topic).unwrap_or_default()).or_default().push(candidate);
    }
    if groups.is_empty() {
        return Err(SourceError::Unrecognised { choices: choices_of(&unused), candidates: unused, unusable });
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
    let ambiguous =
        |what: String| SourceError::Ambiguous { what, candidates: sensors.clone(), choices: choices.clone() };
    for choice in &choices {
        let several = [("position", choice.positions.len()), ("velocity", choice.velocities.len())];
        if let Some((what, _)) = several.iter().find(|(_, count)| *count > 1) {
            return Err(ambiguous(format!("several channels hold a {what} of {}", printable(&choice.name))));
        }
    }
    let datums: Vec<usize> = (0..choices.len()).filter(|&i| is_datum_like(&choices[i].name)).collect();
    let datum = match (datums.as_slice(), choices.len()) {
        (&[datum], _) => datum,
        (_, 1) => 0,
        _ => {
            let what =
                "it is not clear which source is the datum, whose bias and clock are zero by definition";
            return Err(ambiguous(what.into()));
        }
    };
    let mut sources: Vec<SourceConfig> = choices
        .iter()
        .map(|c| SourceConfig {
            name: c.name.clone(),
            position: c.positions.first().cloned(),
            velocity: c.velocities.first().cloned(),
            ..SourceConfig::default()
        })
        .collect();
    sources[..=datum].rotate_right(1);
    sources[0].datum = true;
    let unread = |(topic, _): &&(String, String)| {
        sensor_word(topic).is_some_and(|word| !groups.contains_key(&word) && !is_reference(topic))
    };
    let warnings = unusable
        .iter()
        .filter(unread)
        .map(|(topic, why)| format!("{} looks like a sensor's and is not used: {why}", printable(topic)))
        .collect();
    Ok(Recognised { sources, unused, warnings })
}

/// Whether a name holds a word of the sensors that are the datum by default: tether, wire, gauge.
#[must_use]
pub fn is_datum_like(name: &str) -> bool {
    find_word(name, &DATUM_WORDS).is_some()
}

/// Topics, and why their channels can't be sources.
type Unusable = Vec<(String, String)>;

/// Channels whose first message holds a position or a velocity, and the others.
fn candidates(log: &Log, prefix: &str) -> Result<(Vec<Candidate>, Unusable), SourceError> {
    let index = log.index();
    let (mut decoders, mut unusable) = (BTreeMap::new(), BTreeMap::new());
    for channel in index.channels.values() {
        let schema = index.schema_of(channel);
        let (encoding, name, data) =
            schema.map_or(("", "", &[][..]), |s| (s.encoding.as_str(), s.name.as_str(), s.data.as_slice()));
        let topic = channel.topic.as_str();
        if is_own(index, topic, prefix) || OWN_SCHEMAS.contains(&name) {
            unusable.insert(topic, "written by trackfuse".to_owned());
        } else if is_reference(topic) {
            unusable.insert(topic, "by its name a reference, which a track is judged by".to_owned());
        } else {
            match Decoder::new(&channel.message_encoding, encoding, name, data) {
                Ok(decoder) => drop(decoders.insert(channel.id, decoder)),
                Err(error) => drop(unusable.insert(topic, error.to_string())),
            }
        }
    }
    let first = log.first_messages(&decoders.keys().copied().collect::<BTreeSet<_>>())?;
    let mut found: BTreeMap<&str, Candidate> = BTreeMap::new();
    for (id, decoder) in &decoders {
        let topic = index.channels[id].topic.as_str();
        let Some(message) = first.get(id) else {
            unusable.insert(topic, "no messages".to_owned());
            continue;
        };
        let value = match decoder.decode(&message.data) {
            Ok(value) => value,
            Err(error) => {
                unusable.insert(topic, error.to_string());
                continue;
            }
        };
        let (position, velocity) = paths_in(topic, &value);
        if position.is_some() || velocity.is_some() {
            found.entry(topic).or_insert(Candidate { topic: topic.to_owned(), position, velocity });
        } else {
            let what = format!("no position or velocity in {}", fields_of(&value));
            unusable.insert(topic, what);
        }
    }
    unusable.retain(|topic, _| !found.contains_key(topic));
    let unusable = unusable.into_iter().map(|(topic, why)| (topic.to_owned(), why)).collect();
    Ok((found.into_values().collect(), unusable))
}

/// Whether a topic is below `prefix`, or below that of an earlier run, which its metadata record names.
fn is_own(index: &Index, topic: &str, prefix: &str) -> bool {
    let below = |prefix: &str| topic.strip_prefix(prefix).is_some_and(|rest| rest.starts_with('/'));
    below(prefix) || index.metadata.iter().filter_map(|m| m.name.strip_prefix("trackfuse:")).any(below)
}

/// Message paths of the position and the velocity in a topic's message, where the usual messages keep them.
fn paths_in(topic: &str, value: &Value) -> (Option<String>, Option<String>) {
    let path = |fields: &[&str]| {
        let named = |f: &str| f != "vector" || vector_is(topic, fields);
        let fits = |f: &&&str| vector_at(value, f) && named(f);
        // a sensor may begin before it has anything to say
        let may_fit = |f: &&&str| sensor_word(topic).is_some() && absent_at(value, f) && named(f);
        let found = fields.iter().find(fits).or_else(|| fields.iter().find(may_fit));
        found.map(|f| format!("{}.{f}", quoted(topic)))
    };
    (path(&POSITION_FIELDS), path(&VELOCITY_FIELDS))
}

/// The same of a topic of the log, by its first message, whatever its name.
///
/// # Errors
/// [`SourceError::NoTopic`]; [`SourceError::Decode`]; [`SourceError::NoVectors`] where it holds neither.
pub(super) fn paths_of_topic(
    log: &Log,
    topic: &str,
) -> Result<(Option<String>, Option<String>), SourceError> {
    let (index, name) = (log.index(), topic.to_owned());
    let topic = name.clone();
    let Some(channel) = index.channels_of(&topic).next() else {
        let topics: BTreeSet<String> = index.channels.values().map(|c| c.topic.clone()).collect();
        return Err(SourceError::NoTopic { name, topic, topics: topics.into_iter().collect() });
    };
    let schema = index.schema_of(channel);
    let (encoding, schema_name, data) =
        schema.map_or(("", "", &[][..]), |s| (s.encoding.as_str(), s.name.as_str(), s.data.as_slice()));
    let first = log.first_messages(&[channel.id].into())?;
    let Some(message) = first.get(&channel.id) else { return Err(SourceError::Empty { name, topic }) };
    let decoded = Decoder::new(&channel.message_encoding, encoding, schema_name, data)
        .and_then(|decoder| decoder.decode(&message.data));
    let value = decoded.map_err(|error| SourceError::Decode { name, topic: topic.clone(), error })?;
    let paths = paths_in(&topic, &value);
    if paths == (None, None) {
        let what = "position or velocity";
        return Err(SourceError::NoVectors { topic, what, found: fields_of(&value) });
    }
    Ok(paths)
}

fn is_reference(topic: &str) -> bool {
    words(topic).iter().any(|w| REFERENCE_WORDS.contains(&w.as_str()))
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

/// Whether a field that is just a `vector` is what `fields` look for: only the topic's name can say.
fn vector_is(topic: &str, fields: &[&str]) -> bool {
    let of_velocity =
        words(topic).iter().any(|w| ["vel", "velocity", "speed", "twist"].contains(&w.as_str()));
    let of_position = words(topic).iter().any(|w| ["pos", "position", "fix", "point"].contains(&w.as_str()));
    if fields == VELOCITY_FIELDS { of_velocity } else { of_position && !of_velocity }
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
fn quoted(topic: &str) -> String {
    crate::log::decode::MessagePath { topic: topic.to_owned(), steps: Vec::new() }.to_string()
}

/// What stands before the first sensor's word of a topic, and the word with the digits behind it.
fn sensor_word(topic: &str) -> Option<(String, String)> {
    let datum = find_word(topic, &DATUM_WORDS);
    let other = find_word(topic, &OTHER_WORDS);
    let (start, word) = [datum, other].into_iter().flatten().min()?;
    let digits = topic[start + word.len()..].chars().take_while(char::is_ascii_digit);
    Some((topic[..start].to_owned(), format!("{word}{}", digits.collect::<String>())))
}

/// The first of `known` in a name, and where it begins.
fn find_word<'a>(name: &str, known: &[(&'a str, bool)]) -> Option<(usize, &'a str)> {
    let lower = name.to_ascii_lowercase();
    let alone = |at: usize, word: &str| {
        let beside = |c: Option<char>| c.is_none_or(|c| !c.is_ascii_alphabetic());
        beside(lower[..at].chars().next_back()) && beside(lower[at + word.len()..].chars().next())
    };
    let places = known.iter().filter_map(|&(word, must_stand_alone)| {
        let mut places = lower.match_indices(word).map(|(at, _)| at);
        places.find(|&at| !must_stand_alone || alone(at, word)).map(|at| (at, word))
    });
    places.min()
}

/// The words of a topic, in lower case: cut at everything that is no letter, and where capitals begin.
fn words(topic: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut before = ' ';
    for c in topic.chars() {
        let boundary = !c.is_ascii_alphabetic() || (c.is_ascii_uppercase() && before.is_ascii_lowercase());
        if boundary {
            words.push(String::new());
        }
        if c.is_ascii_alphabetic() {
            words.last_mut().into_iter().for_each(|w| w.push(c.to_ascii_lowercase()));
        }
        before = c;
    }
    words.retain(|w| !w.is_empty());
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn topics_of_one_sensor_share_its_name() {
        let name = |t: &str| sensor_word(t).map(|(_, name)| name);
        assert_eq!(sensor_word("/gauge/pose"), sensor_word("/gauge/velocity"));
        assert_eq!(name("/rov/Beacon2/odom").as_deref(), Some("beacon2"));
        assert_eq!(name("/tether_position").as_deref(), Some("tether"));
        assert_eq!(name("/acoustic_beacon/fix").as_deref(), Some("acoustic"));
        assert_eq!(name("/wireless/status"), None);
        assert_eq!(name("/lbl/fix").as_deref(), Some("lbl"));
        assert_eq!(name("/cub1/pose"), None);
        assert_ne!(sensor_word("/a/beacon/pose"), sensor_word("/b/beacon/pose"));
    }

    #[test]
    fn words_are_cut_at_signs_digits_and_capitals() {
        assert_eq!(words("/gtPose/ins_1"), ["gt", "pose", "ins"]);
        assert_eq!(words("/instrument/truths"), ["instrument", "truths"]);
    }

    #[test]
    fn a_bare_vector_is_what_its_topic_says() {
        assert!(vector_is("/beacon/velocity", &VELOCITY_FIELDS));
        assert!(!vector_is("/beacon/velocity", &POSITION_FIELDS));
        assert!(vector_is("/beacon/fix", &POSITION_FIELDS));
        assert!(!vector_is("/beacon/force", &POSITION_FIELDS));
    }
}
