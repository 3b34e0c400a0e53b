//! The parts of a `foxglove.SceneUpdate`, as far as they are used here.

use serde::Serialize;

use super::super::fields::{Pose, Stamp, Xyz};
use super::super::payload::Payload;
use super::super::ros;

#[derive(Serialize, prost::Message)]
pub(in crate::publish) struct SceneUpdate {
    #[prost(message, repeated, tag = "1")]
    pub(super) deletions: Nothing,
    #[prost(message, repeated, tag = "2")]
    pub(in crate::publish) entities: Vec<Entity>,
}

impl Payload for SceneUpdate {
    type Ros = ros::MarkerArray;
}

/// A list that stays empty. A viewer wants all lists to be there.
type Nothing = Vec<()>;

/// No end.
#[derive(Serialize, prost::Message)]
struct Lifetime {
    #[prost(int64, tag = "1")]
    sec: i64,
    #[prost(int32, tag = "2")]
    nsec: i32,
}

#[derive(Serialize, prost::Message)]
pub(super) struct KeyValue {
    #[prost(string, tag = "1")]
    pub(super) key: String,
    #[prost(string, tag = "2")]
    pub(super) value: String,
}

#[derive(Serialize, prost::Message)]
pub(in crate::publish) struct Entity {
    #[prost(message, optional, tag = "1")]
    pub(in crate::publish) timestamp: Option<Stamp>,
    #[prost(string, tag = "2")]
    pub(in crate::publish) frame_id: String,
    #[prost(string, tag = "3")]
    pub(in crate::publish) id: String,
    #[prost(message, optional, tag = "4")]
    lifetime: Option<Lifetime>,
    #[prost(bool, tag = "5")]
    frame_locked: bool,
    /// What a viewer shows of an entity that is clicked.
    #[prost(message, repeated, tag = "6")]
    pub(super) metadata: Vec<KeyValue>,
    #[prost(message, repeated, tag = "7")]
    arrows: Nothing,
    #[prost(message, repeated, tag = "8")]
    cubes: Nothing,
    #[prost(message, repeated, tag = "9")]
    pub(in crate::publish) spheres: Vec<Sphere>,
    #[prost(message, repeated, tag = "10")]
    cylinders: Nothing,
    #[prost(message, repeated, tag = "11")]
    pub(in crate::publish) lines: Vec<Line>,
    #[prost(message, repeated, tag = "12")]
    triangles: Nothing,
    #[prost(message, repeated, tag = "13")]
    pub(in crate::publish) texts: Vec<Label>,
    #[prost(message, repeated, tag = "14")]
    models: Nothing,
}

impl Entity {
    /// An entity that stays, with nothing in it.
    pub(super) fn new(id: impl Into<String>, frame_id: &str, timestamp: Stamp) -> Self {
        Self {
            timestamp: Some(timestamp),
            frame_id: frame_id.to_owned(),
            id: id.into(),
            lifetime: Some(Lifetime::default()),
            frame_locked: true,
            ..Self::default()
        }
    }
}

#[derive(Clone, Copy, PartialEq, prost::Message, Serialize)]
pub(in crate::publish) struct Color {
    #[prost(double, tag = "1")]
    pub(in crate::publish) r: f64,
    #[prost(double, tag = "2")]
    pub(in crate::publish) g: f64,
    #[prost(double, tag = "3")]
    pub(in crate::publish) b: f64,
    #[prost(double, tag = "4")]
    pub(in crate::publish) a: f64,
}

impl Color {
    /// From bytes.
    pub(super) fn rgb([r, g, b]: [u8; 3]) -> Self {
        let part = |byte: u8| (f64::from(byte) / 2.55).round() / 100.0;
        Self { r: part(r), g: part(g), b: part(b), a: 1.0 }
    }

    pub(super) fn with_alpha(self, a: f64) -> Self {
        Self { a, ..self }
    }
}

#[derive(Serialize, prost::Message)]
pub(in crate::publish) struct Sphere {
    #[prost(message, optional, tag = "1")]
    pub(in crate::publish) pose: Option<Pose>,
    /// Diameters, m.
    #[prost(message, optional, tag = "2")]
    pub(in crate::publish) size: Option<Xyz>,
    #[prost(message, optional, tag = "3")]
    pub(in crate::publish) color: Option<Color>,
}

#[derive(Serialize, prost::Message)]
pub(in crate::publish) struct Line {
    #[serde(rename = "type")]
    #[prost(int32, tag = "1")]
    kind: i32,
    #[prost(message, optional, tag = "2")]
    pub(in crate::publish) pose: Option<Pose>,
    #[prost(double, tag = "3")]
    pub(in crate::publish) thickness: f64,
    #[prost(bool, tag = "4")]
    scale_invariant: bool,
    #[prost(message, repeated, tag = "5")]
    pub(in crate::publish) points: Vec<Xyz>,
    #[prost(message, optional, tag = "6")]
    pub(in crate::publish) color: Option<Color>,
    #[prost(message, repeated, tag = "7")]
    colors: Nothing,
    #[prost(fixed32, repeated, tag = "8")]
    indices: Vec<u32>,
}

/// `foxglove.LineType`: each point is joined to the next.
const LINE_STRIP: i32 = 0;

impl Line {
    /// A line through `points`, which count from `anchor`.
    pub(super) fn strip(anchor: Xyz, points: Vec<Xyz>, thickness_px: f64, color: Color) -> Self {
        Self {
            kind: LINE_STRIP,
            pose: Some(Pose::at(anchor)),
            thickness: thickness_px,
            scale_invariant: true,
            points,
            color: Some(color),
            ..Self::default()
        }
    }
}

/// A `foxglove.TextPrimitive`.
#[derive(Serialize, prost::Message)]
pub(in crate::publish) struct Label {
    #[prost(message, optional, tag = "1")]
    pub(in crate::publish) pose: Option<Pose>,
    #[prost(bool, tag = "2")]
    billboard: bool,
    #[prost(double, tag = "3")]
    pub(in crate::publish) font_size: f64,
    #[prost(bool, tag = "4")]
    scale_invariant: bool,
    #[prost(message, optional, tag = "5")]
    pub(in crate::publish) color: Option<Color>,
    #[prost(string, tag = "6")]
    pub(in crate::publish) text: String,
}

impl Label {
    /// A text that faces the viewer, whatever it looks from.
    pub(super) fn facing(at: Xyz, text: &str, font_size_px: f64, color: Color) -> Self {
        Self {
            pose: Some(Pose::at(at)),
            billboard: true,
            font_size: font_size_px,
            scale_invariant: true,
            color: Some(color),
            text: text.to_owned(),
        }
    }
}
