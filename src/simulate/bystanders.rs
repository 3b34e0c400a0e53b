//! Channels of no concern to a track: they make a log of a trial what it is.

use std::collections::BTreeMap;

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use super::Simulation;
use super::log::{Channel, Message, Schema, object_schema, round, stamp_json, time_schema};
use super::scenario::Scenario;
use crate::time::Time;

/// The random stream of all of these; far from the sensors'.
const STREAM: u64 = 1000;

/// Sonar, ship's log, battery and ship's position, over the whole recording.
pub(super) fn channels(scenario: &Scenario, simulation: &Simulation) -> [Channel; 4] {
    let mut rng = ChaCha8Rng::seed_from_u64(scenario.seed);
    rng.set_stream(STREAM);
    let recording = &scenario.recording;
    let release = Time::from_ns(scenario.epoch_ns);
    let length_s = recording.lead_s + simulation.phases.t3_s + recording.tail_s;
    // Each with a delay of its own, since equal log times can't be played one by one.
    let times = |rate_hz: f64, delay_s: f64| {
        let count = ((length_s - delay_s) * rate_hz).max(0.0) as u64 + 1;
        (0..count).map(move |k| {
            let t_s = k as f64 / rate_hz + delay_s - recording.lead_s;
            (t_s, release.plus_seconds(t_s))
        })
    };

    let sonar = times(recording.sonar_rate_hz, 0.0)
        .zip(0..)
        .map(|((_, time), ping)| Message {
            log_time: time,
            publish_time: time,
            data: compressed_image(time, &sonar_ping(ping, recording.sonar_bytes, &mut rng)),
        })
        .collect();
    let battery = times(2.0, 0.0137).map(|(t_s, time)| battery(t_s, time)).collect();
    let gnss = times(1.0, 0.2171).map(|(t_s, time)| position(t_s, time)).collect();
    let heartbeat = times(0.5, 0.1013).map(|(_, time)| entry(time, "recorder: all channels alive"));
    let phases = &simulation.phases;
    let events = [
        (phases.t0_s, "deck: release"),
        (phases.overlap_begin_s, "acoustics: beacon tracked"),
        (phases.overlap_end_s, "deck: tether at its end"),
        (phases.t2_s, "acoustics: beacon lost in the surface's echo"),
        (phases.t3_s + 0.5, "bridge: vehicle sighted at the surface"),
    ]
    .map(|(t_s, text)| entry(release.plus_seconds(t_s + 0.0007), text));

    [
        channel("/sonar/image", "cdr", Schema::ros2("sensor_msgs/msg/CompressedImage", IMAGE), sonar),
        channel(
            "/ship/log",
            "json",
            Schema::json("foxglove.Log", &log_schema()),
            heartbeat.chain(events).collect(),
        ),
        channel("/vehicle/battery", "json", Schema::json("vehicle.Battery", &battery_schema()), battery),
        channel("/ship/gnss", "json", Schema::json("foxglove.LocationFix", &position_schema()), gnss),
    ]
}

fn channel(topic: &'static str, encoding: &'static str, schema: Schema, messages: Vec<Message>) -> Channel {
    Channel { topic, encoding, schema, metadata: BTreeMap::new(), messages }
}

/// The definition of the sonar's messages.
const IMAGE: &str = "\
std_msgs/Header header
string format
uint8[] data
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
";

/// A `sensor_msgs/CompressedImage` in little-endian CDR, in a format of the sonar's own.
fn compressed_image(time: Time, ping: &[u8]) -> Vec<u8> {
    let (sec, nsec) = time.to_stamp();
    let mut message = vec![0, 1, 0, 0];
    message.extend((sec as i32).to_le_bytes());
    message.extend(nsec.to_le_bytes());
    for bytes in [b"sonar\0".as_slice(), b"x-sonar\0", ping] {
        let aligned = (message.len() - 4).next_multiple_of(4) + 4; // counted behind the four bytes of the head
        message.resize(aligned, 0);
        message.extend((bytes.len() as u32).to_le_bytes());
        message.extend(bytes);
    }
    message
}

/// A made-up binary ping: a mark, its number, then echoes that fade, with one from the sea floor, under
/// speckle.
fn sonar_ping(number: u32, bytes: u32, rng: &mut impl Rng) -> Vec<u8> {
    let mut data = b"SONR".to_vec();
    data.extend(number.to_le_bytes());
    let floor = 0.7 + 0.05 * (f64::from(number) * 0.1).sin();
    let echoes = bytes.saturating_sub(8);
    data.extend((0..echoes).map(|i| {
        let range = f64::from(i) / f64::from(echoes);
        let floor_echo = (-((range - floor) / 0.01).powi(2)).exp();
        let speckle = f64::from(rng.random::<u8>() >> 4);
        (150.0 * (-4.0 * range).exp() + 90.0 * floor_echo + speckle) as u8
    }));
    data
}

fn entry(time: Time, text: &str) -> Message {
    let info = 2; // foxglove.Log: INFO
    Message::json(
        time,
        &json!({
            "timestamp": stamp_json(time), "level": info, "message": text, "name": "ship", "file": "", "line": 0,
        }),
    )
}

fn battery(t_s: f64, time: Time) -> Message {
    let voltage = 48.2 - 0.8 * (t_s / 3.0).tanh().max(0.0);
    Message::json(
        time,
        &json!({
            "timestamp": stamp_json(time),
            "voltage": round(voltage, 1e3),
            "current": if t_s < 0.0 { 1.5 } else { 22.0 },
            "charge": round(0.93 - 1e-4 * t_s.max(0.0), 1e4),
        }),
    )
}

/// The ship drifts at 0.3 m/s to the north.
fn position(t_s: f64, time: Time) -> Message {
    const METRES_PER_DEGREE: f64 = 111_320.0;
    let covariance = [4.0, 0.0, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0, 9.0];
    let approximated = 1; // foxglove.LocationFix: APPROXIMATED
    Message::json(
        time,
        &json!({
            "timestamp": stamp_json(time),
            "frame_id": "gnss",
            "latitude": round(54.5 + 0.3 * t_s / METRES_PER_DEGREE, 1e8),
            "longitude": 10.25,
            "altitude": 4.2,
            "position_covariance": covariance,
            "position_covariance_type": approximated,
        }),
    )
}

fn battery_schema() -> Value {
    object_schema(
        "vehicle.Battery",
        &json!({
            "timestamp": time_schema(),
            "voltage": { "type": "number", "description": "V" },
            "current": { "type": "number", "description": "A" },
            "charge": { "type": "number", "description": "share of the capacity" },
        }),
    )
}

fn log_schema() -> Value {
    let levels: Vec<Value> = ["UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"]
        .iter()
        .zip(0..)
        .map(|(title, level)| json!({ "title": title, "const": level }))
        .collect();
    object_schema(
        "foxglove.Log",
        &json!({
            "timestamp": time_schema(),
            "level": { "title": "foxglove.LogLevel", "description": "severity", "oneOf": levels },
            "message": { "type": "string" },
            "name": { "type": "string" },
            "file": { "type": "string" },
            "line": { "type": "integer", "minimum": 0 },
        }),
    )
}

fn position_schema() -> Value {
    let kinds: Vec<Value> = ["UNKNOWN", "APPROXIMATED", "DIAGONAL_KNOWN", "KNOWN"]
        .iter()
        .zip(0..)
        .map(|(title, kind)| json!({ "title": title, "const": kind }))
        .collect();
    object_schema(
        "foxglove.LocationFix",
        &json!({
            "timestamp": time_schema(),
            "frame_id": { "type": "string" },
            "latitude": { "type": "number", "description": "degrees" },
            "longitude": { "type": "number", "description": "degrees" },
            "altitude": { "type": "number", "description": "m" },
            "position_covariance": { "type": "array", "items": { "type": "number" }, "description": "m2" },
            "position_covariance_type": { "title": "foxglove.PositionCovarianceType", "oneOf": kinds },
        }),
    )
}
