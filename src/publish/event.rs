//! `trackfuse.CharacteristicPoint`: a height that was reached.

use serde::Serialize;

use super::fields::{Stamp, Xyz, json, nano, xyz};
use super::{Context, Published, Topic};
use crate::estimate::characteristic_point::CharacteristicPoint;

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

/// The message of a characteristic point; `None` where its state is not finite.
pub(super) fn event_message(
    event: &CharacteristicPoint,
    frame_id: &str,
    context: &Context<'_>,
) -> Option<Published> {
    let data = json(&EventMessage {
        timestamp: event.time.into(),
        frame_id,
        name: &event.name,
        time_since_t0: nano(event.time.seconds_since(context.t0))?,
        time_sigma: event.time_sigma_s.and_then(nano),
        position: xyz(event.state.position)?,
        velocity: xyz(event.state.velocity)?,
        velocity_sigma: xyz(event.state.velocity_sigma),
        phase: event.phase.name(),
    });
    Some(Published { topic: Topic::Events, time: event.time, data })
}
