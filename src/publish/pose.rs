//! `foxglove.PoseInFrame`: the moving point, one message a point of the track, so that it plays.

use serde::Serialize;

use super::fields::{Pose, Stamp, drawn_in, xyz};
use super::payload::Payload;
use super::{Context, Published, Topic, ros};
use crate::track::Track;

#[derive(Serialize, prost::Message)]
pub(super) struct PoseMessage {
    #[prost(message, optional, tag = "1")]
    pub(super) timestamp: Option<Stamp>,
    #[prost(string, tag = "2")]
    pub(super) frame_id: String,
    #[prost(message, optional, tag = "3")]
    pub(super) pose: Option<Pose>,
}

impl Payload for PoseMessage {
    type Ros = ros::PoseStamped;
}

/// The messages of a track's points.
pub(super) fn pose_messages<'a>(
    track: &'a Track,
    context: Context<'a>,
) -> impl Iterator<Item = Published> + 'a {
    track.points.iter().filter_map(move |point| {
        let message = PoseMessage {
            timestamp: Some(Stamp::of(point.time)),
            frame_id: drawn_in(&track.frame_id).to_owned(),
            pose: Some(Pose::at(xyz(point.state.position)?)),
        };
        Some(context.publish(Topic::Pose, point.time, message))
    })
}
