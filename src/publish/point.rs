//! `trackfuse.TrackPoint`: the track at one instant.

use serde::Serialize;

use super::fields::{Stamp, Xyz, micro, xyz};
use super::payload::Payload;
use super::{Context, Published, Topic, ros};
use crate::quality::BAND_SIGMAS;
use crate::track::{Track, TrackPoint};

#[derive(Serialize, prost::Message)]
pub(super) struct PointMessage {
    #[prost(message, optional, tag = "1")]
    pub(super) timestamp: Option<Stamp>,
    #[prost(string, tag = "2")]
    pub(super) frame_id: String,
    #[prost(message, optional, tag = "3")]
    pub(super) position: Option<Xyz>,
    #[prost(message, optional, tag = "4")]
    pub(super) velocity: Option<Xyz>,
    #[prost(message, optional, tag = "5")]
    #[serde(skip_serializing_if = "Option::is_none")]
    acceleration: Option<Xyz>,
    #[prost(message, optional, tag = "6")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) position_sigma: Option<Xyz>,
    #[prost(message, optional, tag = "7")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) velocity_sigma: Option<Xyz>,
    #[prost(message, optional, tag = "8")]
    #[serde(skip_serializing_if = "Option::is_none")]
    position_lower: Option<Xyz>,
    #[prost(message, optional, tag = "9")]
    #[serde(skip_serializing_if = "Option::is_none")]
    position_upper: Option<Xyz>,
    #[prost(double, tag = "10")]
    speed: f64,
    #[prost(double, optional, tag = "11")]
    #[serde(skip_serializing_if = "Option::is_none")]
    depth: Option<f64>,
    #[prost(string, tag = "12")]
    phase: String,
    #[prost(string, tag = "13")]
    method: String,
    #[prost(string, repeated, tag = "14")]
    sources: Vec<String>,
}

impl Payload for PointMessage {
    type Ros = ros::Odometry;
}

/// The message of a point; `None` where its position or velocity is not finite.
fn point_message(point: &TrackPoint, frame_id: &str, context: &Context<'_>) -> Option<PointMessage> {
    let s = &point.state;
    let edge =
        |sign: f64| xyz(std::array::from_fn(|i| s.position[i] + sign * BAND_SIGMAS * s.position_sigma[i]));
    let sources = context.sources.iter().enumerate().filter(|(i, _)| point.seen_by >> i & 1 == 1);
    Some(PointMessage {
        timestamp: Some(Stamp::of(point.time)),
        frame_id: frame_id.to_owned(),
        position: Some(xyz(s.position)?),
        velocity: Some(xyz(s.velocity)?),
        acceleration: s.acceleration.and_then(xyz),
        position_sigma: xyz(s.position_sigma),
        velocity_sigma: xyz(s.velocity_sigma),
        position_lower: edge(-1.0),
        position_upper: edge(1.0),
        speed: micro(s.velocity.iter().map(|v| v * v).sum::<f64>().sqrt()),
        depth: context.surface_at_zero.then(|| micro(-s.position[2])),
        phase: point.phase.name().to_owned(),
        method: point.method.name().to_owned(),
        sources: sources.map(|(_, source)| source.name.clone()).collect(),
    })
}

/// The messages of a track's points on one topic.
pub fn track_messages<'a>(
    topic: Topic,
    track: &'a Track,
    context: Context<'a>,
) -> impl Iterator<Item = Published> + 'a {
    track.points.iter().filter_map(move |point| {
        let message = point_message(point, &track.frame_id, &context)?;
        Some(context.publish(topic, point.time, message))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Encoding;
    use crate::sample::Source;
    use crate::time::Time;
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
        let sources =
            ["tether", "odd", "beacon"].map(|name| Source { name: name.into(), ..Source::default() });
        let zero = Time::from_ns(0);
        let context = Context {
            sources: &sources,
            origin: zero,
            rate_hz: 1.0,
            t0: zero,
            surface_at_zero,
            log_start: None,
            encoding: Encoding::Json,
            geodetic: None,
        };
        let made: Vec<Published> = track_messages(Topic::Track, &track, context).collect();
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
        let channel = Topic::Track.channel("/fused", Encoding::Json);
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
