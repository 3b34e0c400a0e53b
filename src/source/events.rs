//! Characteristic points out of a log, as this program writes them beside a track.

use serde::Deserialize;

use super::recorded::{Stamp, Xyz, other_decoders, own_message};
use crate::log::{Log, LogError, passed_over};
use crate::time::Time;

/// A characteristic point as it stands in a log.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedEvent {
    /// What it is called.
    pub name: String,
    /// When the track reaches it, on the track's clock.
    pub time: Time,
    /// One standard deviation of that, s.
    pub time_sigma_s: Option<f64>,
    /// Where, m.
    pub position: [f64; 3],
    /// How fast, m/s.
    pub velocity: [f64; 3],
}

#[derive(Deserialize)]
struct EventMessage {
    timestamp: Option<Stamp>,
    header: Option<Header>,
    name: String,
    #[serde(default)]
    time_sigma: Maybe,
    position: Xyz,
    velocity: Xyz,
}

/// Where ROS 2 has the stamp.
#[derive(Deserialize)]
struct Header {
    stamp: Stamp,
}

/// A number that may be absent, which ROS 2 has as a list.
#[derive(Deserialize)]
#[serde(untagged)]
enum Maybe {
    Is(Option<f64>),
    List(Vec<f64>),
}

impl Default for Maybe {
    fn default() -> Self {
        Self::Is(None)
    }
}

impl Maybe {
    fn value(self) -> Option<f64> {
        match self {
            Self::Is(value) => value,
            Self::List(list) => list.first().copied(),
        }
    }
}

/// The characteristic points that stand beside the track of a topic, in order of time, and what can't be read of
/// them, a sentence each.
///
/// # Errors
/// [`LogError`] where the log can't be read.
pub fn recorded_events(log: &Log, topic: &str) -> Result<(Vec<RecordedEvent>, Vec<String>), LogError> {
    let prefix = topic.rsplit_once('/').map_or("", |(prefix, _)| prefix);
    let channels = log.index().channels_of(&format!("{prefix}/events")).map(|c| c.id).collect();
    let decoders = other_decoders(log, &channels);
    let mut events: Vec<RecordedEvent> = Vec::new();
    let read = log.for_each_message(&channels, |message| {
        let event: Option<EventMessage> = own_message(decoders.get(&message.channel_id), message.data).ok();
        events.extend(event.and_then(|event| {
            Some(RecordedEvent {
                name: event.name,
                time: event.timestamp.or(event.header.map(|h| h.stamp))?.time()?,
                time_sigma_s: event.time_sigma.value(),
                position: event.position.into(),
                velocity: event.velocity.into(),
            })
        }));
        Ok::<_, LogError>(())
    })?;
    events.sort_by_key(|event| event.time);
    Ok((events, passed_over(&read.damaged)))
}
