//! Logs for these tests, made in memory.

use std::collections::BTreeMap;
use std::io::Cursor;

use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::{Value, json};

/// When the vehicle is released.
pub(crate) const EPOCH_NS: u64 = 1_731_000_000_000_000_000;

/// The instant `time_s` after that.
pub(crate) fn ns(time_s: f64) -> u64 {
    EPOCH_NS.checked_add_signed((time_s * 1e9).round() as i64).unwrap()
}

/// Where the vehicle is: a climb from 60 m that bends gently.
pub(crate) fn position(t: f64) -> [f64; 3] {
    [0.5 * t, 3.0 * (0.2 * t).sin(), -60.0 + 4.0 * t]
}

/// How fast it is.
pub(crate) fn velocity(t: f64) -> [f64; 3] {
    [0.5, 0.6 * (0.2 * t).cos(), 4.0]
}

pub(crate) fn xyz([x, y, z]: [f64; 3]) -> Value {
    json!({"x": x, "y": y, "z": z})
}

pub(crate) fn stamp(ns: u64) -> Value {
    json!({"sec": ns / 1_000_000_000, "nsec": ns % 1_000_000_000})
}

/// A log in the making.
pub(crate) struct TrialLog {
    writer: Writer<Cursor<Vec<u8>>>,
    channels: BTreeMap<String, u16>,
}

impl TrialLog {
    pub(crate) fn new() -> Self {
        Self::with(WriteOptions::new().chunk_size(Some(4096)))
    }

    pub(crate) fn with(options: WriteOptions) -> Self {
        let writer = options.create(Cursor::new(Vec::new())).unwrap();
        Self { writer, channels: BTreeMap::new() }
    }

    /// A channel; JSON topics need none.
    pub(crate) fn channel(&mut self, topic: &str, encoding: &str, schema: (&str, &str, &str)) {
        let (name, schema_encoding, data) = schema;
        self.channel_of(topic, encoding, (name, schema_encoding, data.as_bytes()));
    }

    /// A channel whose schema is no text.
    pub(crate) fn channel_of(&mut self, topic: &str, encoding: &str, schema: (&str, &str, &[u8])) {
        let (name, schema_encoding, data) = schema;
        let schema = self.writer.add_schema(name, schema_encoding, data).unwrap();
        let id = self.writer.add_channel(schema, topic, encoding, &BTreeMap::new()).unwrap();
        self.channels.insert(topic.into(), id);
    }

    /// A message with its log time and publish time, ns.
    pub(crate) fn raw(&mut self, topic: &str, [log_time, publish_time]: [u64; 2], data: &[u8]) {
        if !self.channels.contains_key(topic) {
            self.channel(topic, "json", ("", "", ""));
        }
        let header = MessageHeader { channel_id: self.channels[topic], sequence: 0, log_time, publish_time };
        self.writer.write_to_known_channel(&header, data).unwrap();
    }

    /// A JSON message, logged and published at `time_s`.
    pub(crate) fn json(&mut self, topic: &str, time_s: f64, value: &Value) {
        self.raw(topic, [ns(time_s); 2], value.to_string().as_bytes());
    }

    /// A sensor's channel of positions and velocities.
    pub(crate) fn sensor(&mut self, topic: &str, sensor: &Sensor) {
        for (t, message) in sensor.messages() {
            self.json(topic, t, &message);
        }
    }

    pub(crate) fn finish(mut self) -> Vec<u8> {
        self.writer.finish().unwrap();
        self.writer.into_inner().into_inner()
    }
}

/// A simulated sensor.
pub(crate) struct Sensor {
    pub(crate) from_s: f64,
    pub(crate) to_s: f64,
    pub(crate) rate_hz: f64,
    /// Standard deviation of its noise, m and m/s.
    pub(crate) sigma: f64,
    pub(crate) bias_m: [f64; 3],
    pub(crate) seed: u64,
}

impl Sensor {
    pub(crate) fn new(from_s: f64, to_s: f64, seed: u64) -> Self {
        Self { from_s, to_s, rate_hz: 20.0, sigma: 0.1, bias_m: [0.0; 3], seed }
    }

    /// Time, position and velocity of each sample.
    pub(crate) fn samples(&self) -> Vec<(f64, [f64; 3], [f64; 3])> {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let mut noisy = |v: [f64; 3]| {
            v.map(|x| {
                let noise: f64 = StandardNormal.sample(&mut rng);
                x + self.sigma * noise
            })
        };
        let count = ((self.to_s - self.from_s) * self.rate_hz) as usize;
        (0..=count)
            .map(|i| {
                let t = self.from_s + i as f64 / self.rate_hz;
                let p = noisy(position(t));
                (t, std::array::from_fn(|axis| p[axis] + self.bias_m[axis]), noisy(velocity(t)))
            })
            .collect()
    }

    /// Time and message of each sample.
    pub(crate) fn messages(&self) -> Vec<(f64, Value)> {
        let message = |(t, p, v)| {
            (t, json!({"timestamp": stamp(ns(t)), "frame_id": "enu", "position": xyz(p), "velocity": xyz(v)}))
        };
        self.samples().into_iter().map(message).collect()
    }
}

/// A tether that sees the first 8 s and a beacon that sees from 5 to 13 s, both honest.
pub(crate) fn two_sensors() -> Vec<u8> {
    let mut log = TrialLog::new();
    log.sensor("/tether/track", &Sensor::new(0.0, 8.0, 1));
    log.sensor("/beacon/track", &Sensor::new(5.0, 13.0, 2));
    log.finish()
}

/// One honest sensor whose messages `change` may change, by number and time; an empty answer leaves one out.
pub(crate) fn changed(mut change: impl FnMut(usize, f64, Value) -> Option<Value>) -> Vec<u8> {
    let mut log = TrialLog::new();
    for (i, (t, message)) in Sensor::new(0.0, 8.0, 1).messages().into_iter().enumerate() {
        if let Some(message) = change(i, t, message) {
            log.json("/tether/track", t, &message);
        }
    }
    log.finish()
}

/// Writes CDR, little-endian.
pub(crate) struct Cdr(Vec<u8>);

impl Cdr {
    pub(crate) fn new() -> Self {
        Self(vec![0, 1, 0, 0])
    }

    fn align(&mut self, to: usize) {
        while !(self.0.len() - 4).is_multiple_of(to) {
            self.0.push(0);
        }
    }

    pub(crate) fn u32(mut self, v: u32) -> Self {
        self.align(4);
        self.0.extend(v.to_le_bytes());
        self
    }

    pub(crate) fn text(self, text: &str) -> Self {
        let mut cdr = self.u32(text.len() as u32 + 1);
        cdr.0.extend(text.as_bytes());
        cdr.0.push(0);
        cdr
    }

    pub(crate) fn f64s(mut self, values: &[f64]) -> Self {
        self.align(8);
        self.0.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        self
    }

    pub(crate) fn header(self, ns: u64, frame: &str) -> Self {
        self.u32((ns / 1_000_000_000) as u32).u32((ns % 1_000_000_000) as u32).text(frame)
    }

    pub(crate) fn done(self) -> Vec<u8> {
        self.0
    }
}

const HEADER: &str = "\
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
";

const GEOMETRY: &str = "\
================================================================================
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
================================================================================
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
================================================================================
MSG: geometry_msgs/Twist
geometry_msgs/Vector3 linear
geometry_msgs/Vector3 angular
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
";

/// The definition of a ROS 2 message with this body, and of all that it uses.
pub(crate) fn definition(body: &str) -> String {
    format!("{body}\n{HEADER}{GEOMETRY}")
}

pub(crate) const POSE_STAMPED: &str = "std_msgs/Header header\ngeometry_msgs/Pose pose";
pub(crate) const TWIST_STAMPED: &str = "std_msgs/Header header\ngeometry_msgs/Twist twist";

pub(crate) fn odometry_definition() -> String {
    let body = "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n\
                geometry_msgs/TwistWithCovariance twist";
    let with = |name: &str, field: &str| {
        format!(
            "{}\nMSG: geometry_msgs/{name}\ngeometry_msgs/{field}\nfloat64[36] covariance\n",
            "=".repeat(80)
        )
    };
    let pose = with("PoseWithCovariance", "Pose pose");
    let twist = with("TwistWithCovariance", "Twist twist");
    format!("{}{pose}{twist}", definition(body))
}

/// A `nav_msgs/Odometry` with variances on the diagonals; the orientation is x, y, z, w.
pub(crate) fn odometry(
    time_ns: u64,
    p: [f64; 3],
    orientation: [f64; 4],
    v: [f64; 3],
    variances: [f64; 2],
) -> Vec<u8> {
    let diagonal = |variance: f64| {
        let mut matrix = [0.0; 36];
        (0..6).for_each(|i| matrix[7 * i] = variance);
        matrix
    };
    Cdr::new()
        .header(time_ns, "odom")
        .text("base")
        .f64s(&p)
        .f64s(&orientation)
        .f64s(&diagonal(variances[0]))
        .f64s(&v)
        .f64s(&[0.0; 3])
        .f64s(&diagonal(variances[1]))
        .done()
}
