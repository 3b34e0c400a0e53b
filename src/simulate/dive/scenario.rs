//! What dive to simulate: every number of a run, each with a default, read from TOML and written to it.

use serde::{Deserialize, Serialize};

use super::{DiveConstants, UsblConstants};
use crate::simulate::error::SimulateError;
use crate::simulate::scenario_file::read;
use crate::simulate::sensor_scenario::SensorScenario;

/// A dive to simulate. Same scenario, same log, to the byte.
///
/// Read it by [`DiveScenario::from_toml`]: there, a table's missing keys get that table's defaults.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DiveScenario {
    /// The run's name.
    pub name: String,
    /// What it is for, one sentence.
    pub description: String,
    /// Seed of everything random.
    pub seed: u64,
    /// The instant of release, ns since 1970; default 2024-11-07T17:20:00Z.
    pub epoch_ns: i64,
    /// Latitude and longitude of x = y = 0, degrees; of use where fixes are geodetic.
    pub origin: [f64; 2],
    /// The truth.
    pub dive: DiveConstants,
    /// What the USBL system hears.
    pub usbl: UsblConstants,
    /// What the log gets of it.
    pub messages: MessagesScenario,
    /// The ship above.
    pub ship: ShipScenario,
    /// The vehicle's depth sensor.
    pub depth: DepthScenario,
    /// The inertial reference: the truth at 1 Hz by default.
    pub reference: SensorScenario,
}

impl Default for DiveScenario {
    fn default() -> Self {
        Self {
            name: "dive".into(),
            description: String::new(),
            seed: 1,
            epoch_ns: 1_731_000_000_000_000_000,
            origin: [54.5, 10.25],
            dive: DiveConstants::default(),
            usbl: UsblConstants::default(),
            messages: MessagesScenario::default(),
            ship: ShipScenario::default(),
            depth: DepthScenario::default(),
            reference: SensorScenario {
                rate_hz: 1.0,
                position_sigma_m: 0.0,
                velocity_sigma_m_s: 0.0,
                latency_s: 0.001,
                latency_jitter_s: 0.0,
                ..SensorScenario::default()
            },
        }
    }
}

/// What a fix is given as.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FixesAs {
    /// East, north and up of the origin, m.
    #[default]
    Xyz,
    /// Range, bearing and depression, seen from the ship.
    Polar,
    /// Latitude, longitude and depth.
    Geodetic,
}

/// The USBL system's messages.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MessagesScenario {
    /// What a fix is given as.
    pub fixes_as: FixesAs,
    /// Polar only, in place of the noise an axis: standard deviation of the range, m.
    pub range_sigma_m: f64,
    /// Polar only: standard deviation of bearing and depression, degrees; by default 3 m at 1 km.
    pub angle_sigma_deg: f64,
    /// Time from a fix to its reception, s.
    pub latency_s: f64,
    /// Share of fixes that are received late, behind those that came after.
    pub late_share: f64,
    /// How much later, s, evenly.
    pub late_s: [f64; 2],
    /// Share of fixes that are received once more, within a second.
    pub repeated_share: f64,
}

impl Default for MessagesScenario {
    fn default() -> Self {
        Self {
            fixes_as: FixesAs::Xyz,
            range_sigma_m: 0.3,
            angle_sigma_deg: 0.17,
            latency_s: 0.2,
            late_share: 0.0,
            late_s: [5.0, 60.0],
            repeated_share: 0.0,
        }
    }
}

/// The ship: it circles about the origin, clockwise from north, as fast as it drifts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ShipScenario {
    /// Radius of the circle, m.
    pub radius_m: f64,
    /// Speed along it, m/s.
    pub speed_m_s: f64,
    /// How deep the transducer hangs, m.
    pub transducer_depth_m: f64,
    /// Messages a second.
    pub rate_hz: f64,
    /// Standard deviation of the position an axis, m.
    pub position_sigma_m: f64,
    /// Standard deviation of the heading, degrees.
    pub heading_sigma_deg: f64,
}

impl Default for ShipScenario {
    fn default() -> Self {
        Self {
            radius_m: 200.0,
            speed_m_s: 0.5,
            transducer_depth_m: 3.0,
            rate_hz: 1.0,
            position_sigma_m: 1.0,
            heading_sigma_deg: 0.1,
        }
    }
}

/// The depth sensor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DepthScenario {
    /// Whether the log has it.
    pub enabled: bool,
    /// Messages a second.
    pub rate_hz: f64,
    /// Standard deviation of the depth, m.
    pub sigma_m: f64,
}

impl Default for DepthScenario {
    fn default() -> Self {
        Self { enabled: true, rate_hz: 1.0, sigma_m: 0.3 }
    }
}

impl DiveScenario {
    /// Reads a scenario.
    ///
    /// # Errors
    ///
    /// [`SimulateError::Parse`] for text that isn't a scenario, with the line and the key; the errors of
    /// [`DiveScenario::validate`] for one that makes no sense.
    pub fn from_toml(text: &str) -> Result<Self, SimulateError> {
        let scenario: Self = read(text)?;
        scenario.validate()?;
        Ok(scenario)
    }

    /// The scenario as TOML, with every default written out.
    ///
    /// # Errors
    ///
    /// [`SimulateError::Serialize`] where the seed is past the integers of TOML.
    pub fn to_toml(&self) -> Result<String, SimulateError> {
        Ok(toml::to_string(self).map_err(Box::new)?)
    }
}
