//! `foxglove.Log`: what a person must read, where viewers show it.

use serde::Serialize;

use super::fields::{Stamp, json};
use super::{Published, Topic};
use crate::time::Time;

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

/// The summary and each warning as log messages at `time`.
pub(super) fn log_messages(summary: &str, warnings: &[String], time: Time) -> Vec<Published> {
    let message = |level, message: &str| {
        let line =
            LogMessage { timestamp: time.into(), level, message, name: "trackfuse", file: "", line: 0 };
        Published { topic: Topic::Log, time, data: json(&line) }
    };
    let mut messages = vec![message(INFO, summary)];
    messages.extend(warnings.iter().map(|w| message(WARNING, w)));
    messages
}
