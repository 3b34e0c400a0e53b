//! The result as new channels of the log: which topics there are, and what their messages say.
//!
//! One file a kind of message. What is measured or estimated bears the frame that the log names, and none where
//! it names none; what is only there to be drawn (`scene`, `pose`) is then in a frame called `unnamed`, since
//! viewers draw nothing without a frame.

mod event;
mod fields;
mod log;
mod point;
mod pose;
mod residual;
mod scene;

pub use point::track_messages;
pub(crate) use scene::phase_color;

use event::event_message;
use log::log_messages;
use pose::pose_messages;
use residual::residual_messages;
use scene::scene_message;

use crate::fusion::Fusion;
use crate::log::NewChannel;
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
}

impl Topic {
    /// All of them.
    pub const ALL: [Self; 7] =
        [Self::Track, Self::Pcf, Self::Events, Self::Residuals, Self::Scene, Self::Pose, Self::Log];

    /// The channel under `prefix`.
    #[must_use]
    pub fn channel(self, prefix: &str) -> NewChannel {
        macro_rules! schema {
            ($name:literal) => {
                ($name, include_str!(concat!("../../schemas/", $name, ".schema.json")))
            };
        }
        let (name, (schema_name, schema)) = match self {
            Self::Track => ("track", schema!("trackfuse.TrackPoint")),
            Self::Pcf => ("pcf", schema!("trackfuse.TrackPoint")),
            Self::Events => ("events", schema!("trackfuse.CharacteristicPoint")),
            Self::Residuals => ("residuals", schema!("trackfuse.Residual")),
            Self::Scene => ("scene", schema!("foxglove.SceneUpdate")),
            Self::Pose => ("pose", schema!("foxglove.PoseInFrame")),
            Self::Log => ("log", schema!("foxglove.Log")),
        };
        NewChannel::json(&format!("{prefix}/{name}"), schema_name, schema)
    }
}

/// A message of a new channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Published {
    /// Its channel.
    pub topic: Topic,
    /// Its instant.
    pub time: Time,
    /// Its payload, JSON.
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
}

/// All new messages in order of time, the scene first; the summary stands at the track's first instant.
pub fn messages<'a>(
    fusion: &'a Fusion,
    context: Context<'a>,
    text: &str,
    warnings: &[String],
) -> impl Iterator<Item = Published> + 'a {
    let frame = fusion.track.frame_id.as_str();
    let start = fusion.track.points.first().map_or(context.t0, |p| p.time);
    // A viewer draws the latest message before its cursor: the scene stands where the log begins, so that it is
    // there from the first instant on, and never earlier, so that the time line doesn't grow.
    let scene = scene_message(fusion, &context, context.log_start.map_or(start, |t| t.min(start)));
    let head = std::iter::once(scene).chain(log_messages(text, warnings, start));
    let events = fusion.events.iter().filter_map(|e| event_message(e, frame, &context));
    let mut events: Vec<Published> = events.collect();
    events.sort_by_key(|e| e.time);
    let streams: [Box<dyn Iterator<Item = Published> + 'a>; 5] = [
        Box::new(track_messages(Topic::Track, &fusion.track, context)),
        Box::new(track_messages(Topic::Pcf, &fusion.plain_pcf, context)),
        Box::new(events.into_iter()),
        Box::new(residual_messages(&fusion.residuals, frame, context)),
        Box::new(pose_messages(&fusion.track)),
    ];
    let mut streams = streams.map(Iterator::peekable);
    head.chain(std::iter::from_fn(move || {
        let next = (0..streams.len()).filter_map(|i| Some((streams[i].peek()?.time, i))).min()?;
        streams[next.1].next()
    }))
}
