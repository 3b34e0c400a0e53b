//! A simulation as an MCAP log that looks like a real one: tracks, channels of no concern, notes, and how it
//! was made.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{Seek, Write};

use mcap::records::{MessageHeader, Metadata};
use nalgebra::Vector3;
use serde_json::{Value, json};

use super::bystanders;
use super::error::SimulateError;
use super::scenario::{RecordingScenario, Scenario};
use super::sensor_channel::sensor_channel;
use super::sensors::SensorRecord;
use super::{Simulation, simulate};
use crate::time::Time;

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

/// Simulates a scenario and writes its log.
///
/// # Errors
///
/// Those of [`simulate`], before anything is written; [`SimulateError::Log`] where writing fails.
pub fn write_log<W: Write + Seek>(scenario: &Scenario, writer: W) -> Result<Simulation, SimulateError> {
    let simulation = simulate(scenario)?;
    write_simulation(scenario, &simulation, writer)?;
    Ok(simulation)
}

/// Writes the log of a simulation of `scenario`: the same bytes for the same arguments.
///
/// # Errors
///
/// [`SimulateError::Log`] where writing fails, [`SimulateError::Serialize`] for a scenario that TOML can't
/// hold.
pub fn write_simulation<W: Write + Seek>(
    scenario: &Scenario,
    simulation: &Simulation,
    writer: W,
) -> Result<(), SimulateError> {
    let made_by = scenario.to_toml()?;
    let release = Time::from_ns(scenario.epoch_ns);
    let RecordingScenario { encoding, bystanders, .. } = scenario.recording;
    let mut channels: Vec<Channel> =
        simulation.sensors.iter().map(|sensor| sensor_channel(sensor, encoding, release)).collect();
    if bystanders {
        channels.extend(bystanders::channels(scenario, simulation));
    }

    let mut log = mcap::WriteOptions::new()
        // the bystanders are in encodings of their own
        .profile(if bystanders { "" } else { encoding.profile() })
        .library(concat!("trackfuse ", env!("CARGO_PKG_VERSION")))
        .chunk_size(Some(u64::from(scenario.recording.chunk_bytes)))
        .compression(Some(mcap::Compression::Zstd))
        .compression_threads(0) // so that the bytes don't depend on the machine
        .create(writer)?;
    log.write_metadata(&trial(scenario))?;
    log.write_metadata(&truth(scenario, simulation))?;
    let begin = release.plus_seconds(-scenario.recording.lead_s);
    for (name, media_type, text) in [
        ("deployment_notes.txt", "text/plain", notes(simulation)),
        ("scenario.toml", "application/toml", made_by),
    ] {
        log.attach(&mcap::Attachment {
            log_time: begin.to_log(),
            create_time: begin.to_log(),
            name: name.into(),
            media_type: media_type.into(),
            data: Cow::Owned(text.into_bytes()),
        })?;
    }
    write_messages(&mut log, &channels)?;
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

fn record<const N: usize>(name: &str, entries: [(&str, String); N]) -> Metadata {
    Metadata {
        name: name.into(),
        metadata: entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect(),
    }
}

fn trial(scenario: &Scenario) -> Metadata {
    record(
        "trial",
        [
            ("vessel", "R/V Example".into()),
            ("operator", "simulated".into()),
            ("site", "nowhere in particular".into()),
            ("run", scenario.name.clone()),
            ("release_ns", scenario.epoch_ns.to_string()),
        ],
    )
}

/// What a real log wouldn't know: phases, characteristic points and systematic errors.
fn truth(scenario: &Scenario, simulation: &Simulation) -> Metadata {
    let phases = &simulation.phases;
    let mut entries = record(
        "simulation",
        [
            ("name", scenario.name.clone()),
            ("description", scenario.description.clone()),
            ("seed", scenario.seed.to_string()),
            ("epoch_ns", scenario.epoch_ns.to_string()),
            ("t0_s", decimal(phases.t0_s)),
            ("t1_s", decimal(phases.t1_s)),
            ("t2_s", decimal(phases.t2_s)),
            ("t3_s", decimal(phases.t3_s)),
            ("overlap_begin_s", decimal(phases.overlap_begin_s)),
            ("overlap_end_s", decimal(phases.overlap_end_s)),
        ],
    );
    let map = &mut entries.metadata;
    for (k, point) in (1..).zip(&simulation.characteristic_points) {
        map.insert(format!("point_{k}_t_s"), decimal(point.t_s));
        map.insert(format!("point_{k}_z_m"), decimal(point.z_m));
        map.insert(format!("point_{k}_vz_m_s"), decimal(point.vz_m_s));
    }
    for SensorRecord { name, errors, .. } in &simulation.sensors {
        let list = |v: &Vector3<f64>| format!("[{}, {}, {}]", decimal(v.x), decimal(v.y), decimal(v.z));
        map.insert(format!("{name}_bias_m"), list(&errors.bias_m));
        map.insert(format!("{name}_velocity_bias_m_s"), list(&errors.velocity_bias_m_s));
        map.insert(format!("{name}_drift_m_s"), list(&errors.drift_m_s));
        map.insert(format!("{name}_scale"), decimal(errors.scale));
        map.insert(format!("{name}_clock_offset_s"), decimal(errors.clock_offset_s));
    }
    entries
}

/// A number to nine decimals, so that the last bit of a platform's sines doesn't show.
fn decimal(value: f64) -> String {
    round(value, 1e9).to_string()
}

fn notes(simulation: &Simulation) -> String {
    let start = simulation.trajectory.at(0.0).position;
    format!(
        "Deployment notes\n\
         Vehicle on the carrier at {:.0} m depth, tether gauge zeroed on the release point.\n\
         Sea state 2, current below 0.1 m/s. Beacon interrogation started before release.\n\
         This is a simulated trial: scenario.toml made it.\n",
        -start.z
    )
}
