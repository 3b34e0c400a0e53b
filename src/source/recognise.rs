//! Sources recognised by their topics' names: a sensor's word in the name, a position or velocity in the
//! message. What is not clear is not guessed.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use super::SourceError;
use crate::config::SourceConfig;
use crate::log::Log;
use crate::log::decode::{Decoder, Value};

/// Words of class I sensors, the default datum, then those of class II. The second number of each is
/// whether the word must stand alone, since it is part of other words.
const DATUM_WORDS: [(&str, bool); 3] = [("tether", false), ("wire", true), ("gauge", false)];
const OTHER_WORDS: [(&str, bool); 4] =
    [("beacon", false), ("acoustic", false), ("usbl", false), ("lbl", true)];

/// Topics with one of these words hold what a track is judged by, never what it is made of.
const REFERENCE_WORDS: [&str; 4] = ["truth", "reference", "ins", "gt"];

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

impl Candidate {
    /// A name for it: the topic's first part.
    #[must_use]
    pub fn name(&self) -> &str {
        self.topic.trim_start_matches('/').split('/').next().unwrap_or(&self.topic)
    }
}

impl fmt::Display for Candidate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match (&self.position, &self.velocity) {
            (Some(_), Some(_)) => "position and velocity",
            (Some(_), None) => "position",
            _ => "velocity",
        };
        write!(f, "{} ({what})", self.topic)
    }
}

/// What a log's topics say.
#[derive(Clone, Debug, PartialEq)]
pub struct Recognised {
    /// The sources, as a config would name them; the datum first.
    pub sources: Vec<SourceConfig>,
    /// Channels that would fit, but whose names don't say that they are a sensor.
    pub unused: Vec<Candidate>,
}

/// Recognises the sources of a log.
///
/// Channels whose topics begin with `prefix` (an earlier track's) are passed over.
///
/// # Errors
/// [`SourceError::Unrecognised`] where no topic holds a sensor's word, [`SourceError::Ambiguous`] where
/// several channels offer the same for one sensor, or several sensors could be the datum.
pub fn recognise(log: &Log, prefix: &str) -> Result<Recognised, SourceError> {
    let all = candidates(log, prefix)?;
    let (sensors, unused): (Vec<_>, Vec<_>) = all.into_iter().partition(|c| sensor_word(&c.topic).is_some());
    let mut groups: BTreeMap<(String, String), Vec<Candidate>> = BTreeMap::new();
    for candidate in sensors {
        if let Some((before, name)) = sensor_word(&candidate.topic) {
            groups.entry((before, name)).or_default().push(candidate);
        }
    }
    if groups.is_empty() {
        return Err(SourceError::Unrecognised { candidates: unused });
    }
    let mut sources = Vec::new();
    for ((before, name), members) in groups {
        let unique = sources.iter().all(|s: &SourceConfig| s.name != name);
        let name = if unique { name } else { format!("{before}{name}") };
        let only = |path: fn(&Candidate) -> &Option<String>, what: &str| {
            let mut found = members.iter().filter_map(|c| path(c).clone());
            match (found.next(), found.next()) {
                (path, None) => Ok(path),
                _ => Err(SourceError::Ambiguous {
                    what: format!("several channels hold a {what} of {name}"),
                    candidates: members.clone(),
                }),
            }
        };
        let position = only(|c| &c.position, "position")?;
        let velocity = only(|c| &c.velocity, "velocity")?;
        sources.push(SourceConfig { name: name.clone(), position, velocity, ..SourceConfig::default() });
    }
    let datums: Vec<usize> = (0..sources.len()).filter(|&i| is_datum_like(&sources[i].name)).collect();
    match (datums.as_slice(), sources.len()) {
        (&[datum], _) => sources[..=datum].rotate_right(1),
        (_, 1) => {}
        _ => {
            let candidates = sources
                .iter()
                .map(|s| Candidate {
                    topic: s.name.clone(),
                    position: s.position.clone(),
                    velocity: s.velocity.clone(),
                })
                .collect();
            let what =
                "it is not clear which source is the datum, whose bias and clock are zero by definition";
            return Err(SourceError::Ambiguous { what: what.into(), candidates });
        }
    }
    sources[0].datum = true;
    Ok(Recognised { sources, unused })
}

/// Whether a name holds a word of the sensors that are the datum by default: tether, wire, gauge.
#[must_use]
pub fn is_datum_like(name: &str) -> bool {
    find_word(name, &DATUM_WORDS).is_some()
}

/// Channels whose first message holds a position or a velocity.
fn candidates(log: &Log, prefix: &str) -> Result<Vec<Candidate>, SourceError> {
    let index = log.index();
    let decoders: BTreeMap<u16, Decoder> = index
        .channels
        .values()
        .filter(|c| !c.topic.starts_with(&format!("{prefix}/")))
        .filter(|c| !words(&c.topic).iter().any(|w| REFERENCE_WORDS.contains(&w.as_str())))
        .filter_map(|c| {
            let schema = index.schema_of(c);
            let (encoding, name, data) = schema
                .map_or(("", "", &[][..]), |s| (s.encoding.as_str(), s.name.as_str(), s.data.as_slice()));
            Some((c.id, Decoder::new(&c.message_encoding, encoding, name, data).ok()?))
        })
        .collect();
    let first = log.first_messages(&decoders.keys().copied().collect::<BTreeSet<_>>())?;
    let mut found: BTreeMap<&str, Candidate> = BTreeMap::new();
    for (id, message) in &first {
        let Ok(value) = decoders[id].decode(&message.data) else { continue };
        let topic = index.channels[id].topic.as_str();
        let field = |fields: &[&str]| {
            let fits = |f: &&&str| vector_at(&value, f) && (**f != "vector" || vector_is(topic, fields));
            fields.iter().find(fits).map(|f| format!("{}.{f}", quoted(topic)))
        };
        let (position, velocity) = (field(&POSITION_FIELDS), field(&VELOCITY_FIELDS));
        if position.is_some() || velocity.is_some() {
            found.entry(topic).or_insert(Candidate { topic: topic.to_owned(), position, velocity });
        }
    }
    Ok(found.into_values().collect())
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
