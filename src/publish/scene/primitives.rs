//! The parts of a `foxglove.SceneUpdate`, as far as they are used here.

use serde::Serialize;

use super::super::fields::{Pose, Stamp, Xyz};

#[derive(Serialize)]
pub(super) struct SceneUpdate<'a> {
    pub(super) deletions: Nothing,
    pub(super) entities: Vec<Entity<'a>>,
}

/// An empty list. A viewer wants all lists to be there.
pub(super) type Nothing = [(); 0];

/// No end.
#[derive(Serialize)]
pub(super) struct Lifetime {
    sec: i32,
    nsec: u32,
}

#[derive(Serialize)]
pub(super) struct KeyValue {
    pub(super) key: String,
    pub(super) value: String,
}

#[derive(Serialize)]
pub(super) struct Entity<'a> {
    timestamp: Stamp,
    frame_id: &'a str,
    id: String,
    lifetime: Lifetime,
    frame_locked: bool,
    /// What a viewer shows of an entity that is clicked.
    pub(super) metadata: Vec<KeyValue>,
    arrows: Nothing,
    cubes: Nothing,
    pub(super) spheres: Vec<Sphere>,
    cylinders: Nothing,
    pub(super) lines: Vec<Line>,
    triangles: Nothing,
    pub(super) texts: Vec<Label>,
    models: Nothing,
}

impl<'a> Entity<'a> {
    /// An entity that stays, with nothing in it.
    pub(super) fn new(id: impl Into<String>, frame_id: &'a str, timestamp: Stamp) -> Self {
        Self {
            timestamp,
            frame_id,
            id: id.into(),
            lifetime: Lifetime { sec: 0, nsec: 0 },
            frame_locked: true,
            metadata: Vec::new(),
            arrows: [],
            cubes: [],
            spheres: Vec::new(),
            cylinders: [],
            lines: Vec::new(),
            triangles: [],
            texts: Vec::new(),
            models: [],
        }
    }
}

#[derive(Clone, Copy, Serialize)]
pub(super) struct Color {
    r: f64,
    g: f64,
    b: f64,
    a: f64,
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

#[derive(Serialize)]
pub(super) struct Sphere {
    pub(super) pose: Pose,
    /// Diameters, m.
    pub(super) size: Xyz,
    pub(super) color: Color,
}

#[derive(Serialize)]
pub(super) struct Line {
    #[serde(rename = "type")]
    kind: u8,
    pose: Pose,
    thickness: f64,
    scale_invariant: bool,
    points: Vec<Xyz>,
    color: Color,
    colors: Nothing,
    indices: Nothing,
}

/// `foxglove.LineType`: each point is joined to the next.
const LINE_STRIP: u8 = 0;

impl Line {
    /// A line through `points`, which count from `anchor`.
    pub(super) fn strip(anchor: Xyz, points: Vec<Xyz>, thickness_px: f64, color: Color) -> Self {
        Self {
            kind: LINE_STRIP,
            pose: Pose::at(anchor),
            thickness: thickness_px,
            scale_invariant: true,
            points,
            color,
            colors: [],
            indices: [],
        }
    }
}

/// A `foxglove.TextPrimitive`.
#[derive(Serialize)]
pub(super) struct Label {
    pose: Pose,
    billboard: bool,
    font_size: f64,
    scale_invariant: bool,
    color: Color,
    text: String,
}

impl Label {
    /// A text that faces the viewer, whatever it looks from.
    pub(super) fn facing(at: Xyz, text: &str, font_size_px: f64, color: Color) -> Self {
        Self {
            pose: Pose::at(at),
            billboard: true,
            font_size: font_size_px,
            scale_invariant: true,
            color,
            text: text.to_owned(),
        }
    }
}
