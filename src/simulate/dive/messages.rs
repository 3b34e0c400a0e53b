//! What the log gets of the fixes: as positions or as they were measured, some of them late, some twice.

use nalgebra::Vector3;
use rand::{Rng, RngExt};

use super::UsblRecord;
use super::scenario::{DiveScenario, FixesAs};
use super::ship::{SeenPolar, seen_from};

/// A fix as the recorder got it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FixMessage {
    /// When it was taken, s after release.
    pub stamp_s: f64,
    /// When the recorder received it, s after release.
    pub receive_s: f64,
    /// What it says.
    pub seen: Seen,
    /// Whether more than noise moved it.
    pub wild: bool,
    /// Whether it was held up.
    pub late: bool,
    /// Whether it is the message before it once more.
    pub repeated: bool,
}

/// What a fix says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Seen {
    /// A position, ENU, m.
    Position(Vector3<f64>),
    /// What was measured from the ship.
    Polar(SeenPolar),
}

/// The messages of a record in the order of their stamps. `arrival` says which are late or repeated, `noise` is of polar
/// measurements, whose record has none.
pub(super) fn messages(
    record: &UsblRecord,
    scenario: &DiveScenario,
    arrival: &mut impl Rng,
    noise: &mut impl Rng,
) -> Vec<FixMessage> {
    let asked = &scenario.messages;
    let mut messages = Vec::with_capacity(record.fixes.len());
    for fix in &record.fixes {
        let stamp_s = fix.sample.time_s;
        let position = Vector3::from(fix.sample.value);
        let seen = match asked.fixes_as {
            FixesAs::Polar => Seen::Polar(seen_from(&scenario.ship.at(stamp_s), position, asked, noise)),
            FixesAs::Xyz | FixesAs::Geodetic => Seen::Position(position),
        };
        // four numbers a fix, so that a change of one share leaves the other's draws as they were
        let [late, how_late, repeated, once_more_s] = [0; 4].map(|_| arrival.random::<f64>());
        let late = late < asked.late_share;
        let held_up_s =
            if late { asked.late_s[0] + (asked.late_s[1] - asked.late_s[0]) * how_late } else { 0.0 };
        let receive_s = stamp_s + asked.latency_s + held_up_s;
        let message = FixMessage { stamp_s, receive_s, seen, wild: fix.wild, late, repeated: false };
        messages.push(message);
        if repeated < asked.repeated_share {
            messages.push(FixMessage { receive_s: receive_s + once_more_s, repeated: true, ..message });
        }
    }
    messages
}
