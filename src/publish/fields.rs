//! What messages are made of: instants, vectors and poses, with no more digits than anyone needs.

use serde::Serialize;

use crate::time::Time;

/// `google.protobuf.Timestamp` where it is not JSON.
#[derive(Clone, Copy, PartialEq, prost::Message, Serialize)]
pub(crate) struct Stamp {
    #[prost(int64, tag = "1")]
    pub(super) sec: i64,
    #[prost(int32, tag = "2")]
    pub(super) nsec: i32,
}

impl Stamp {
    pub(crate) fn of(time: Time) -> Self {
        let (sec, nsec) = time.to_stamp();
        Self { sec, nsec: nsec.cast_signed() }
    }
}

#[derive(Clone, Copy, PartialEq, prost::Message, Serialize)]
pub(crate) struct Xyz {
    #[prost(double, tag = "1")]
    pub(super) x: f64,
    #[prost(double, tag = "2")]
    pub(super) y: f64,
    #[prost(double, tag = "3")]
    pub(super) z: f64,
}

impl From<[f64; 3]> for Xyz {
    fn from([x, y, z]: [f64; 3]) -> Self {
        Self { x, y, z }
    }
}

impl From<Xyz> for [f64; 3] {
    fn from(v: Xyz) -> Self {
        [v.x, v.y, v.z]
    }
}

#[derive(Clone, Copy, PartialEq, prost::Message, Serialize)]
struct Quaternion {
    #[prost(double, tag = "1")]
    x: f64,
    #[prost(double, tag = "2")]
    y: f64,
    #[prost(double, tag = "3")]
    z: f64,
    #[prost(double, tag = "4")]
    w: f64,
}

/// A position without an attitude: none is claimed.
#[derive(Clone, Copy, PartialEq, prost::Message, Serialize)]
pub(super) struct Pose {
    #[prost(message, optional, tag = "1")]
    pub(super) position: Option<Xyz>,
    #[prost(message, optional, tag = "2")]
    orientation: Option<Quaternion>,
}

impl Pose {
    pub(super) fn at(position: Xyz) -> Self {
        let level = Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 };
        Self { position: Some(position), orientation: Some(level) }
    }
}

/// To the micrometre (and its second's fractions): below every sensor, and half the bytes.
pub(super) fn micro(v: f64) -> f64 {
    (v * 1e6).round() / 1e6
}

/// The vector to the micrometre.
pub(super) fn xyz(v: [f64; 3]) -> Option<Xyz> {
    rounded(v, 1e6)
}

/// The vector to the millimetre: a picture needs no more.
pub(super) fn milli(v: [f64; 3]) -> Option<Xyz> {
    rounded(v, 1e3)
}

/// The vector with so many parts to the unit, or `None` where a component is not finite: such a field is left out.
pub(super) fn rounded(v: [f64; 3], parts: f64) -> Option<Xyz> {
    let v = v.map(|c| (c * parts).round() / parts);
    v.iter().all(|c| c.is_finite()).then(|| v.into())
}

/// Seconds to nanoseconds; `None` where not finite.
pub(super) fn nano(v: f64) -> Option<f64> {
    v.is_finite().then(|| (v * 1e9).round() / 1e9)
}

/// The frame that viewers draw in when the log names none: they draw nothing without a name. No sensor's
/// frame is called that, and [`crate::track::Track::frame_id`] stays empty.
const UNNAMED: &str = "unnamed";

/// The frame of what is only there to be drawn.
pub(super) fn drawn_in(frame_id: &str) -> &str {
    if frame_id.is_empty() { UNNAMED } else { frame_id }
}
