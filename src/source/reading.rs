//! One channel's messages as readings: which fields hold the time, the vectors and their covariances.

use super::SourceError;
use super::fix::{Level, covariance_is_unknown, fix};
use super::gathered::Kind;
use super::polar::polar;
use crate::config::{Axes, SourceConfig, TimeChoice, VelocityFrame};
use crate::log::decode::{DecodeError, Decoder, MessagePath, PathMiss, Step, Value};
use crate::log::{Channel, Index, Message};
use crate::math::geodesy::Geodetic;
use crate::sample::Quantity;
use crate::time::Time;

/// Types whose velocities are in the frame of the body, by definition.
const BODY_BY_TYPE: [&str; 6] = [
    "nav_msgs/msg/Odometry",
    "nav_msgs/Odometry",
    "foxglove.Odometry",
    "foxglove::Odometry",
    "foxglove_msgs/msg/Odometry",
    "foxglove_msgs/Odometry",
];

/// Where messages keep an orientation, for velocities whose position is not used.
const ORIENTATIONS: [&[&str]; 4] = [
    &["pose", "pose", "orientation"],
    &["pose", "orientation"],
    &["orientation"],
    &["transform", "rotation"],
];

/// A vector as a message gave it, in the track's axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reading {
    pub(super) time: Time,
    pub(super) value: Measured,
    /// From the message's covariance, where it gives one.
    pub(super) sigma: Option<[f64; 3]>,
    /// Whether the message's orientation turned the offset that is in its position.
    pub(super) offset_is_turned: bool,
}

/// What a message says of a place or a velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Measured {
    /// Metres or m/s along the track's axes.
    Vector([f64; 3]),
    /// A place on the earth, and what its height was given as.
    Fix(Geodetic, Level),
    /// Range, m, bearing and depression, rad, from a ship.
    Polar([f64; 3]),
}

/// Which of the three times of a message counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Clock {
    Stamp,
    Publish,
    Log,
}

/// What one message gave.
#[derive(Clone, Debug)]
pub(super) struct Outcome {
    pub(super) clock: Clock,
    /// Log time less the time that counted, s.
    pub(super) delay_s: f64,
    pub(super) frame_id: Option<String>,
    pub(super) vectors: Vec<(Quantity, Result<Reading, Fault>)>,
}

/// Why a message gave no vector.
#[derive(Clone, Debug)]
pub(super) enum Fault {
    /// The path leads nowhere in this message.
    Miss(PathMiss),
    /// It leads to something that is no vector.
    NoVector {
        /// What stands there.
        kind: &'static str,
        /// Paths from there on that lead to a vector.
        fits: Vec<String>,
    },
    /// It leads to NaN or infinity.
    NotFinite,
    /// A filter in the path turned the message down; nothing is wrong with it.
    Filtered,
    /// The receiver says that it has no fix.
    NoFix,
    /// A latitude or longitude that there is not.
    OffEarth,
    /// A body-frame velocity without an orientation of unit length beside it.
    NoOrientation,
    /// Angles of which nothing tells whether they are degrees.
    NoUnit,
    /// A range that is not positive.
    NoRange,
    /// Angles beyond those that there are.
    NoAngle,
}

/// Reads the messages of one channel of one source.
#[derive(Debug)]
pub(super) struct Reader {
    decoder: Decoder,
    vectors: Vec<Vector>,
    timing: Timed,
    frames: Vec<MessagePath>,
    latency_s: f64,
    axes: Axes,
    offset_m: [f64; 3],
    kind: Kind,
}

/// Where the messages of a topic keep their time.
#[derive(Debug)]
pub(super) struct Timed {
    pub(super) stamps: Vec<MessagePath>,
    choice: Option<TimeChoice>,
}

impl Timed {
    pub(super) fn new(decoder: &Decoder, topic: &str, choice: Option<TimeChoice>) -> Self {
        let fields: [&[&str]; 3] = [&["timestamp"], &["stamp"], &["header", "stamp"]];
        let known = |path: &MessagePath| decoder.select(std::slice::from_ref(path)).is_ok();
        Self { stamps: fields.map(|f| root(topic, f)).into_iter().filter(known).collect(), choice }
    }

    /// The stamp, else the publish time, else the log time, 0 counting as absent; or the one asked for.
    pub(super) fn of(&self, value: &Value, message: &Message<'_>) -> Option<(Clock, Time)> {
        let stamp = || {
            let stamps = self.stamps.iter().filter_map(|p| p.resolve(value).ok().flatten()?.as_stamp());
            let (sec, nsec) = stamps.into_iter().find(|&stamp| stamp != (0, 0))?;
            Some((Clock::Stamp, Time::from_stamp(sec, nsec)?))
        };
        let publish = || {
            let time = Some(message.publish_time).filter(|&t| t != 0)?;
            Some((Clock::Publish, Time::from_log(time)?))
        };
        let log = || Some((Clock::Log, Time::from_log(message.log_time)?));
        match self.choice {
            None => stamp().or_else(publish).or_else(log),
            Some(TimeChoice::Stamp) => stamp(),
            Some(TimeChoice::Publish) => publish(),
            Some(TimeChoice::Log) => log(),
        }
    }
}

/// The path of a field from a message's root.
fn root(topic: &str, fields: &[&str]) -> MessagePath {
    let steps = fields.iter().map(|f| Step::Field((*f).to_owned())).collect();
    MessagePath { topic: topic.to_owned(), steps }
}

/// One vector that the messages hold.
#[derive(Debug)]
struct Vector {
    quantity: Quantity,
    path: MessagePath,
    /// Where its covariance may stand: the path, and the stride of the diagonal.
    covariances: Vec<MessagePath>,
    /// Where the orientation may stand that turns a body-frame velocity, or a position's offset; empty for others.
    orientations: Vec<MessagePath>,
}

impl Reader {
    /// A reader of `channel`, for those of the source's paths that are in it.
    pub(super) fn new(
        config: &SourceConfig,
        paths: &[(Quantity, MessagePath)],
        index: &Index,
        channel: &Channel,
        kind: Kind,
    ) -> Result<Self, SourceError> {
        let schema = index.schema_of(channel);
        let (encoding, schema_name, data) =
            schema.map_or(("", "", &[][..]), |s| (s.encoding.as_str(), s.name.as_str(), s.data.as_slice()));
        let whole =
            Decoder::new(&channel.message_encoding, encoding, schema_name, data).map_err(|error| {
                SourceError::Decode { name: config.name.clone(), topic: channel.topic.clone(), error }
            })?;
        let known = |path: &MessagePath| whole.select(std::slice::from_ref(path)).is_ok();
        let root = |fields: &[&str]| root(&channel.topic, fields);
        let timing = Timed::new(&whole, &channel.topic, config.time);
        let frames = [root(&["frame_id"]), root(&["header", "frame_id"])];
        let frames: Vec<_> = frames.into_iter().filter(known).collect();

        let by_type =
            if BODY_BY_TYPE.contains(&schema_name) { VelocityFrame::Body } else { VelocityFrame::World };
        let body = config.velocity_frame.unwrap_or(by_type) == VelocityFrame::Body;
        let mut vectors = Vec::new();
        for (quantity, path) in paths.iter().filter(|(_, path)| path.topic == channel.topic) {
            let position = paths.iter().find(|(q, p)| *q == Quantity::Position && p.topic == channel.topic);
            let is_turned = match quantity {
                Quantity::Position => config.offset_m != [0.0; 3],
                Quantity::Velocity => body,
            };
            let beside = |name| position.and_then(|(_, position)| sibling(position, 1, name));
            let usual = || ORIENTATIONS.iter().filter(|_| position.is_none()).map(|fields| root(fields));
            let orientations: Vec<_> =
                ["orientation", "rotation"].into_iter().filter_map(beside).chain(usual()).collect();
            let orientations: Vec<_> = orientations.into_iter().filter(|p| is_turned && known(p)).collect();
            if is_turned && *quantity == Quantity::Velocity && orientations.is_empty() {
                let (name, path) = (config.name.clone(), path.to_string());
                return Err(SourceError::NoOrientation { name, path });
            }
            let covariances = covariances(path).into_iter().filter(known).collect();
            vectors.push(Vector { quantity: *quantity, path: path.clone(), covariances, orientations });
        }
        let mut wanted: Vec<MessagePath> = vectors.iter().map(|v| v.path.clone()).collect();
        wanted.extend(vectors.iter().flat_map(|v| v.covariances.iter().chain(&v.orientations)).cloned());
        wanted.extend(timing.stamps.iter().chain(&frames).cloned());
        let decoder =
            whole.select(&wanted).map_err(|miss| SourceError::Miss { name: config.name.clone(), miss })?;
        Ok(Self {
            decoder,
            vectors,
            timing,
            frames,
            latency_s: config.latency_s,
            axes: config.axes,
            offset_m: config.offset_m,
            kind,
        })
    }

    /// Reads one message; `None` where its time lies past the year 2262.
    pub(super) fn read(&self, message: &Message<'_>) -> Result<Option<Outcome>, DecodeError> {
        let value = self.decoder.decode(message.data)?;
        let Some((clock, time)) = self.timing.of(&value, message) else { return Ok(None) };
        let delay_s = Time::from_log(message.log_time).map_or(0.0, |log| log.seconds_since(time));
        let time = time.plus_seconds(-self.latency_s);
        let vectors = self.vectors.iter().map(|v| (v.quantity, self.vector(v, &value, time))).collect();
        let frame = self.frames.iter().find_map(|p| p.resolve(&value).ok().flatten());
        let frame_id = match frame {
            Some(Value::Text(text)) if !text.is_empty() => Some(text.clone()),
            _ => None,
        };
        Ok(Some(Outcome { clock, delay_s, frame_id, vectors }))
    }

    fn vector(&self, vector: &Vector, message: &Value, time: Time) -> Result<Reading, Fault> {
        let at = vector.path.resolve(message).map_err(Fault::Miss)?.ok_or(Fault::Filtered)?;
        let mut sigma = vector
            .covariances
            .iter()
            .find_map(|path| diagonal(&path.resolve(message).ok()??.as_numbers()?))
            .map(|variances| variances.map(f64::sqrt));
        if let (Quantity::Position, Some(place)) = (vector.quantity, fix(at)) {
            let sigma = sigma.filter(|_| !covariance_is_unknown(at));
            let (place, level) = place?;
            return Ok(Reading { time, value: Measured::Fix(place, level), sigma, offset_is_turned: false });
        }
        // the position that a system works out itself comes before what it measured
        if let Kind::Acoustic(unit) = self.kind
            && at.as_vector3().is_none()
            && let Some(measured) = polar(at, unit)
        {
            let value = Measured::Polar(measured?);
            return Ok(Reading { time, value, sigma: None, offset_is_turned: false });
        }
        let mut value = at.as_vector3().ok_or_else(|| no_vector(&vector.path, at))?;
        let turn = |path: &MessagePath| path.resolve(message).ok().flatten().and_then(rotation);
        let turn = vector.orientations.iter().find_map(turn);
        let offset_is_turned = vector.quantity == Quantity::Position && turn.is_some();
        match turn {
            Some(turn) if offset_is_turned => value = sum(value, turn(self.offset_m)),
            Some(turn) => {
                let turned = turn(value);
                if turned != value {
                    // the axes mix: one sigma for all keeps the total
                    sigma = sigma.map(|s| [(s.iter().map(|s| s * s).sum::<f64>() / 3.0).sqrt(); 3]);
                }
                value = turned;
            }
            None if vector.quantity == Quantity::Velocity && !vector.orientations.is_empty() => {
                return Err(Fault::NoOrientation);
            }
            None => {}
        }
        if self.axes == Axes::Ned {
            value = [value[1], value[0], -value[2]];
            sigma = sigma.map(|s| [s[1], s[0], s[2]]);
        }
        if value.iter().all(|v| v.is_finite()) {
            Ok(Reading { time, value: Measured::Vector(value), sigma, offset_is_turned })
        } else {
            Err(Fault::NotFinite)
        }
    }
}

/// The sum of two vectors.
pub(super) fn sum(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] + b[i])
}

fn no_vector(path: &MessagePath, found: &Value) -> Fault {
    let fields = if let Value::Object(fields) = found { fields.as_slice() } else { &[] };
    let vectors = fields.iter().filter(|(_, value)| value.as_vector3().is_some());
    let deeper = vectors.filter_map(|(name, _)| sibling(path, 0, name));
    Fault::NoVector { kind: found.kind(), fits: deeper.map(|p| p.to_string()).collect() }
}

/// Where a message may keep the covariance of the vector at `path`: `pose.covariance` for `pose.pose.position`,
/// `position_covariance` beside `position`, `pose_covariance` beside the `pose` of `pose.position`,
/// `velocity_covariance` beside `linear_velocity`, and `position_covariance` in a fix.
fn covariances(path: &MessagePath) -> Vec<MessagePath> {
    let own_name = match path.steps.last() {
        Some(Step::Field(name)) => Some(format!("{name}_covariance")),
        _ => None,
    };
    let of_parent = match path.steps.iter().rev().nth(1) {
        Some(Step::Field(name)) => sibling(path, 2, &format!("{name}_covariance")),
        _ => None,
    };
    let of_velocity = own_name.as_deref() == Some("linear_velocity_covariance");
    let places = [
        own_name.and_then(|name| sibling(path, 1, &name)),
        sibling(path, 2, "covariance"),
        of_parent,
        of_velocity.then(|| sibling(path, 1, "velocity_covariance")).flatten(),
        sibling(path, 0, "position_covariance").filter(|_| path.steps.is_empty()),
    ];
    places.into_iter().flatten().collect()
}

/// The path with its last `up` steps replaced by the field `name`; `None` where it has fewer.
fn sibling(path: &MessagePath, up: usize, name: &str) -> Option<MessagePath> {
    let keep = path.steps.len().checked_sub(up)?;
    let mut steps = path.steps[..keep].to_vec();
    steps.push(Step::Field(name.to_owned()));
    Some(MessagePath { topic: path.topic.clone(), steps })
}

/// The first three variances of a 3x3 or 6x6 matrix by rows; `None` where they are not all positive, which
/// is how messages say that they don't know.
fn diagonal(matrix: &[f64]) -> Option<[f64; 3]> {
    let stride = match matrix.len() {
        9 => 4,
        36 => 7,
        _ => return None,
    };
    let variances = [matrix[0], matrix[stride], matrix[2 * stride]];
    variances.iter().all(|v| *v > 0.0 && v.is_finite()).then_some(variances)
}

/// The turn by a quaternion of unit length, body to world.
fn rotation(orientation: &Value) -> Option<impl Fn([f64; 3]) -> [f64; 3] + use<>> {
    let part = |name| orientation.field(name)?.as_f64();
    let (x, y, z, w) = (part("x")?, part("y")?, part("z")?, part("w")?);
    let unit = (x * x + y * y + z * z + w * w - 1.0).abs() < 0.02;
    unit.then(|| {
        let q = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
        move |v: [f64; 3]| (q * nalgebra::Vector3::from(v)).into()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(text: &str) -> MessagePath {
        MessagePath::parse(text).expect("a path")
    }

    #[test]
    fn covariances_are_looked_for_where_the_usual_messages_keep_them() {
        let found: Vec<String> =
            covariances(&path("/odom.pose.pose.position")).iter().map(ToString::to_string).collect();
        assert_eq!(
            found,
            ["/odom.pose.pose.position_covariance", "/odom.pose.covariance", "/odom.pose.pose_covariance"]
        );
        let found = |text: &str| covariances(&path(text)).iter().map(ToString::to_string).collect::<Vec<_>>();
        assert_eq!(found("/t.position"), ["/t.position_covariance"]);
        assert!(found("/t.pose.position").contains(&"/t.pose_covariance".to_owned()));
        assert!(found("/t.linear_velocity").contains(&"/t.velocity_covariance".to_owned()));
        assert_eq!(found("/fix"), ["/fix.position_covariance"]);
    }

    #[test]
    fn a_covariance_of_zeros_or_of_another_size_says_nothing() {
        let mut matrix = vec![0.0; 36];
        assert_eq!(diagonal(&matrix), None);
        (matrix[0], matrix[7], matrix[14]) = (1.0, 4.0, 9.0);
        assert_eq!(diagonal(&matrix), Some([1.0, 4.0, 9.0]));
        assert_eq!(diagonal(&matrix[..35]), None);
    }

    #[test]
    fn a_quarter_turn_about_the_vertical_turns_forward_into_left() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let value = |w: f64| {
            Value::Object(vec![
                ("x".into(), Value::Float(0.0)),
                ("y".into(), Value::Float(0.0)),
                ("z".into(), Value::Float(half)),
                ("w".into(), Value::Float(w)),
            ])
        };
        let turned = rotation(&value(half)).expect("unit length")([1.0, 0.0, 0.5]);
        assert!(
            (turned[0]).abs() < 1e-12 && (turned[1] - 1.0).abs() < 1e-12 && (turned[2] - 0.5).abs() < 1e-12
        );
        assert!(rotation(&value(0.0)).is_none());
    }
}
