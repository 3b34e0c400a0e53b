//! What each kind of message is in ROS 2: standard types, so that its tools draw, plot and filter them.
//!
//! The track is `nav_msgs/Odometry`, the picture `visualization_msgs/MarkerArray`, which RViz draws too.
//! Characteristic points and residuals, for which ROS has nothing, are types of our own: whoever reads by the
//! definitions in the log reads them, and `ros2 bag play` leaves out what it has no package for. What may be
//! missing is a list of at most one, as ROS has no field that can be left out. Fields stand in the order of the
//! definitions in `schemas/ros2`.

mod markers;

pub(super) use markers::MarkerArray;

use serde::Serialize;

use super::event::EventMessage;
use super::fields::{Pose, Stamp, Xyz};
use super::log::LogMessage;
use super::map::FixMessage;
use super::point::PointMessage;
use super::pose::PoseMessage;
use super::residual::ResidualMessage;
use super::usbl_fix::UsblFixMessage;
use super::{Published, Topic};
use crate::math::polyline::{Rank, Vertex, thin};
use crate::time::Time;
use crate::track::Track;

/// The frame that moves with the track's point. Its axes are the track's, so a velocity is the same in both.
pub(super) const CHILD_FRAME: &str = "fused";

/// `builtin_interfaces/Time`; past 2038 it stands still.
#[derive(Clone, Copy, Default, Serialize)]
struct RosTime {
    sec: i32,
    nanosec: u32,
}

impl From<Option<Stamp>> for RosTime {
    fn from(stamp: Option<Stamp>) -> Self {
        let Stamp { sec, nsec } = stamp.unwrap_or_default();
        Self { sec: sec.clamp(i32::MIN.into(), i32::MAX.into()) as i32, nanosec: nsec.unsigned_abs() }
    }
}

#[derive(Clone, Default, Serialize)]
struct Header {
    stamp: RosTime,
    frame_id: String,
}

impl Header {
    fn new(stamp: Option<Stamp>, frame_id: String) -> Self {
        Self { stamp: stamp.into(), frame_id }
    }
}

/// `geometry_msgs/Pose`: the orientation as x, y, z, w.
#[derive(Clone, Copy, Serialize)]
struct RosPose {
    position: [f64; 3],
    orientation: [f64; 4],
}

impl RosPose {
    fn at(position: Option<Xyz>) -> Self {
        Self { position: position.unwrap_or_default().into(), orientation: [0.0, 0.0, 0.0, 1.0] }
    }
}

impl From<Option<Pose>> for RosPose {
    fn from(pose: Option<Pose>) -> Self {
        Self::at(pose.and_then(|p| p.position))
    }
}

/// `nav_msgs/Odometry`.
#[derive(Serialize)]
pub(super) struct Odometry {
    header: Header,
    child_frame_id: &'static str,
    pose: RosPose,
    pose_covariance: Covariance,
    linear: [f64; 3],
    angular: [f64; 3],
    twist_covariance: Covariance,
}

/// Rows of a 6x6 matrix: three axes, then rotations about them.
type Covariance = [[f64; 6]; 6];

/// Variances on the diagonal, zeros where they are not known. That the rotation is not estimated at all is said as
/// `sensor_msgs/Imu` defines it: -1 in the first element of its block.
fn covariance(sigma: Option<Xyz>) -> Covariance {
    let mut matrix = [[0.0; 6]; 6];
    for (i, sigma) in <[f64; 3]>::from(sigma.unwrap_or_default()).into_iter().enumerate() {
        matrix[i][i] = sigma * sigma;
    }
    matrix[3][3] = -1.0;
    matrix
}

impl From<PointMessage> for Odometry {
    fn from(point: PointMessage) -> Self {
        Self {
            header: Header::new(point.timestamp, point.frame_id),
            child_frame_id: CHILD_FRAME,
            pose: RosPose::at(point.position),
            pose_covariance: covariance(point.position_sigma),
            linear: point.velocity.unwrap_or_default().into(),
            angular: [0.0; 3],
            twist_covariance: covariance(point.velocity_sigma),
        }
    }
}

/// `geometry_msgs/PoseStamped`.
#[derive(Serialize)]
pub(super) struct PoseStamped {
    header: Header,
    pose: RosPose,
}

impl From<PoseMessage> for PoseStamped {
    fn from(message: PoseMessage) -> Self {
        Self { header: Header::new(message.timestamp, message.frame_id), pose: message.pose.into() }
    }
}

/// `nav_msgs/Path`.
#[derive(Serialize)]
struct Path {
    header: Header,
    poses: Vec<PoseStamped>,
}

/// Most poses of a path.
const PATH_POSES: usize = 10_000;

/// The whole track as a path in `frame_id`, at `time`.
pub(super) fn path_message(track: &Track, frame_id: &str, time: Time) -> Published {
    let header = |time| Header::new(Some(Stamp::of(time)), frame_id.to_owned());
    let points = &track.points;
    let vertex = |i: usize| Vertex { position: points[i].state.position, rank: Rank::Inner, label: i };
    let poses = thin(points.len(), vertex, PATH_POSES).into_iter().filter_map(|vertex| {
        let point = &points[vertex.label];
        let position = super::fields::xyz(point.state.position)?;
        Some(PoseStamped { header: header(point.time), pose: RosPose::at(Some(position)) })
    });
    let path = Path { header: header(time), poses: poses.collect() };
    Published { topic: Topic::Path, time, data: super::payload::cdr(&path) }
}

/// `rcl_interfaces/Log`.
#[derive(Serialize)]
pub(super) struct Log {
    stamp: RosTime,
    level: u8,
    name: String,
    msg: String,
    file: String,
    function: &'static str,
    line: u32,
}

impl From<LogMessage> for Log {
    fn from(log: LogMessage) -> Self {
        Self {
            stamp: log.timestamp.into(),
            // foxglove.Log counts 1, 2, 3, ROS 10, 20, 30
            level: 10 * log.level.clamp(0, 5) as u8,
            name: log.name,
            msg: log.message,
            file: log.file,
            function: "",
            line: log.line,
        }
    }
}

/// `sensor_msgs/NavSatFix`.
#[derive(Serialize)]
pub(super) struct NavSatFix {
    header: Header,
    /// `STATUS_FIX`.
    status: i8,
    /// None of the satellite systems.
    service: u16,
    latitude: f64,
    longitude: f64,
    altitude: f64,
    position_covariance: [f64; 9],
    position_covariance_type: u8,
}

impl From<FixMessage> for NavSatFix {
    fn from(fix: FixMessage) -> Self {
        Self {
            header: Header::new(fix.timestamp, fix.frame_id),
            status: 0,
            service: 0,
            latitude: fix.latitude,
            longitude: fix.longitude,
            altitude: fix.altitude,
            position_covariance: fix.position_covariance.try_into().unwrap_or_default(),
            position_covariance_type: fix.position_covariance_type as u8,
        }
    }
}

/// A list of one vector, or of none.
fn if_known(v: Option<Xyz>) -> Vec<[f64; 3]> {
    v.into_iter().map(Into::into).collect()
}

/// `trackfuse_msgs/CharacteristicPoint`.
#[derive(Serialize)]
pub(super) struct CharacteristicPoint {
    header: Header,
    name: String,
    time_since_t0: f64,
    time_sigma: Vec<f64>,
    position: [f64; 3],
    velocity: [f64; 3],
    velocity_sigma: Vec<[f64; 3]>,
    phase: String,
}

impl From<EventMessage> for CharacteristicPoint {
    fn from(event: EventMessage) -> Self {
        Self {
            header: Header::new(event.timestamp, event.frame_id),
            name: event.name,
            time_since_t0: event.time_since_t0,
            time_sigma: event.time_sigma.into_iter().collect(),
            position: event.position.unwrap_or_default().into(),
            velocity: event.velocity.unwrap_or_default().into(),
            velocity_sigma: if_known(event.velocity_sigma),
            phase: event.phase,
        }
    }
}

/// `trackfuse_msgs/Residual`.
#[derive(Serialize)]
#[expect(clippy::struct_field_names, reason = "as in the definition")]
pub(super) struct Residual {
    header: Header,
    source: String,
    position_residual: Vec<[f64; 3]>,
    position_normalised: Vec<f64>,
    velocity_residual: Vec<[f64; 3]>,
    velocity_normalised: Vec<f64>,
    phase: String,
}

impl From<ResidualMessage> for Residual {
    fn from(residual: ResidualMessage) -> Self {
        Self {
            header: Header::new(residual.timestamp, residual.frame_id),
            source: residual.source,
            position_residual: if_known(residual.position_residual),
            position_normalised: residual.position_normalised.into_iter().collect(),
            velocity_residual: if_known(residual.velocity_residual),
            velocity_normalised: residual.velocity_normalised.into_iter().collect(),
            phase: residual.phase,
        }
    }
}

/// `trackfuse_msgs/UsblFix`.
#[derive(Serialize)]
pub(super) struct UsblFix {
    header: Header,
    position: [f64; 3],
    position_sigma: Vec<[f64; 3]>,
    verdict: String,
    reason: String,
    late: bool,
    exchange: u32,
    position_residual: Vec<[f64; 3]>,
    position_normalised: Vec<f64>,
}

impl From<UsblFixMessage> for UsblFix {
    fn from(fix: UsblFixMessage) -> Self {
        Self {
            header: Header::new(fix.timestamp, fix.frame_id),
            position: fix.position.unwrap_or_default().into(),
            position_sigma: if_known(fix.position_sigma),
            verdict: fix.verdict,
            reason: fix.reason,
            late: fix.late,
            exchange: fix.exchange,
            position_residual: if_known(fix.position_residual),
            position_normalised: fix.position_normalised.into_iter().collect(),
        }
    }
}
