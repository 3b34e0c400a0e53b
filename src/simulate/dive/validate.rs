//! Whether a dive's scenario makes sense, and stays within what a machine can hold.

use super::scenario::{DepthScenario, DiveScenario, MessagesScenario, ShipScenario};
use super::{DiveConstants, UsblConstants};
use crate::simulate::error::SimulateError;
use crate::simulate::validate::{MAX_SAMPLES, Table, epoch, sensor};

/// The longest dive, s: 28 hours.
const MAX_DURATION_S: f64 = 1e5;
/// The deepest, m: a little more than there is.
const MAX_DEPTH_M: f64 = 12_000.0;

impl DiveScenario {
    /// Checks that every number is in its range, and that together they don't ask for too much.
    ///
    /// # Errors
    ///
    /// [`SimulateError::OutOfRange`] with the key and its range, [`SimulateError::Reversed`] for a range
    /// whose ends are swapped, [`SimulateError::TooLarge`] for more messages than a log should hold.
    pub fn validate(&self) -> Result<(), SimulateError> {
        epoch(self.epoch_ns)?;
        let [latitude, longitude] = self.origin;
        Table("")
            .all_within(&[("origin[0]", latitude, -90.0, 90.0), ("origin[1]", longitude, -180.0, 180.0)])?;
        dive(&Table("dive"), &self.dive)?;
        let duration_s = self.dive.duration_s;
        usbl(&Table("usbl"), &self.usbl, duration_s)?;
        messages(&Table("messages"), &self.messages)?;
        ship(&Table("ship"), &self.ship, duration_s)?;
        depth(&Table("depth"), &self.depth, duration_s)?;
        sensor("reference", &self.reference, duration_s)
    }
}

fn dive(table: &Table, c: &DiveConstants) -> Result<(), SimulateError> {
    table.within("duration_s", c.duration_s, 60.0, MAX_DURATION_S)?;
    table.range("vertical_share", c.vertical_share, 0.05, 0.5)?;
    table.range("vertical_m_s", c.vertical_m_s, 0.05, 5.0)?;
    table.range("gliding_m_s", c.gliding_m_s, 0.0, 5.0)?;
    table.range("spiral_deg_s", c.spiral_deg_s, 0.0, 10.0)?;
    table.range("leg_m_s", c.leg_m_s, 0.0, 5.0)?;
    table.range("leg_s", c.leg_s, 10.0, MAX_DURATION_S)?;
    table.range("turn_deg", c.turn_deg, 0.0, 360.0)?;
    table.range("turn_deg_s", c.turn_deg_s, 0.1, 30.0)?;
    table.range("slope_m_s", c.slope_m_s, 0.0, 1.0)?;
    table.range("lag_s", c.lag_s, 5.0, 600.0)?;
    for (i, current_m_s) in c.current_m_s.into_iter().enumerate() {
        table.within(&format!("current_m_s[{i}]"), current_m_s, 0.0, 2.0)?;
    }
    table.within("current_s", c.current_s, 10.0, 1e6)?;
    let deepest_m = c.duration_s * c.vertical_share[1] * c.vertical_m_s[1];
    table.at_most("m of depth", deepest_m, MAX_DEPTH_M)
}

fn usbl(table: &Table, c: &UsblConstants, duration_s: f64) -> Result<(), SimulateError> {
    table.within("cycle_s", c.cycle_s, 0.1, duration_s)?;
    table.range("fixes", c.fixes.map(f64::from), 1.0, 1000.0)?;
    let most = f64::from(c.fixes[1]);
    table.all_within(&[
        // so that the last fix of an exchange comes before the first of the next
        ("jitter_s", c.jitter_s, 0.0, c.cycle_s / 12.0),
        ("spacing_s", c.spacing_s, 0.0, c.cycle_s / (2.0 * most)),
        ("sigma_m", c.sigma_m, 0.0, 1000.0),
        ("common_sigma_m", c.common_sigma_m, 0.0, 1000.0),
        ("wild_fixes", c.wild_fixes, 0.0, 1.0),
        ("wild_cycles", c.wild_cycles, 0.0, 1.0),
        ("lost_cycles", c.lost_cycles, 0.0, 1.0),
        ("silence_s", c.silence_s, 0.0, MAX_DURATION_S),
        ("silence_margin_s", c.silence_margin_s, 0.0, MAX_DURATION_S),
    ])?;
    table.range("wild_m", c.wild_m, 0.01, 1e5)?;
    table.at_most("fixes", duration_s / c.cycle_s * most, MAX_SAMPLES)
}

fn messages(table: &Table, messages: &MessagesScenario) -> Result<(), SimulateError> {
    table.all_within(&[
        ("range_sigma_m", messages.range_sigma_m, 0.0, 1000.0),
        ("angle_sigma_deg", messages.angle_sigma_deg, 0.0, 20.0),
        ("latency_s", messages.latency_s, 0.0, 60.0),
        ("late_share", messages.late_share, 0.0, 1.0),
        ("repeated_share", messages.repeated_share, 0.0, 1.0),
    ])?;
    table.range("late_s", messages.late_s, 0.0, 3600.0)
}

fn ship(table: &Table, ship: &ShipScenario, duration_s: f64) -> Result<(), SimulateError> {
    table.all_within(&[
        ("radius_m", ship.radius_m, 1.0, 1e5),
        ("speed_m_s", ship.speed_m_s, 0.0, 20.0),
        ("transducer_depth_m", ship.transducer_depth_m, 0.0, 100.0),
        ("rate_hz", ship.rate_hz, 0.01, 1000.0),
        ("position_sigma_m", ship.position_sigma_m, 0.0, 1000.0),
        ("heading_sigma_deg", ship.heading_sigma_deg, 0.0, 90.0),
    ])?;
    table.at_most("messages", duration_s * ship.rate_hz, MAX_SAMPLES)
}

fn depth(table: &Table, depth: &DepthScenario, duration_s: f64) -> Result<(), SimulateError> {
    table.all_within(&[("rate_hz", depth.rate_hz, 0.01, 1000.0), ("sigma_m", depth.sigma_m, 0.0, 1000.0)])?;
    table.at_most("messages", duration_s * depth.rate_hz, MAX_SAMPLES)
}
