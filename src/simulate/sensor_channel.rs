//! A sensor's samples as the messages of a channel, in whatever encoding recorders use.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use prost::Message as _;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::log::{Channel, Message, Schema, object_schema, round, time_schema, vector_schema};
use super::sensors::{SensorRecord, SensorSample};
use crate::publish::{Stamp, Xyz, cdr};
use crate::time::Time;

/// The frame of all positions: east, north, up.
pub(super) const FRAME: &str = "enu";

/// What the sensors' messages are encoded in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SensorEncoding {
    /// JSON with a JSON Schema.
    #[default]
    Json,
    /// CDR, as ROS 2 has it.
    Cdr,
    /// As ROS 1 has it.
    Ros1,
    /// Protobuf with its descriptors.
    Protobuf,
}

impl SensorEncoding {
    /// Whether it is the one that needs no mention.
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde wants it")]
    pub(super) fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// The profile of a log that holds nothing else.
    pub(super) fn profile(self) -> &'static str {
        match self {
            Self::Cdr => "ros2",
            Self::Ros1 => "ros1",
            Self::Json | Self::Protobuf => "",
        }
    }
}

#[derive(Serialize, prost::Message)]
struct TrackSample {
    #[prost(message, optional, tag = "1")]
    timestamp: Option<Stamp>,
    #[prost(string, tag = "2")]
    frame_id: String,
    #[prost(message, optional, tag = "3")]
    position: Option<Xyz>,
    #[prost(message, optional, tag = "4")]
    velocity: Option<Xyz>,
}

/// The channel of a sensor.
pub(super) fn sensor_channel(sensor: &SensorRecord, encoding: SensorEncoding, release: Time) -> Channel {
    let (topic, title) = match sensor.name.as_str() {
        "tether" => ("/tether/track", "draw-wire gauge"),
        "beacon" => ("/beacon/track", "acoustic beacon"),
        _ => ("/reference/ins", "inertial reference"),
    };
    let (name, schema) = match encoding {
        SensorEncoding::Json => ("json", Schema::json("trackfuse.TrackSample", &track_schema())),
        SensorEncoding::Cdr => {
            ("cdr", Schema::ros2("trackfuse_msgs/msg/TrackSample", &definition(ROS_2_HEADER)))
        }
        SensorEncoding::Ros1 => {
            ("ros1", Schema::ros1("trackfuse_msgs/TrackSample", &definition(ROS_1_HEADER)))
        }
        SensorEncoding::Protobuf => (
            "protobuf",
            Schema::protobuf(
                "trackfuse.TrackSample",
                include_bytes!("../../schemas/protobuf/trackfuse.TrackSample.binpb"),
            ),
        ),
    };
    let mut metadata = BTreeMap::from([("sensor".to_owned(), title.to_owned())]);
    if encoding == SensorEncoding::Cdr {
        metadata.insert("offered_qos_profiles".into(), String::new());
    }
    let message = |sample: &SensorSample| {
        let stamp = release.plus_seconds(sample.stamp_s);
        Message {
            log_time: release.plus_seconds(sample.receive_s),
            publish_time: stamp,
            data: encoded(sample, stamp, encoding),
        }
    };
    let messages = sensor.samples.iter().map(message).collect();
    Channel { topic, encoding: name, schema, metadata, messages }
}

fn encoded(sample: &SensorSample, time: Time, encoding: SensorEncoding) -> Vec<u8> {
    let (position, velocity) = (rounded(&sample.position), rounded(&sample.velocity));
    let (sec, nanosec) = time.to_stamp();
    let message = || TrackSample {
        timestamp: Some(Stamp::of(time)),
        frame_id: FRAME.to_owned(),
        position: Some(position.into()),
        velocity: Some(velocity.into()),
    };
    match encoding {
        SensorEncoding::Json => serde_json::to_vec(&message()).unwrap_or_default(),
        SensorEncoding::Protobuf => message().encode_to_vec(),
        SensorEncoding::Cdr => cdr(&(sec as i32, nanosec, FRAME, position, velocity)),
        SensorEncoding::Ros1 => {
            let sequence = 0_u32;
            let mut bytes = Vec::new();
            for part in [sequence, sec as u32, nanosec, FRAME.len() as u32] {
                bytes.extend(part.to_le_bytes());
            }
            bytes.extend(FRAME.as_bytes());
            bytes.extend(position.iter().chain(&velocity).flat_map(|v| v.to_le_bytes()));
            bytes
        }
    }
}

/// To a millionth, as a recorder would write it.
fn rounded(v: &Vector3<f64>) -> [f64; 3] {
    [v.x, v.y, v.z].map(|v| round(v, 1e6))
}

fn track_schema() -> Value {
    object_schema(
        "trackfuse.TrackSample",
        &json!({
            "timestamp": time_schema(),
            "frame_id": { "type": "string", "description": "frame of position and velocity" },
            "position": vector_schema("position in m; z = 0 is the sea's surface"),
            "velocity": vector_schema("velocity in m/s"),
        }),
    )
}

const ROS_1_HEADER: &str = "uint32 seq\ntime stamp\nstring frame_id\n";

const ROS_2_HEADER: &str = "\
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
";

/// The definition for ROS with this header's.
fn definition(header: &str) -> String {
    let line = "=".repeat(80);
    let vector = "float64 x\nfloat64 y\nfloat64 z\n";
    format!(
        "std_msgs/Header header\n# m; z = 0 is the sea's surface\ngeometry_msgs/Point position\n# m/s\n\
         geometry_msgs/Vector3 velocity\n{line}\nMSG: std_msgs/Header\n{header}{line}\nMSG: geometry_msgs/Point\n\
         {vector}{line}\nMSG: geometry_msgs/Vector3\n{vector}"
    )
}
