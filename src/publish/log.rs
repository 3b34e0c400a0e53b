//! `foxglove.Log`: what a person must read, where viewers show it.

use serde::Serialize;

use super::fields::Stamp;
use super::payload::Payload;
use super::{Context, Published, Topic, ros};
use crate::time::Time;

#[derive(Serialize, prost::Message)]
pub(super) struct LogMessage {
    #[prost(message, optional, tag = "1")]
    pub(super) timestamp: Option<Stamp>,
    #[prost(int32, tag = "2")]
    pub(super) level: i32,
    #[prost(string, tag = "3")]
    pub(super) message: String,
    #[prost(string, tag = "4")]
    pub(super) name: String,
    #[prost(string, tag = "5")]
    pub(super) file: String,
    #[prost(fixed32, tag = "6")]
    pub(super) line: u32,
}

impl Payload for LogMessage {
    type Ros = ros::Log;
}

/// foxglove.Log levels.
const INFO: i32 = 2;
const WARNING: i32 = 3;

/// The summary and each warning as log messages at `time`.
pub(super) fn log_messages(
    summary: &str,
    warnings: &[String],
    time: Time,
    context: &Context<'_>,
) -> Vec<Published> {
    let message = |level, message: &str| {
        let line = LogMessage {
            timestamp: Some(Stamp::of(time)),
            level,
            message: message.to_owned(),
            name: "trackfuse".into(),
            file: String::new(),
            line: 0,
        };
        context.publish(Topic::Log, time, line)
    };
    let mut messages = vec![message(INFO, summary)];
    messages.extend(warnings.iter().map(|w| message(WARNING, w)));
    messages
}
