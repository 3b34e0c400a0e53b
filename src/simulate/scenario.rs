//! What climb to simulate: every number of a run, each with a default, read from TOML and written to it.

use serde::{Deserialize, Serialize};

use super::climb_scenario::ClimbScenario;
use super::error::SimulateError;
use super::scenario_file::read;
use super::sensor_channel::SensorEncoding;
use super::sensor_scenario::{ErrorsScenario, SensorScenario};

/// A climb to simulate. Same scenario, same log, to the byte.
///
/// Read it by [`Scenario::from_toml`]: there, a sensor's missing keys get that sensor's defaults.
/// Deserialized by itself, every sensor table that is given in part would get the tether's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Scenario {
    /// The run's name.
    pub name: String,
    /// What it is for, one sentence.
    pub description: String,
    /// Seed of everything random.
    pub seed: u64,
    /// The instant of release, ns since 1970; default 2024-11-07T17:20:00Z.
    pub epoch_ns: i64,
    /// The truth.
    pub climb: ClimbScenario,
    /// The draw-wire gauge on the carrier: the datum, without systematic errors by default.
    pub tether: SensorScenario,
    /// The acoustic beacon.
    pub beacon: SensorScenario,
    /// The inertial reference: the truth at 100 Hz by default.
    pub reference: SensorScenario,
    /// What else the log holds.
    pub recording: RecordingScenario,
}

impl Default for Scenario {
    fn default() -> Self {
        let tether = SensorScenario::default();
        let beacon = SensorScenario {
            rate_hz: 50.0,
            position_sigma_m: 0.15,
            velocity_sigma_m_s: 0.15,
            latency_s: 0.060,
            latency_jitter_s: 0.030,
            errors: ErrorsScenario::of_a_beacon(),
            ..tether.clone()
        };
        let reference = SensorScenario {
            rate_hz: 100.0,
            position_sigma_m: 0.0,
            velocity_sigma_m_s: 0.0,
            latency_s: 0.001,
            latency_jitter_s: 0.0,
            ..tether.clone()
        };
        Self {
            name: "climb".into(),
            description: String::new(),
            seed: 1,
            epoch_ns: 1_731_000_000_000_000_000,
            climb: ClimbScenario::default(),
            tether,
            beacon,
            reference,
            recording: RecordingScenario::default(),
        }
    }
}

/// What the log holds beside the sensors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RecordingScenario {
    /// What the sensors' messages are encoded in. Without bystanders the log has the encoding's profile.
    #[serde(skip_serializing_if = "SensorEncoding::is_default")]
    pub encoding: SensorEncoding,
    /// How long before the release the recording begins, s.
    pub lead_s: f64,
    /// How long it goes on after T3, s.
    pub tail_s: f64,
    /// Whether there are channels of a sonar, of the ship's log, of the battery and of the ship's position.
    pub bystanders: bool,
    /// Sonar pings a second.
    pub sonar_rate_hz: f64,
    /// Size of one ping, bytes.
    pub sonar_bytes: u32,
    /// Size at which a chunk is closed, bytes before compression.
    pub chunk_bytes: u32,
}

impl Default for RecordingScenario {
    fn default() -> Self {
        Self {
            encoding: SensorEncoding::Json,
            lead_s: 5.0,
            tail_s: 5.0,
            bystanders: true,
            sonar_rate_hz: 8.0,
            sonar_bytes: 6000,
            chunk_bytes: 128 * 1024,
        }
    }
}

impl Scenario {
    /// Reads a scenario.
    ///
    /// # Errors
    ///
    /// [`SimulateError::Parse`] for text that isn't a scenario, with the line and the key; the errors of
    /// [`Scenario::validate`] for one that makes no sense.
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
