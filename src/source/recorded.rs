//! Tracks and references out of a log: the way back from channels to what estimators make.

use std::collections::{BTreeMap, BTreeSet};

use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::SourceError;
use super::candidate::of_topic;
use super::load::{Loaded, Samples, SigmaOrigin, load};
use crate::config::{SourceConfig, TimeChoice};
use crate::estimate::coverage::{interpolate, max_gap_s};
use crate::log::decode::{Decoder, MessagePath, Step};
use crate::log::{Log, LogError, passed_over};
use crate::sample::Sample;
use crate::time::Time;
use crate::track::{Method, Phase, State, Track, TrackPoint};

/// Schema of the tracks that this program writes.
const TRACK_SCHEMA: &str = "trackfuse.TrackPoint";

/// A track as it stands in a log.
#[derive(Clone, Debug, PartialEq)]
pub struct Recorded {
    /// Its points in order of time. Where the channel doesn't say, sigmas and velocities are NaN.
    pub track: Track,
    /// The sources that its points name, by bit of [`TrackPoint::seen_by`]; the topic where it names none.
    pub sources: Vec<String>,
    /// Whether this program wrote it, by its schema or, in ROS 2's own types, by the log's metadata.
    pub is_own: bool,
    /// Whether phases and methods are the channel's own; else they mean nothing.
    pub has_phases: bool,
    /// T0 as the log's metadata has it for this track.
    pub t0: Option<Time>,
    /// Latitude and longitude, degrees, and altitude, m, of its zero, where they are known.
    pub fix_origin: Option<[f64; 3]>,
    /// Topics that the track was made of, as the metadata has them.
    pub made_of: Vec<String>,
    /// What the metadata says of how the track was made, but for the report, which may be long.
    pub provenance: BTreeMap<String, String>,
    /// What a person must read, a sentence each.
    pub warnings: Vec<String>,
}

impl Recorded {
    /// T0, else the first point.
    #[must_use]
    pub fn origin(&self) -> Time {
        self.t0.or(self.track.points.first().map(|p| p.time)).unwrap_or(Time::from_ns(0))
    }
}

/// The track that is meant where none is named: the fused one, else the only one that the log's metadata tell of.
#[must_use]
pub fn usual_track(log: &Log) -> String {
    const FUSED: &str = "/fused/track";
    let index = log.index();
    let has = |topic: &str| index.channels_of(topic).next().is_some();
    let prefixes = index.metadata.iter().filter_map(|m| m.name.strip_prefix("trackfuse:"));
    let tracks: BTreeSet<String> =
        prefixes.map(|prefix| format!("{prefix}/track")).filter(|t| has(t)).collect();
    match tracks.first() {
        Some(only) if tracks.len() == 1 && !has(FUSED) => only.clone(),
        _ => FUSED.to_owned(),
    }
}

/// Reads the track of a topic: one that this program wrote, or any position, with its velocity if there is one.
///
/// # Errors
/// [`SourceError`], as [`load`].
pub fn recorded(log: &Log, topic: &str) -> Result<Recorded, SourceError> {
    let index = log.index();
    let is_own = |c| index.schema_of(c).is_some_and(|s| s.name == TRACK_SCHEMA);
    let mut recorded =
        if index.channels_of(topic).any(is_own) { own_track(log, topic) } else { foreign_track(log, topic) }?;
    let (prefix, name) = topic.rsplit_once('/').unwrap_or((topic, ""));
    if let Some(mut metadata) = log.metadata(&format!("trackfuse:{prefix}"))? {
        recorded.is_own |= matches!(name, "track" | "pcf");
        recorded.t0 = t0_of(&metadata);
        recorded.fix_origin = recorded.fix_origin.or(config_of(&metadata).output.origin);
        recorded.made_of = topics_of(&metadata);
        metadata.remove("report");
        recorded.provenance = metadata;
    }
    Ok(recorded)
}

/// The decoders of a log's channels; those that can't be had are left out.
fn decoders(log: &Log, channels: &BTreeSet<u16>) -> BTreeMap<u16, Decoder> {
    let index = log.index();
    let decoder = |id: &u16| {
        let channel = index.channels.get(id)?;
        let schema = index.schema_of(channel);
        let (encoding, name, data) =
            schema.map_or(("", "", &[][..]), |s| (s.encoding.as_str(), s.name.as_str(), s.data.as_slice()));
        Some((*id, Decoder::new(&channel.message_encoding, encoding, name, data).ok()?))
    };
    channels.iter().filter_map(decoder).collect()
}

/// The decoders of channels that are not JSON.
pub(super) fn other_decoders(log: &Log, channels: &BTreeSet<u16>) -> BTreeMap<u16, Decoder> {
    let mut decoders = decoders(log, channels);
    decoders.retain(|id, _| log.index().channels[id].message_encoding != "json");
    decoders
}

/// A message that this program wrote, in whatever encoding.
pub(super) fn own_message<T: DeserializeOwned>(decoder: Option<&Decoder>, data: &[u8]) -> Result<T, String> {
    match decoder {
        // straight, since tracks are long
        None => serde_json::from_slice(data).map_err(|e| e.to_string()),
        Some(decoder) => {
            let value = decoder.decode(data).map_err(|e| e.to_string())?;
            serde_json::from_value(value.to_json()).map_err(|e| e.to_string())
        }
    }
}

/// Reads what a track is to be held against: topics, or message paths of a position and of a velocity.
/// Latitudes and longitudes count from `fix_origin`, which is the track's.
///
/// # Errors
/// [`SourceError`], as [`load`]; [`SourceError::NoVectors`] for a topic that holds neither;
/// [`SourceError::GivenTwice`].
pub fn reference(
    log: &Log,
    given: &[String],
    time: Option<TimeChoice>,
    fix_origin: Option<[f64; 3]>,
) -> Result<(Loaded, Time), SourceError> {
    let name = given.join(", ");
    let mut config = SourceConfig { name: name.clone(), time, ..SourceConfig::default() };
    for text in given {
        let path = if log.index().channels_of(text).next().is_some() {
            MessagePath { topic: text.clone(), steps: Vec::new() }
        } else {
            MessagePath::parse(text).map_err(|error| SourceError::Path { name: name.clone(), error })?
        };
        let (position, velocity) = if path.steps.is_empty() {
            let found = of_topic(log, &path.topic)?;
            (found.position, found.velocity)
        } else if last_field(&path).is_some_and(is_velocity) {
            (None, Some(text.clone()))
        } else {
            (Some(text.clone()), None)
        };
        for (known, new, what) in
            [(&mut config.position, position, "position"), (&mut config.velocity, velocity, "velocity")]
        {
            match (known.as_ref(), new) {
                (Some(first), Some(second)) => {
                    let paths = [first.clone(), second];
                    return Err(SourceError::GivenTwice { what, paths });
                }
                (None, Some(new)) => *known = Some(new),
                (_, None) => {}
            }
        }
    }
    let Samples { mut loaded, origin, left_out, .. } = load(log, &[config], true, fix_origin)?;
    let mut one = loaded.pop().ok_or(SourceError::Empty { name, topic: given.join(", ") })?;
    one.warnings.splice(..0, left_out);
    Ok((one, origin))
}

/// The field at a path's end, or of which it ends at an element.
fn last_field(path: &MessagePath) -> Option<&str> {
    path.steps.iter().rev().find_map(|step| match step {
        Step::Field(field) => Some(field.as_str()),
        _ => None,
    })
}

/// Whether a field's name is one that velocities usually have.
fn is_velocity(field: &str) -> bool {
    let field = field.to_ascii_lowercase();
    let has = |word: &&str| field.contains(*word);
    ["vel", "linear", "twist", "speed"].iter().any(has) && !["accel", "angular"].iter().any(has)
}

/// A point as this program writes it.
#[derive(Deserialize)]
struct PointMessage {
    timestamp: Stamp,
    #[serde(default)]
    frame_id: String,
    position: Xyz,
    velocity: Xyz,
    acceleration: Option<Xyz>,
    position_sigma: Option<Xyz>,
    velocity_sigma: Option<Xyz>,
    phase: Phase,
    method: Method,
    #[serde(default)]
    sources: Vec<String>,
}

/// `google.protobuf.Timestamp` and ROS 2 have names of their own.
#[derive(Deserialize)]
pub(super) struct Stamp {
    #[serde(alias = "seconds")]
    sec: i64,
    #[serde(alias = "nanos", alias = "nanosec")]
    nsec: u32,
}

impl Stamp {
    pub(super) fn time(&self) -> Option<Time> {
        Time::from_stamp(self.sec, self.nsec.into())
    }
}

#[derive(Deserialize)]
pub(super) struct Xyz {
    x: f64,
    y: f64,
    z: f64,
}

impl From<Xyz> for [f64; 3] {
    fn from(v: Xyz) -> Self {
        [v.x, v.y, v.z]
    }
}

fn own_track(log: &Log, topic: &str) -> Result<Recorded, SourceError> {
    let channels: BTreeSet<u16> = log.index().channels_of(topic).map(|c| c.id).collect();
    let decoders = other_decoders(log, &channels);
    let mut names = Names::default();
    let mut track = Track { frame_id: String::new(), points: Vec::new() };
    let (mut unreadable, mut reason) = (0_usize, String::new());
    let read = log.for_each_message(&channels, |message| {
        let read = own_message(decoders.get(&message.channel_id), message.data);
        match read.and_then(|point| names.point(point, &mut track.frame_id)) {
            Ok(point) => track.points.push(point),
            Err(error) => {
                unreadable += 1;
                reason = error;
            }
        }
        Ok::<_, LogError>(())
    })?;
    track.points.sort_by_key(|p| p.time);
    if track.points.is_empty() {
        if let Some(first) = read.damaged.first() {
            let (name, topic, parts) = (topic.to_owned(), topic.to_owned(), read.damaged.len());
            return Err(SourceError::Unreadable { name, topic, parts, first: first.to_string() });
        }
        return Err(SourceError::Empty { name: topic.to_owned(), topic: topic.to_owned() });
    }
    let mut warnings = passed_over(&read.damaged);
    if unreadable > 0 {
        warnings.push(format!("{unreadable} messages of {topic} are left out: {reason}"));
    }
    Ok(Recorded {
        track,
        sources: names.list,
        is_own: true,
        has_phases: true,
        t0: None,
        fix_origin: None,
        made_of: Vec::new(),
        provenance: BTreeMap::new(),
        warnings,
    })
}

/// The sources' names, by bit.
#[derive(Default)]
struct Names {
    list: Vec<String>,
}

impl Names {
    fn point(&mut self, message: PointMessage, frame_id: &mut String) -> Result<TrackPoint, String> {
        const MOST: usize = 32;
        let mut seen_by = 0;
        for name in message.sources {
            let known = self.list.iter().position(|n| *n == name);
            let bit = known.unwrap_or_else(|| {
                self.list.push(name);
                self.list.len() - 1
            });
            if bit >= MOST {
                return Err(format!("more than {MOST} sources"));
            }
            seen_by |= 1 << bit;
        }
        if frame_id.is_empty() {
            *frame_id = message.frame_id;
        }
        let known = |v: Option<Xyz>| v.map_or([f64::NAN; 3], <[f64; 3]>::from);
        Ok(TrackPoint {
            time: message.timestamp.time().ok_or("a timestamp past the year 2262")?,
            state: State {
                position: message.position.into(),
                velocity: message.velocity.into(),
                acceleration: message.acceleration.map(Into::into),
                position_sigma: known(message.position_sigma),
                velocity_sigma: known(message.velocity_sigma),
            },
            phase: message.phase,
            method: message.method,
            seen_by,
        })
    }
}

/// T0 as the report in the metadata has it.
fn t0_of(metadata: &BTreeMap<String, String>) -> Option<Time> {
    let report: serde_json::Value = serde_json::from_str(metadata.get("report")?).ok()?;
    report.get("t0_ns")?.as_str()?.parse().ok().map(Time::from_ns)
}

/// What is read of the config in the metadata.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct MadeWith {
    source: Vec<Paths>,
    pub(super) output: Place,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Paths {
    position: Option<String>,
    velocity: Option<String>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Place {
    pub(super) origin: Option<[f64; 3]>,
}

pub(super) fn config_of(metadata: &BTreeMap<String, String>) -> MadeWith {
    toml::from_str(metadata.get("config").map_or("", String::as_str)).unwrap_or_default()
}

/// The topics of the sources in the metadata's config.
fn topics_of(metadata: &BTreeMap<String, String>) -> Vec<String> {
    topics_among(config_of(metadata).source.into_iter().flat_map(|s| [s.position, s.velocity]))
}

/// The topics of message paths.
fn topics_among(paths: impl IntoIterator<Item = Option<String>>) -> Vec<String> {
    let paths = paths.into_iter().flatten();
    paths.filter_map(|path| Some(MessagePath::parse(&path).ok()?.topic)).collect()
}

/// A channel of another's making as a track: its positions, with the velocities at their instants.
fn foreign_track(log: &Log, topic: &str) -> Result<Recorded, SourceError> {
    let (loaded, origin) = reference(log, &[topic.to_owned()], None, None)?;
    let velocities = &loaded.source.velocities;
    let gap_s = max_gap_s(velocities);
    let unknown = [f64::NAN; 3];
    // what the scatter tells is not what the track says of itself
    let is_given = loaded.sigma.map(|sigma| sigma.is_some_and(|(_, from)| from == SigmaOrigin::Messages));
    let point = |p: &Sample| {
        let velocity = interpolate(velocities, p.time_s, gap_s);
        TrackPoint {
            time: origin.plus_seconds(p.time_s),
            state: State {
                position: p.value,
                velocity: velocity.map_or(unknown, |v| v.value),
                acceleration: None,
                position_sigma: if is_given[0] { p.sigma } else { unknown },
                velocity_sigma: velocity.filter(|_| is_given[1]).map_or(unknown, |v| v.sigma),
            },
            phase: Phase::Single,
            method: Method::default(),
            seen_by: 1,
        }
    };
    let points: Vec<TrackPoint> = loaded.source.positions.iter().map(point).collect();
    if points.is_empty() {
        let found = "velocities only".to_owned();
        return Err(SourceError::NoVectors { topic: topic.to_owned(), what: "position", found });
    }
    Ok(Recorded {
        track: Track { frame_id: loaded.frame_id, points },
        sources: vec![topic.to_owned()],
        is_own: false,
        has_phases: false,
        t0: None,
        fix_origin: loaded.fix_origin,
        made_of: topics_among([loaded.config.position, loaded.config.velocity]),
        provenance: BTreeMap::new(),
        warnings: loaded.warnings,
    })
}
