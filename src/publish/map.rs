//! `foxglove.LocationFix` and `foxglove.GeoJSON`: the track on a map.

use serde::Serialize;
use serde_json::{Value, json};

use super::fields::{Stamp, rounded};
use super::lines::track_lines;
use super::payload::Payload;
use super::scene::{MARKS, TRACK_VERTICES};
use super::{CHILD_FRAME, Context, Published, Topic, ros};
use crate::fusion::Fusion;
use crate::map::{feature, place, web_color};
use crate::math::geodesy::LocalFrame;
use crate::time::Time;
use crate::track::{Phase, TrackPoint};

/// Fixes a second at most: a map draws each as a mark of its own.
const MOST_HZ: f64 = 10.0;

#[derive(Serialize, prost::Message)]
pub(super) struct FixMessage {
    #[prost(message, optional, tag = "6")]
    pub(super) timestamp: Option<Stamp>,
    #[prost(string, tag = "7")]
    pub(super) frame_id: String,
    #[prost(double, tag = "1")]
    pub(super) latitude: f64,
    #[prost(double, tag = "2")]
    pub(super) longitude: f64,
    #[prost(double, tag = "3")]
    pub(super) altitude: f64,
    /// m2, by rows.
    #[prost(double, repeated, tag = "4")]
    pub(super) position_covariance: Vec<f64>,
    #[prost(int32, tag = "5")]
    pub(super) position_covariance_type: i32,
}

impl Payload for FixMessage {
    type Ros = ros::NavSatFix;
}

/// `PositionCovarianceType` of Foxglove and of ROS.
const UNKNOWN: i32 = 0;
const DIAGONAL_KNOWN: i32 = 2;

#[derive(Serialize, prost::Message)]
pub(super) struct GeoJsonMessage {
    #[prost(string, tag = "1")]
    geojson: String,
}

impl Payload for GeoJsonMessage {
    /// `foxglove_msgs/msg/GeoJSON` is the same; ROS itself has nothing like it.
    type Ros = Self;
}

/// The places of a track's points as messages of `topic`, thinned, and always that of the last; none where the track has
/// no place on the earth.
pub fn fix_messages<'a>(
    topic: Topic,
    fusion: &'a Fusion,
    context: Context<'a>,
) -> impl Iterator<Item = Published> + 'a {
    let step = (context.rate_hz / MOST_HZ - 1e-9).ceil().max(1.0) as usize;
    let frame = context.geodetic;
    let points = &fusion.track.points;
    let last = points.last().filter(|_| !(points.len() - 1).is_multiple_of(step));
    points.iter().step_by(step).chain(last).filter_map(move |point| {
        let message = fix_message(point, &frame?)?;
        Some(context.publish(topic, point.time, message))
    })
}

fn fix_message(point: &TrackPoint, frame: &LocalFrame) -> Option<FixMessage> {
    let [longitude, latitude, altitude] = place(frame, point.state.position)?;
    // the sigmas are along the axes at the origin, which turn by 1e-5 rad in 60 m
    let variances = rounded(point.state.position_sigma.map(|s| s * s), 1e9).map(<[f64; 3]>::from);
    let [east, north, up] = variances.unwrap_or_default();
    Some(FixMessage {
        timestamp: Some(Stamp::of(point.time)),
        frame_id: CHILD_FRAME.to_owned(),
        latitude,
        longitude,
        altitude,
        position_covariance: vec![east, 0.0, 0.0, 0.0, north, 0.0, 0.0, 0.0, up],
        position_covariance_type: if variances.is_some() { DIAGONAL_KNOWN } else { UNKNOWN },
    })
}

/// The whole track as lines by phase, and the characteristic points, at `time`.
pub(super) fn geojson_message(
    fusion: &Fusion,
    context: &Context<'_>,
    frame: &LocalFrame,
    time: Time,
) -> Published {
    let style = |phase: Phase| json!({ "color": web_color(phase), "weight": 3, "opacity": 1 });
    let lines = track_lines(fusion, context, TRACK_VERTICES).into_iter().filter_map(|line| {
        let places: Vec<[f64; 3]> = line.points.iter().map(|p| place(frame, *p)).collect::<Option<_>>()?;
        Some(feature(&places, json!({ "name": line.kind.name(), "style": style(line.kind) })))
    });
    let points = fusion.events.iter().take(MARKS).filter_map(|event| {
        let place = place(frame, event.state.position)?;
        Some(feature(&[place], json!({ "name": event.name, "style": style(event.phase) })))
    });
    let features: Vec<Value> = lines.chain(points).collect();
    let geojson = json!({ "type": "FeatureCollection", "features": features }).to_string();
    context.publish(Topic::GeoJson, time, GeoJsonMessage { geojson })
}
