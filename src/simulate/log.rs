//! Channels, metadata and attachments as an MCAP log that looks like a real one.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{Seek, Write};

use mcap::records::{MessageHeader, Metadata};
use serde_json::{Value, json};

use super::error::SimulateError;
use crate::time::Time;

/// All that a log holds.
pub(super) struct Recorded<'a> {
    /// The run's name.
    pub(super) name: &'a str,
    /// The instant of release: the run's zero.
    pub(super) release: Time,
    /// When the recording began.
    pub(super) begin: Time,
    pub(super) profile: &'static str,
    pub(super) chunk_bytes: u32,
    pub(super) channels: Vec<Channel>,
    /// What a real log wouldn't know.
    pub(super) truth: BTreeMap<String, String>,
    pub(super) notes: String,
    /// The scenario that made it, TOML.
    pub(super) scenario: String,
}

/// A channel and its messages, before they are put in order.
pub(super) struct Channel {
    pub(super) topic: &'static str,
    pub(super) encoding: &'static str,
    pub(super) schema: Schema,
    pub(super) metadata: BTreeMap<String, String>,
    pub(super) messages: Vec<Message>,
}

/// What a channel's messages are made of.
pub(super) struct Schema {
    name: &'static str,
    encoding: &'static str,
    data: Vec<u8>,
}

impl Schema {
    pub(super) fn json(name: &'static str, schema: &Value) -> Self {
        Self { name, encoding: "jsonschema", data: schema.to_string().into_bytes() }
    }

    pub(super) fn ros1(name: &'static str, definition: &str) -> Self {
        Self { name, encoding: "ros1msg", data: definition.as_bytes().to_vec() }
    }

    pub(super) fn ros2(name: &'static str, definition: &str) -> Self {
        Self { name, encoding: "ros2msg", data: definition.as_bytes().to_vec() }
    }

    pub(super) fn protobuf(name: &'static str, descriptors: &[u8]) -> Self {
        Self { name, encoding: "protobuf", data: descriptors.to_vec() }
    }
}

/// One message.
pub(super) struct Message {
    pub(super) log_time: Time,
    pub(super) publish_time: Time,
    pub(super) data: Vec<u8>,
}

impl Message {
    /// A JSON message that is published and received at the same instant.
    pub(super) fn json(time: Time, value: &Value) -> Self {
        Self { log_time: time, publish_time: time, data: value.to_string().into_bytes() }
    }
}

/// Writes a log: the same bytes for the same content.
///
/// # Errors
/// [`SimulateError::Log`] where writing fails.
pub(super) fn write<W: Write + Seek>(recorded: Recorded, writer: W) -> Result<(), SimulateError> {
    let mut log = mcap::WriteOptions::new()
        .profile(recorded.profile)
        .library(concat!("trackfuse ", env!("CARGO_PKG_VERSION")))
        .chunk_size(Some(u64::from(recorded.chunk_bytes)))
        .compression(Some(mcap::Compression::Zstd))
        .compression_threads(0) // so that the bytes don't depend on the machine
        .create(writer)?;
    log.write_metadata(&trial(recorded.name, recorded.release))?;
    log.write_metadata(&Metadata { name: "simulation".into(), metadata: recorded.truth })?;
    for (name, media_type, text) in [
        ("deployment_notes.txt", "text/plain", recorded.notes),
        ("scenario.toml", "application/toml", recorded.scenario),
    ] {
        log.attach(&mcap::Attachment {
            log_time: recorded.begin.to_log(),
            create_time: recorded.begin.to_log(),
            name: name.into(),
            media_type: media_type.into(),
            data: Cow::Owned(text.into_bytes()),
        })?;
    }
    write_messages(&mut log, &recorded.channels)?;
    log.finish()?;
    Ok(())
}

fn write_messages<W: Write + Seek>(
    log: &mut mcap::Writer<W>,
    channels: &[Channel],
) -> Result<(), SimulateError> {
    let mut ordered = Vec::new();
    for channel in channels {
        let Schema { name, encoding, data } = &channel.schema;
        let schema_id = log.add_schema(name, encoding, data)?;
        let id = log.add_channel(schema_id, channel.topic, channel.encoding, &channel.metadata)?;
        ordered.extend(channel.messages.iter().map(|message| (id, message)));
    }
    ordered.sort_by_key(|(_, message)| message.log_time);
    let mut sequences = BTreeMap::<u16, u32>::new();
    for (channel_id, message) in ordered {
        let sequence = sequences.entry(channel_id).or_default();
        let header = MessageHeader {
            channel_id,
            sequence: *sequence,
            log_time: message.log_time.to_log(),
            publish_time: message.publish_time.to_log(),
        };
        log.write_to_known_channel(&header, &message.data)?;
        *sequence += 1;
    }
    Ok(())
}

/// `{sec, nsec}` of an instant.
pub(super) fn stamp_json(time: Time) -> Value {
    let (sec, nsec) = time.to_stamp();
    json!({ "sec": sec, "nsec": nsec })
}

/// To the nearest `1 / parts`; never the negative zero, which JSON would show.
pub(super) fn round(value: f64, parts: f64) -> f64 {
    (value * parts).round() / parts + 0.0
}

/// A schema of one plain type per property, as viewers want it.
pub(super) fn object_schema(title: &str, properties: &Value) -> Value {
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": title,
        "type": "object",
        "properties": properties,
    })
}

/// The schema of `{x, y, z}`.
pub(super) fn vector_schema(description: &str) -> Value {
    let number = || json!({ "type": "number" });
    json!({
        "type": "object",
        "description": description,
        "properties": { "x": number(), "y": number(), "z": number() },
    })
}

/// The schema of an instant.
pub(super) fn time_schema() -> Value {
    json!({
        "type": "object",
        "title": "time",
        "properties": {
            "sec": { "type": "integer", "minimum": 0 },
            "nsec": { "type": "integer", "minimum": 0, "maximum": 999_999_999 },
        },
    })
}

/// Entries of a metadata record.
pub(super) fn entries<const N: usize>(entries: [(&str, String); N]) -> BTreeMap<String, String> {
    entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}

fn trial(run: &str, release: Time) -> Metadata {
    let metadata = entries([
        ("vessel", "R/V Example".into()),
        ("operator", "simulated".into()),
        ("site", "nowhere in particular".into()),
        ("run", run.to_owned()),
        ("release_ns", release.ns().to_string()),
    ]);
    Metadata { name: "trial".into(), metadata }
}

/// A number to nine decimals, so that the last bit of a platform's sines doesn't show.
pub(super) fn decimal(value: f64) -> String {
    round(value, 1e9).to_string()
}
