//! What messages are made of: instants, vectors and poses as JSON, with no more digits than anyone needs.

use serde::Serialize;

use crate::time::Time;

#[derive(Clone, Copy, Serialize)]
pub(super) struct Stamp {
    sec: i64,
    nsec: u32,
}

impl From<Time> for Stamp {
    fn from(time: Time) -> Self {
        let (sec, nsec) = time.to_stamp();
        Self { sec, nsec }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Xyz {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) z: f64,
}

impl From<[f64; 3]> for Xyz {
    fn from([x, y, z]: [f64; 3]) -> Self {
        Self { x, y, z }
    }
}

#[derive(Serialize)]
struct Quaternion {
    x: f64,
    y: f64,
    z: f64,
    w: f64,
}

/// A position without an attitude: none is claimed.
#[derive(Serialize)]
pub(super) struct Pose {
    position: Xyz,
    orientation: Quaternion,
}

impl Pose {
    pub(super) fn at(position: Xyz) -> Self {
        Self { position, orientation: Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 } }
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

/// The message as JSON.
pub(super) fn json(message: &impl Serialize) -> Vec<u8> {
    // a struct of numbers and text always is JSON
    serde_json::to_vec(message).unwrap_or_default()
}

/// The frame that viewers draw in when the log names none: they draw nothing without a name. No sensor's
/// frame is called that, and [`crate::track::Track::frame_id`] stays empty.
const UNNAMED: &str = "unnamed";

/// The frame of what is only there to be drawn.
pub(super) fn drawn_in(frame_id: &str) -> &str {
    if frame_id.is_empty() { UNNAMED } else { frame_id }
}
