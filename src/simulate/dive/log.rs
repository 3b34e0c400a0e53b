//! The log of a dive: fixes, the ship's navigation, depth, the reference, and the truth.

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use nalgebra::Vector3;
use serde_json::{Value, json};

use super::messages::{FixMessage, Seen};
use super::scenario::{DiveScenario, FixesAs};
use super::ship::ShipState;
use super::simulation::{SimulatedDive, simulate_dive};
use crate::math::geodesy::{Geodetic, LocalFrame};
use crate::simulate::error::SimulateError;
use crate::simulate::log::{
    Channel, Message, Recorded, Schema, decimal, entries, object_schema, round, stamp_json, time_schema,
    vector_schema, write,
};
use crate::simulate::sensor_channel::{FRAME, SensorEncoding, sensor_channel};
use crate::time::Time;

/// Size at which a chunk is closed, bytes before compression.
const CHUNK_BYTES: u32 = 128 * 1024;

/// What a message takes to its log, s, where the scenario has no latency for it. All differ, since equal log times can't
/// be played one by one.
const SHIP_LATENCY_S: f64 = 0.0523;
const DEPTH_LATENCY_S: f64 = 0.0171;

/// Simulates a dive and writes its log.
///
/// # Errors
///
/// Those of [`simulate_dive`], before anything is written; [`SimulateError::Log`] where writing fails.
pub fn write_dive_log<W: Write + Seek>(
    scenario: &DiveScenario,
    writer: W,
) -> Result<SimulatedDive, SimulateError> {
    let dive = simulate_dive(scenario)?;
    write_dive(scenario, &dive, writer)?;
    Ok(dive)
}

/// Writes the log of a simulation of `scenario`: the same bytes for the same arguments.
///
/// # Errors
///
/// [`SimulateError::Log`] where writing fails, [`SimulateError::Serialize`] for a scenario that TOML can't
/// hold.
pub fn write_dive<W: Write + Seek>(
    scenario: &DiveScenario,
    dive: &SimulatedDive,
    writer: W,
) -> Result<(), SimulateError> {
    let release = Time::from_ns(scenario.epoch_ns);
    let mut channels = vec![fixes(scenario, dive), navigation(scenario, dive)];
    if scenario.depth.enabled {
        channels.push(depth(scenario, dive));
    }
    channels.extend(dive.reference.iter().map(|r| sensor_channel(r, SensorEncoding::Json, release)));
    let recorded = Recorded {
        name: &scenario.name,
        release,
        begin: release,
        profile: "",
        chunk_bytes: CHUNK_BYTES,
        channels,
        truth: truth(scenario, dive),
        notes: notes(dive),
        scenario: scenario.to_toml()?,
    };
    write(recorded, writer)
}

fn fixes(scenario: &DiveScenario, dive: &SimulatedDive) -> Channel {
    let frame = frame(scenario);
    let (topic, schema, properties) = match scenario.messages.fixes_as {
        FixesAs::Xyz => {
            ("/usbl/fix", "usbl.Fix", position_schema("position in m; z = 0 is the sea's surface"))
        }
        FixesAs::Geodetic => {
            ("/usbl/fix", "usbl.Fix", place_schema("depth", "depth below the sea's surface in m"))
        }
        FixesAs::Polar => (
            "/usbl/raw",
            "usbl.Raw",
            json!({
                "range": number("slant range from the ship's transducer in m"),
                "bearing": number("bearing in degrees, clockwise from the bow"),
                "depression": number("depression in degrees, downwards from the horizontal"),
            }),
        ),
    };
    let message = |message: &FixMessage| {
        let said = match (&message.seen, &frame) {
            (Seen::Polar(seen), _) => json!({
                "range": round(seen.range_m, 1e3),
                "bearing": degrees(seen.bearing_rad),
                "depression": degrees(seen.depression_rad),
            }),
            (Seen::Position(p), None) => position_json(p),
            (Seen::Position(p), Some(frame)) => place_json(frame, p, "depth", -p.z),
        };
        (message.stamp_s, message.receive_s, said)
    };
    channel(scenario, topic, schema, "USBL", &properties, dive.messages.iter().map(message))
}

fn navigation(scenario: &DiveScenario, dive: &SimulatedDive) -> Channel {
    let frame = frame(scenario);
    let mut properties = if frame.is_some() {
        place_schema("altitude", "height of the USBL transducer above the sea's surface in m")
    } else {
        position_schema("position of the USBL transducer in m; z = 0 is the sea's surface")
    };
    properties["heading"] = number("heading in degrees, clockwise from north");
    let message = |ship: &ShipState| {
        let p = &ship.position;
        let mut said = match &frame {
            Some(frame) => place_json(frame, p, "altitude", p.z),
            None => position_json(p),
        };
        said["heading"] = degrees(ship.heading_rad).into();
        (ship.time_s, ship.time_s + SHIP_LATENCY_S, said)
    };
    let sensor = "GNSS and gyrocompass";
    channel(
        scenario,
        "/ship/navigation",
        "ship.Navigation",
        sensor,
        &properties,
        dive.ship.iter().map(message),
    )
}

fn depth(scenario: &DiveScenario, dive: &SimulatedDive) -> Channel {
    let properties = json!({ "depth": number("depth below the sea's surface in m") });
    let message = |&[time_s, depth_m]: &[f64; 2]| {
        (time_s, time_s + DEPTH_LATENCY_S, json!({ "depth": round(depth_m, 1e3) }))
    };
    let messages = dive.depths.iter().map(message);
    channel(scenario, "/vehicle/depth", "vehicle.Depth", "pressure gauge", &properties, messages)
}

/// A channel of JSON messages: when each was stamped and received, s after release, and what else it says.
fn channel(
    scenario: &DiveScenario,
    topic: &'static str,
    schema: &'static str,
    sensor: &str,
    properties: &Value,
    messages: impl Iterator<Item = (f64, f64, Value)>,
) -> Channel {
    let release = Time::from_ns(scenario.epoch_ns);
    let message = |(stamp_s, receive_s, said): (f64, f64, Value)| {
        let stamp = release.plus_seconds(stamp_s);
        let message = Message::json(stamp, &with_timestamp(stamp_json(stamp), &said));
        Message { log_time: release.plus_seconds(receive_s), ..message }
    };
    Channel {
        topic,
        encoding: "json",
        schema: Schema::json(schema, &object_schema(schema, &with_timestamp(time_schema(), properties))),
        metadata: BTreeMap::from([("sensor".to_owned(), sensor.to_owned())]),
        messages: messages.map(message).collect(),
    }
}

/// The same object behind a timestamp.
fn with_timestamp(timestamp: Value, said: &Value) -> Value {
    let rest = said.as_object().into_iter().flatten().map(|(key, value)| (key.clone(), value.clone()));
    std::iter::once(("timestamp".to_owned(), timestamp)).chain(rest).collect()
}

/// The frame of latitudes and longitudes, where those are wanted.
fn frame(scenario: &DiveScenario) -> Option<LocalFrame> {
    let [latitude, longitude] = scenario.origin;
    let geodetic = scenario.messages.fixes_as == FixesAs::Geodetic;
    geodetic.then(|| LocalFrame::new(Geodetic::from_degrees([latitude, longitude, 0.0])))
}

fn position_json(p: &Vector3<f64>) -> Value {
    let [x, y, z] = [p.x, p.y, p.z].map(|v| round(v, 1e3));
    json!({ "frame_id": FRAME, "position": { "x": x, "y": y, "z": z } })
}

fn position_schema(description: &str) -> Value {
    json!({
        "frame_id": { "type": "string", "description": "frame of the position: east, north, up" },
        "position": vector_schema(description),
    })
}

/// Latitude and longitude of a position, and its height or depth by that name.
fn place_json(frame: &LocalFrame, p: &Vector3<f64>, vertical: &str, vertical_m: f64) -> Value {
    // heights count from the sea's surface, which bends away from the frame's plane
    let bend_m = frame.to_geodetic([p.x, p.y, p.z]).altitude_m - p.z;
    let [latitude, longitude, _] = frame.to_geodetic([p.x, p.y, p.z - bend_m]).to_degrees();
    json!({
        "latitude": round(latitude, 1e8), // 1 mm
        "longitude": round(longitude, 1e8),
        vertical: round(vertical_m, 1e3),
    })
}

fn place_schema(vertical: &str, description: &str) -> Value {
    json!({
        "latitude": number("latitude in degrees, WGS 84"),
        "longitude": number("longitude in degrees, WGS 84"),
        vertical: number(description),
    })
}

fn number(description: &str) -> Value {
    json!({ "type": "number", "description": description })
}

/// Degrees to a ten thousandth: 2 mm at 1 km.
fn degrees(angle_rad: f64) -> f64 {
    round(angle_rad.to_degrees(), 1e4)
}

/// What a real log wouldn't know: when nothing is heard, and what of the fixes is wild, late or repeated.
fn truth(scenario: &DiveScenario, dive: &SimulatedDive) -> BTreeMap<String, String> {
    let counts = dive.counts();
    let mut map = entries([
        ("name", scenario.name.clone()),
        ("description", scenario.description.clone()),
        ("seed", scenario.seed.to_string()),
        ("epoch_ns", scenario.epoch_ns.to_string()),
        ("end_s", decimal(dive.end_s)),
        ("deepest_m", decimal(dive.deepest_m())),
        ("fixes", counts.fixes.to_string()),
        ("wild_fixes", counts.wild.to_string()),
        ("late_fixes", counts.late.to_string()),
        ("repeated_fixes", counts.repeated.to_string()),
    ]);
    if let Some([begin_s, end_s]) = dive.record.silence_s {
        map.insert("silence_begin_s".into(), decimal(begin_s));
        map.insert("silence_end_s".into(), decimal(end_s));
    }
    map
}

fn notes(dive: &SimulatedDive) -> String {
    format!(
        "Dive notes\n\
         Ballasted descent, survey legs, ascent; {:.0} m at the deepest. Transducer over the side before release.\n\
         Sea state 2, current below 0.1 m/s.\n\
         This is a simulated trial: scenario.toml made it.\n",
        dive.deepest_m()
    )
}
