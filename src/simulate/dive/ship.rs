//! The ship above a dive: where it is, what it says of that, and how it sees the vehicle.
//!
//! With the vehicle at (e, n, u) from the transducer and the ship's heading h, clockwise from north:
//!
//! ```text
//! range = |(e, n, u)|,    bearing = atan2(e, n) - h,    depression = atan2(-u, |(e, n)|)              (1)
//! ```

use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

use super::scenario::{MessagesScenario, ShipScenario};

/// Where the ship is and where its bow points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShipState {
    /// When, s after release.
    pub time_s: f64,
    /// Of its transducer, ENU, m.
    pub position: Vector3<f64>,
    /// Clockwise from north, rad, 0 to 2 pi.
    pub heading_rad: f64,
}

/// The vehicle, seen from the ship.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenPolar {
    /// Slant range, m.
    pub range_m: f64,
    /// Clockwise from the bow, rad, 0 to 2 pi.
    pub bearing_rad: f64,
    /// Downwards from the horizontal, rad, to pi / 2.
    pub depression_rad: f64,
}

impl ShipScenario {
    /// Where the ship truly is.
    pub(super) fn at(&self, time_s: f64) -> ShipState {
        let along_rad = self.speed_m_s / self.radius_m * time_s;
        let (sin, cos) = along_rad.sin_cos();
        ShipState {
            time_s,
            position: Vector3::new(self.radius_m * sin, self.radius_m * cos, -self.transducer_depth_m),
            heading_rad: (along_rad + 0.5 * PI).rem_euclid(TAU),
        }
    }

    /// What it says of that, from time to time.
    pub(super) fn navigation(&self, end_s: f64, rng: &mut impl Rng) -> Vec<ShipState> {
        let heading_sigma_rad = self.heading_sigma_deg.to_radians();
        let mut measured = |time_s| {
            let truth = self.at(time_s);
            let noise = Vector3::from_fn(|_, _| StandardNormal.sample(rng)) * self.position_sigma_m;
            let turned: f64 = StandardNormal.sample(rng);
            ShipState {
                position: truth.position + noise,
                heading_rad: (truth.heading_rad + heading_sigma_rad * turned).rem_euclid(TAU),
                ..truth
            }
        };
        (0..=(end_s * self.rate_hz) as u64).map(|k| measured(k as f64 / self.rate_hz)).collect()
    }
}

/// The vehicle as the ship sees it, with noise.
pub(super) fn seen_from(
    ship: &ShipState,
    vehicle: Vector3<f64>,
    noise: &MessagesScenario,
    rng: &mut impl Rng,
) -> SeenPolar {
    let [range, bearing, depression] = [0, 1, 2].map(|_| -> f64 { StandardNormal.sample(rng) });
    let angle_sigma_rad = noise.angle_sigma_deg.to_radians();
    let from_ship = vehicle - ship.position;
    let level_m = from_ship.x.hypot(from_ship.y);
    // (1)
    let range_m = from_ship.norm() + noise.range_sigma_m * range;
    let mut bearing_rad = from_ship.x.atan2(from_ship.y) - ship.heading_rad + angle_sigma_rad * bearing;
    let mut depression_rad = (-from_ship.z).atan2(level_m) + angle_sigma_rad * depression;
    if depression_rad > 0.5 * PI {
        // past straight down: on the other side
        (bearing_rad, depression_rad) = (bearing_rad + PI, PI - depression_rad);
    }
    SeenPolar { range_m: range_m.max(0.0), bearing_rad: bearing_rad.rem_euclid(TAU), depression_rad }
}
