//! Characteristic points out of a log, as this program writes them beside a track.

use serde::Deserialize;

use super::recorded::{Stamp, Xyz};
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
    timestamp: Stamp,
    name: String,
    time_sigma: Option<f64>,
    position: Xyz,
    velocity: Xyz,
}

/// The characteristic points that stand beside the track of a topic, in order of time, and what can't be read of
/// them, a sentence each.
///
/// # Errors
/// [`LogError`] where the log can't be read.
pub fn recorded_events(log: &Log, topic: &str) -> Result<(Vec<RecordedEvent>, Vec<String>), LogError> {
    let prefix = topic.rsplit_once('/').map_or("", |(prefix, _)| prefix);
    let channels = log.index().channels_of(&format!("{prefix}/events")).map(|c| c.id).collect();
    let mut events: Vec<RecordedEvent> = Vec::new();
    let read = log.for_each_message(&channels, |message| {
        let event = serde_json::from_slice::<EventMessage>(message.data).ok();
        events.extend(event.and_then(|event| {
            Some(RecordedEvent {
                name: event.name,
                time: event.timestamp.time()?,
                time_sigma_s: event.time_sigma,
                position: event.position.into(),
                velocity: event.velocity.into(),
            })
        }));
        Ok::<_, LogError>(())
    })?;
    events.sort_by_key(|event| event.time);
    Ok((events, passed_over(&read.damaged)))
}
