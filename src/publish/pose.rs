//! `foxglove.PoseInFrame`: the moving point, one message a point of the track, so that it plays.

use serde::Serialize;

use super::fields::{Pose, Stamp, drawn_in, json, xyz};
use super::{Published, Topic};
use crate::track::Track;

#[derive(Serialize)]
struct PoseMessage<'a> {
    timestamp: Stamp,
    frame_id: &'a str,
    pose: Pose,
}

/// The messages of a track's points.
pub(super) fn pose_messages(track: &Track) -> impl Iterator<Item = Published> {
    track.points.iter().filter_map(|point| {
        let data = json(&PoseMessage {
            timestamp: point.time.into(),
            frame_id: drawn_in(&track.frame_id),
            pose: Pose::at(xyz(point.state.position)?),
        });
        Some(Published { topic: Topic::Pose, time: point.time, data })
    })
}
