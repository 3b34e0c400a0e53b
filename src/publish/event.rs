//! `trackfuse.CharacteristicPoint`: a height that was reached.

use serde::Serialize;

use super::fields::{Stamp, Xyz, nano, xyz};
use super::payload::Payload;
use super::{Context, Published, Topic, ros};
use crate::estimate::characteristic_point::CharacteristicPoint;

#[derive(Serialize, prost::Message)]
pub(super) struct EventMessage {
    #[prost(message, optional, tag = "1")]
    pub(super) timestamp: Option<Stamp>,
    #[prost(string, tag = "2")]
    pub(super) frame_id: String,
    #[prost(string, tag = "3")]
    pub(super) name: String,
    #[prost(double, tag = "4")]
    pub(super) time_since_t0: f64,
    #[prost(double, optional, tag = "5")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) time_sigma: Option<f64>,
    #[prost(message, optional, tag = "6")]
    pub(super) position: Option<Xyz>,
    #[prost(message, optional, tag = "7")]
    pub(super) velocity: Option<Xyz>,
    #[prost(message, optional, tag = "8")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) velocity_sigma: Option<Xyz>,
    #[prost(string, tag = "9")]
    pub(super) phase: String,
}

impl Payload for EventMessage {
    type Ros = ros::CharacteristicPoint;
}

/// The message of a characteristic point; `None` where its state is not finite.
pub(super) fn event_message(
    event: &CharacteristicPoint,
    frame_id: &str,
    context: &Context<'_>,
) -> Option<Published> {
    let message = EventMessage {
        timestamp: Some(Stamp::of(event.time)),
        frame_id: frame_id.to_owned(),
        name: event.name.clone(),
        time_since_t0: nano(event.time.seconds_since(context.t0))?,
        time_sigma: event.time_sigma_s.and_then(nano),
        position: Some(xyz(event.state.position)?),
        velocity: Some(xyz(event.state.velocity)?),
        velocity_sigma: xyz(event.state.velocity_sigma),
        phase: event.phase.name().to_owned(),
    };
    Some(context.publish(Topic::Events, event.time, message))
}
