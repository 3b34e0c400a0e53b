//! The result as new channels of the log: which topics there are, and what their messages say.

use serde::Serialize;

use crate::estimate::characteristic_point::CharacteristicPoint;
use crate::fusion::Fusion;
use crate::log::NewChannel;
use crate::time::Time;
use crate::track::{Track, TrackPoint};

/// 95 % of a normal distribution lie within this many standard deviations.
const BAND_SIGMAS: f64 = 1.959_963_984_540_054;

/// The new channels, in the order of their topics below.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topic {
    /// The fused track with its extrapolation.
    Track,
    /// The paper's plain extrapolation.
    Pcf,
    /// Characteristic points.
    Events,
    /// The summary and the warnings.
    Log,
}

impl Topic {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Track, Self::Pcf, Self::Events, Self::Log];

    /// The channel under `prefix`.
    #[must_use]
    pub fn channel(self, prefix: &str) -> NewChannel {
        let point = ("trackfuse.TrackPoint", include_str!("../schemas/trackfuse.TrackPoint.schema.json"));
        let event = (
            "trackfuse.CharacteristicPoint",
            include_str!("../schemas/trackfuse.CharacteristicPoint.schema.json"),
        );
        let (name, (schema_name, schema)) = match self {
            Self::Track => ("track", point),
            Self::Pcf => ("pcf", point),
            Self::Events => ("events", event),
            Self::Log => ("log", ("foxglove.Log", include_str!("../schemas/foxglove.Log.schema.json"))),
        };
        NewChannel::json(&format!("{prefix}/{name}"), schema_name, schema)
    }
}

/// A message of a new channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Published {
    /// Its channel.
    pub topic: Topic,
    /// Its instant.
    pub time: Time,
    /// Its payload, JSON.
    pub data: Vec<u8>,
}

/// What the messages need beside the points.
#[derive(Clone, Copy, Debug)]
pub struct Labels<'a> {
    /// Names of the sources, by bit of [`TrackPoint::seen_by`].
    pub sources: &'a [String],
    /// Whether z = 0 is the surface.
    pub surface_at_zero: bool,
    /// T0.
    pub t0: Time,
}

#[derive(Serialize)]
struct Stamp {
    sec: i64,
    nsec: u32,
}

#[derive(Serialize)]
struct Xyz {
    x: f64,
    y: f64,
    z: f64,
}

#[derive(Serialize)]
struct PointMessage<'a> {
    timestamp: Stamp,
    frame_id: &'a str,
    position: Xyz,
    velocity: Xyz,
    #[serde(skip_serializing_if = "Option::is_none")]
    acceleration: Option<Xyz>,
    #[serde(skip_serializing_if = "Option::is_none")]
    position_sigma: Option<Xyz>,
    #[serde(skip_serializing_if = "Option::is_none")]
    velocity_sigma: Option<Xyz>,
    #[serde(skip_serializing_if = "Option::is_none")]
    position_lower: Option<Xyz>,
    #[serde(skip_serializing_if = "Option::is_none")]
    position_upper: Option<Xyz>,
    speed: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    depth: Option<f64>,
    phase: &'a str,
    method: &'a str,
    sources: Vec<&'a str>,
}

#[derive(Serialize)]
struct EventMessage<'a> {
    timestamp: Stamp,
    frame_id: &'a str,
    name: &'a str,
    time_since_t0: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    time_sigma: Option<f64>,
    position: Xyz,
    velocity: Xyz,
    #[serde(skip_serializing_if = "Option::is_none")]
    velocity_sigma: Option<Xyz>,
    phase: &'a str,
}

#[derive(Serialize)]
struct LogMessage<'a> {
    timestamp: Stamp,
    level: u8,
    message: &'a str,
    name: &'a str,
    file: &'a str,
    line: u32,
}

/// foxglove.Log levels.
const INFO: u8 = 2;
const WARNING: u8 = 3;

impl From<Time> for Stamp {
    fn from(time: Time) -> Self {
        let (sec, nsec) = time.to_stamp();
        Self { sec, nsec }
    }
}

/// To the micrometre (and its second's fractions): below every sensor, and half the bytes.
fn micro(v: f64) -> f64 {
    (v * 1e6).round() / 1e6
}

/// The vector, or `None` where a component is not finite: such a field is left out.
fn xyz(v: [f64; 3]) -> Option<Xyz> {
    let [x, y, z] = v.map(micro);
    v.iter().all(|c| c.is_finite()).then_some(Xyz { x, y, z })
}

/// Seconds to nanoseconds; `None` where not finite.
fn nano(v: f64) -> Option<f64> {
    v.is_finite().then(|| (v * 1e9).round() / 1e9)
}

fn json(message: &impl Serialize) -> Vec<u8> {
    // a struct of numbers and text always is JSON
    serde_json::to_vec(message).unwrap_or_default()
}

/// The message of a point; `None` where its position or velocity is not finite.
fn point_message(point: &TrackPoint, frame_id: &str, labels: &Labels<'_>) -> Option<Vec<u8>> {
    let s = &point.state;
    let edge =
        |sign: f64| xyz(std::array::from_fn(|i| s.position[i] + sign * BAND_SIGMAS * s.position_sigma[i]));
    let sources = labels.sources.iter().enumerate().filter(|(i, _)| point.seen_by >> i & 1 == 1);
    Some(json(&PointMessage {
        timestamp: point.time.into(),
        frame_id,
        position: xyz(s.position)?,
        velocity: xyz(s.velocity)?,
        acceleration: s.acceleration.and_then(xyz),
        position_sigma: xyz(s.position_sigma),
        velocity_sigma: xyz(s.velocity_sigma),
        position_lower: edge(-1.0),
        position_upper: edge(1.0),
        speed: micro(s.velocity.iter().map(|v| v * v).sum::<f64>().sqrt()),
        depth: labels.surface_at_zero.then(|| micro(-s.position[2])),
        phase: point.phase.name(),
        method: point.method.name(),
        sources: sources.map(|(_, name)| name.as_str()).collect(),
    }))
}

/// The messages of a track's points on one topic.
pub fn track_messages<'a>(
    topic: Topic,
    track: &'a Track,
    labels: Labels<'a>,
) -> impl Iterator<Item = Published> + 'a {
    track.points.iter().filter_map(move |point| {
        let data = point_message(point, &track.frame_id, &labels)?;
        Some(Published { topic, time: point.time, data })
    })
}

/// The message of a characteristic point; `None` where its state is not finite.
#[must_use]
pub fn event_message(event: &CharacteristicPoint, frame_id: &str, labels: &Labels<'_>) -> Option<Published> {
    let data = json(&EventMessage {
        timestamp: event.time.into(),
        frame_id,
        name: &event.name,
        time_since_t0: nano(event.time.seconds_since(labels.t0))?,
        time_sigma: event.time_sigma_s.and_then(nano),
        position: xyz(event.state.position)?,
        velocity: xyz(event.state.velocity)?,
        velocity_sigma: xyz(event.state.velocity_sigma),
        phase: event.phase.name(),
    });
    Some(Published { topic: Topic::Events, time: event.time, data })
}

/// The summary and each warning as log messages at `time`.
#[must_use]
pub fn log_messages(summary: &str, warnings: &[String], time: Time) -> Vec<Published> {
    let message = |level, message: &str| {
        let line =
            LogMessage { timestamp: time.into(), level, message, name: "trackfuse", file: "", line: 0 };
        Published { topic: Topic::Log, time, data: json(&line) }
    };
    let mut messages = vec![message(INFO, summary)];
    messages.extend(warnings.iter().map(|w| message(WARNING, w)));
    messages
}

/// All new messages in order of time; the summary stands at the track's first instant.
pub fn messages<'a>(
    fusion: &'a Fusion,
    labels: Labels<'a>,
    text: &str,
    warnings: &[String],
) -> impl Iterator<Item = Published> + 'a {
    let frame = &fusion.track.frame_id;
    let start = fusion.track.points.first().map_or(labels.t0, |p| p.time);
    let head = log_messages(text, warnings, start);
    let events = fusion.events.iter().filter_map(move |e| event_message(e, frame, &labels));
    let mut streams = [
        Box::new(track_messages(Topic::Track, &fusion.track, labels))
            as Box<dyn Iterator<Item = Published> + 'a>,
        Box::new(track_messages(Topic::Pcf, &fusion.plain_pcf, labels)),
        Box::new({
            let mut events: Vec<Published> = events.collect();
            events.sort_by_key(|e| e.time);
            events.into_iter()
        }),
    ]
    .map(Iterator::peekable);
    head.into_iter().chain(std::iter::from_fn(move || {
        let next = (0..streams.len()).filter_map(|i| Some((streams[i].peek()?.time, i))).min()?;
        streams[next.1].next()
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::{Method, Phase, State};
    use serde_json::Value;

    fn point(sigma: f64) -> TrackPoint {
        TrackPoint {
            time: Time::from_ns(1_500_000_001),
            state: State {
                position: [1.0, 2.0, -3.0],
                velocity: [0.0, 3.0, 4.0],
                acceleration: None,
                position_sigma: [sigma; 3],
                velocity_sigma: [0.1; 3],
            },
            phase: Phase::Overlap,
            method: Method::Spline,
            seen_by: 0b101,
        }
    }

    fn message(sigma: f64, surface_at_zero: bool) -> Value {
        let track = Track { frame_id: "enu".into(), points: vec![point(sigma)] };
        let sources = ["tether", "odd", "beacon"].map(String::from);
        let labels = Labels { sources: &sources, surface_at_zero, t0: Time::from_ns(0) };
        let made: Vec<Published> = track_messages(Topic::Track, &track, labels).collect();
        serde_json::from_slice(&made[0].data).expect("json")
    }

    #[test]
    fn a_point_says_where_how_fast_how_sure_and_who_saw_it() {
        let value = message(0.5, true);
        assert_eq!(value["timestamp"]["nsec"], 500_000_001);
        assert_eq!(value["speed"], 5.0);
        assert_eq!(value["depth"], 3.0);
        assert_eq!(value["sources"], serde_json::json!(["tether", "beacon"]));
        assert!((value["position_upper"]["x"].as_f64().expect("a number") - 1.979_982).abs() < 1e-9);
    }

    #[test]
    fn what_has_no_value_is_left_out() {
        let value = message(f64::NAN, false);
        for absent in ["acceleration", "position_sigma", "position_lower", "position_upper", "depth"] {
            assert!(value.get(absent).is_none(), "{absent}");
        }
        assert!(value.get("velocity_sigma").is_some());
    }

    #[test]
    fn every_field_that_is_written_stands_in_its_schema() {
        let channel = Topic::Track.channel("/fused");
        let schema: Value = serde_json::from_slice(&channel.schema).expect("json");
        assert_eq!(schema["title"], "trackfuse.TrackPoint");
        let properties = schema["properties"].as_object().expect("an object");
        let value = message(0.5, true);
        for key in value.as_object().expect("an object").keys() {
            assert!(properties.contains_key(key), "{key}");
        }
        for required in schema["required"].as_array().expect("a list") {
            assert!(value.get(required.as_str().expect("a name")).is_some(), "{required}");
        }
    }
}
