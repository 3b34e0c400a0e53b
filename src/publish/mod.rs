//! The result as new channels of the log: which topics there are, and what their messages say.
//!
//! One file a kind of message; how it is encoded stands in `payload`, what ROS has for it in `ros`. What is measured
//! or estimated bears the frame that the log names, and none where it names none; what is only there to be drawn
//! (`scene`, `pose`) is then in a frame called `unnamed`, since viewers draw nothing without a frame.

mod event;
mod fields;
mod lines;
mod log;
mod map;
mod payload;
mod point;
mod pose;
mod residual;
mod ros;
mod scene;
mod usbl_fix;

pub(crate) use fields::{Stamp, Xyz};
pub use map::fix_messages;
pub(crate) use payload::cdr;
pub use point::track_messages;
pub use usbl_fix::usbl_fix_messages;

use event::event_message;
use fields::drawn_in;
use log::log_messages;
use map::geojson_message;
use payload::Payload;
use pose::pose_messages;
use residual::residual_messages;
use ros::{CHILD_FRAME, path_message};
use scene::scene_message;

use crate::fusion::Fusion;
use crate::log::{Encoding, NewChannel};
use crate::math::geodesy::LocalFrame;
use crate::sample::Source;
use crate::time::Time;

/// The new channels, in the order of their topics below.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topic {
    /// The fused track with its extrapolation.
    Track,
    /// The paper's plain extrapolation.
    Pcf,
    /// Characteristic points.
    Events,
    /// How far the sources' samples lie from the track.
    Residuals,
    /// The track, the sources and the characteristic points as a picture in space.
    Scene,
    /// The moving point.
    Pose,
    /// The summary and the warnings.
    Log,
    /// The whole track as a path, for ROS.
    Path,
    /// Latitude, longitude and altitude of the moving point, where the zero's are known.
    Fix,
    /// The track on a map, where the same is known.
    GeoJson,
    /// What a causal method said at every instant.
    Prediction,
    /// USBL fixes with what became of them.
    UsblFixes,
    /// The same as [`Self::Fix`], where a sensor's fixes bear that name.
    TrackFix,
}

impl Topic {
    /// Those of a fused track.
    pub const FUSED: [Self; 10] = [
        Self::Track,
        Self::Pcf,
        Self::Events,
        Self::Residuals,
        Self::Scene,
        Self::Pose,
        Self::Log,
        Self::Path,
        Self::Fix,
        Self::GeoJson,
    ];

    /// Those of a dive seen by USBL.
    pub const USBL: [Self; 9] = [
        Self::Track,
        Self::Prediction,
        Self::UsblFixes,
        Self::Scene,
        Self::Pose,
        Self::Log,
        Self::Path,
        Self::TrackFix,
        Self::GeoJson,
    ];

    /// Those of `topics` that there are in this encoding, of a track with or without a place on the earth.
    #[must_use]
    pub fn written(topics: &[Self], encoding: Encoding, has_place: bool) -> Vec<Self> {
        let is_written = |topic: &Self| match topic {
            Self::Path => encoding == Encoding::Cdr,
            Self::Fix | Self::TrackFix | Self::GeoJson => has_place,
            _ => true,
        };
        topics.iter().copied().filter(is_written).collect()
    }

    /// The channels of `topics` under `prefix`.
    #[must_use]
    pub fn channels(topics: &[Self], prefix: &str, encoding: Encoding) -> Vec<NewChannel> {
        topics.iter().map(|topic| topic.channel(prefix, encoding)).collect()
    }

    /// The channel under `prefix`.
    #[must_use]
    pub fn channel(self, prefix: &str, encoding: Encoding) -> NewChannel {
        macro_rules! schemas {
            ($own:literal, $ros:literal) => {
                Schemas {
                    name: $own,
                    json: include_str!(concat!("../../schemas/", $own, ".schema.json")),
                    protobuf: include_bytes!(concat!("../../schemas/protobuf/", $own, ".binpb")),
                    ..schemas!($ros)
                }
            };
            ($ros:literal) => {
                Schemas {
                    name: "",
                    json: "",
                    protobuf: b"",
                    ros_name: $ros,
                    ros: include_str!(concat!("../../schemas/ros2/", $ros, ".msg")),
                }
            };
        }
        let (name, schemas) = match self {
            Self::Track => ("track", schemas!("trackfuse.TrackPoint", "nav_msgs.Odometry")),
            Self::Pcf => ("pcf", schemas!("trackfuse.TrackPoint", "nav_msgs.Odometry")),
            Self::Events => {
                ("events", schemas!("trackfuse.CharacteristicPoint", "trackfuse_msgs.CharacteristicPoint"))
            }
            Self::Residuals => ("residuals", schemas!("trackfuse.Residual", "trackfuse_msgs.Residual")),
            Self::Prediction => ("prediction", schemas!("trackfuse.TrackPoint", "nav_msgs.Odometry")),
            Self::UsblFixes => ("fixes", schemas!("trackfuse.UsblFix", "trackfuse_msgs.UsblFix")),
            Self::Scene => ("scene", schemas!("foxglove.SceneUpdate", "visualization_msgs.MarkerArray")),
            Self::Pose => ("pose", schemas!("foxglove.PoseInFrame", "geometry_msgs.PoseStamped")),
            Self::Log => ("log", schemas!("foxglove.Log", "rcl_interfaces.Log")),
            Self::Path => ("path", schemas!("nav_msgs.Path")),
            Self::Fix => ("fix", schemas!("foxglove.LocationFix", "sensor_msgs.NavSatFix")),
            Self::TrackFix => ("track_fix", schemas!("foxglove.LocationFix", "sensor_msgs.NavSatFix")),
            Self::GeoJson => ("geojson", schemas!("foxglove.GeoJSON", "foxglove_msgs.GeoJSON")),
        };
        let topic = format!("{prefix}/{name}");
        match encoding {
            Encoding::Json => NewChannel::json(&topic, schemas.name, schemas.json),
            Encoding::Protobuf => NewChannel::protobuf(&topic, schemas.name, schemas.protobuf),
            Encoding::Cdr => NewChannel::ros2(&topic, &schemas.ros_name.replace('.', "/msg/"), schemas.ros),
        }
    }
}

/// What a channel's messages are called and made of in each encoding.
struct Schemas {
    name: &'static str,
    json: &'static str,
    protobuf: &'static [u8],
    ros_name: &'static str,
    ros: &'static str,
}

/// A message of a new channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Published {
    /// Its channel.
    pub topic: Topic,
    /// Its instant.
    pub time: Time,
    /// Its payload.
    pub data: Vec<u8>,
}

/// What the messages need beside the fusion.
#[derive(Clone, Copy, Debug)]
pub struct Context<'a> {
    /// The sources, by bit of [`crate::track::TrackPoint::seen_by`].
    pub sources: &'a [Source],
    /// The instant that samples and pieces count from.
    pub origin: Time,
    /// Points of the track a second.
    pub rate_hz: f64,
    /// T0.
    pub t0: Time,
    /// Whether z = 0 is the surface.
    pub surface_at_zero: bool,
    /// The log's first message, on the track's clock, where the log says.
    pub log_start: Option<Time>,
    /// What the messages are encoded in.
    pub encoding: Encoding,
    /// Where on the earth the track's frame stands, where that is known.
    pub geodetic: Option<LocalFrame>,
}

impl Context<'_> {
    fn publish(&self, topic: Topic, time: Time, message: impl Payload) -> Published {
        Published { topic, time, data: message.encode_as(self.encoding) }
    }
}

/// Messages in order of time.
pub type Stream<'a> = Box<dyn Iterator<Item = Published> + 'a>;

/// All new messages of the topics that are [`Topic::written`], in order of time, the pictures first; the summary stands at
/// the track's first instant. What an estimator has beside that comes in `more`, each in order of time.
pub fn messages<'a>(
    fusion: &'a Fusion,
    context: Context<'a>,
    text: &str,
    warnings: &[String],
    more: Vec<Stream<'a>>,
) -> impl Iterator<Item = Published> + 'a {
    let frame = fusion.track.frame_id.as_str();
    let start = fusion.track.points.first().map_or(context.t0, |p| p.time);
    // A viewer draws the latest message before its cursor: the pictures stand where the log begins, so that they
    // are there from the first instant on, and never earlier, so that the time line doesn't grow.
    let begin = context.log_start.map_or(start, |t| t.min(start));
    let path =
        (context.encoding == Encoding::Cdr).then(|| path_message(&fusion.track, drawn_in(frame), begin));
    let map = context.geodetic.map(|place| geojson_message(fusion, &context, &place, begin));
    let head = std::iter::once(scene_message(fusion, &context, begin)).chain(path).chain(map);
    let head = head.chain(log_messages(text, warnings, start, &context));
    let events = fusion.events.iter().filter_map(|e| event_message(e, frame, &context));
    let mut events: Vec<Published> = events.collect();
    events.sort_by_key(|e| e.time);
    let streams: [Stream<'a>; 5] = [
        Box::new(track_messages(Topic::Track, &fusion.track, context)),
        Box::new(track_messages(Topic::Pcf, &fusion.plain_pcf, context)),
        Box::new(events.into_iter()),
        Box::new(residual_messages(&fusion.residuals, frame, context)),
        Box::new(pose_messages(&fusion.track, context)),
    ];
    let mut streams: Vec<_> = streams.into_iter().chain(more).map(Iterator::peekable).collect();
    head.chain(std::iter::from_fn(move || {
        let next = (0..streams.len()).filter_map(|i| Some((streams[i].peek()?.time, i))).min()?;
        streams[next.1].next()
    }))
}
