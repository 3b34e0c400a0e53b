//! What to simulate: every number of a run, each with a default, read from TOML and written to it.

use serde::{Deserialize, Serialize};

use super::climb::{ClimbConstants, Start};
use super::error::SimulateError;
use super::phases::{Frames, Phases};

/// A run to simulate. Same scenario, same log, to the byte.
///
/// Read it by [`Scenario::from_toml`]: there, a sensor's missing keys get that sensor's defaults. Deserialized by itself,
/// every sensor table that is given in part would get the tether's.
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

/// The shape of a climb: which numbers hold where the scenario gives none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Profile {
    /// Nearly upright: 3.7 s seen, 2 s unseen, about 17 m/s, from about 60 m.
    #[default]
    Steep,
    /// Shallow: 9 s seen, 5 s unseen, about 20 m/s.
    Oblique,
}

impl Profile {
    /// The profile's spacing of frames, s.
    #[must_use]
    pub fn frame_s(self) -> f64 {
        match self {
            Self::Steep => 0.02,
            Self::Oblique => 0.05,
        }
    }

    /// The profile's constants: of a vehicle with a short strong pulse, and of one with a long weak pulse.
    ///
    /// The modulation's frequency and the surface's force are guesses, held against recordings of another simulator.
    #[must_use]
    pub fn constants(self) -> ClimbConstants {
        match self {
            Self::Steep => ClimbConstants {
                thrust_m_s2: 10.9,
                ramp_s: 0.30,
                burn_s: 1.85,
                tail_s: 0.45,
                modulation: 0.10,
                modulation_hz: 1.0,
                drag_vertical_per_m: 0.020,
                drag_horizontal_per_m: 0.030,
                buoyancy_m_s2: 0.35,
                tilt_deg: 7.0,
                carrier_m_s: 3.0,
                random_m_s2: 0.35,
                random_low_hz: 0.25,
                random_high_hz: 1.3,
                surface_m_s2: 1.0,
                surface_depth_m: 8.0,
            },
            Self::Oblique => ClimbConstants {
                thrust_m_s2: 5.6,
                ramp_s: 0.8,
                burn_s: 4.6,
                tail_s: 1.1,
                modulation: 0.10,
                modulation_hz: 0.4,
                drag_vertical_per_m: 0.010,
                drag_horizontal_per_m: 0.010,
                buoyancy_m_s2: 0.25,
                tilt_deg: 70.0,
                carrier_m_s: 5.0,
                random_m_s2: 0.20,
                random_low_hz: 0.1,
                random_high_hz: 0.5,
                surface_m_s2: 1.0,
                surface_depth_m: 8.0,
            },
        }
    }
}

/// The truth's numbers; those not given are the profile's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ClimbScenario {
    /// The set of defaults.
    pub profile: Profile,
    /// How much the constants vary from seed to seed: 1 for 5 % (one sigma), 0 for not at all.
    pub vary: f64,
    /// The spacing of frames, s; default 0.02 (steep) or 0.05 (oblique).
    pub frame_s: Option<f64>,
    /// Frames seen by the tether alone.
    pub tether_frames: u32,
    /// Frames seen by both.
    pub overlap_frames: u32,
    /// Frames seen by the beacon alone.
    pub beacon_frames: u32,
    /// Frames seen by nobody.
    pub unseen_frames: u32,
    /// Where above 0, a time around T1 that nobody sees, in the overlap's place, s.
    pub gap_s: f64,
    /// The highest point up to T3, m: the depth of release is chosen so.
    pub arrival_z_m: f64,
    /// Z at release, m; overrides `arrival_z_m`.
    pub release_z_m: Option<f64>,
    /// See [`ClimbConstants::thrust_m_s2`].
    pub thrust_m_s2: Option<f64>,
    /// See [`ClimbConstants::ramp_s`].
    pub ramp_s: Option<f64>,
    /// See [`ClimbConstants::burn_s`].
    pub burn_s: Option<f64>,
    /// See [`ClimbConstants::tail_s`].
    pub tail_s: Option<f64>,
    /// See [`ClimbConstants::modulation`].
    pub modulation: Option<f64>,
    /// See [`ClimbConstants::modulation_hz`].
    pub modulation_hz: Option<f64>,
    /// See [`ClimbConstants::drag_vertical_per_m`].
    pub drag_vertical_per_m: Option<f64>,
    /// See [`ClimbConstants::drag_horizontal_per_m`].
    pub drag_horizontal_per_m: Option<f64>,
    /// See [`ClimbConstants::buoyancy_m_s2`].
    pub buoyancy_m_s2: Option<f64>,
    /// See [`ClimbConstants::tilt_deg`].
    pub tilt_deg: Option<f64>,
    /// See [`ClimbConstants::carrier_m_s`].
    pub carrier_m_s: Option<f64>,
    /// See [`ClimbConstants::random_m_s2`].
    pub random_m_s2: Option<f64>,
    /// See [`ClimbConstants::random_low_hz`].
    pub random_low_hz: Option<f64>,
    /// See [`ClimbConstants::random_high_hz`].
    pub random_high_hz: Option<f64>,
    /// See [`ClimbConstants::surface_m_s2`].
    pub surface_m_s2: Option<f64>,
    /// See [`ClimbConstants::surface_depth_m`].
    pub surface_depth_m: Option<f64>,
}

impl Default for ClimbScenario {
    fn default() -> Self {
        Self {
            profile: Profile::Steep,
            vary: 1.0,
            frame_s: None,
            tether_frames: 80,
            overlap_frames: 30,
            beacon_frames: 75,
            unseen_frames: 100,
            gap_s: 0.0,
            arrival_z_m: -0.2,
            release_z_m: None,
            thrust_m_s2: None,
            ramp_s: None,
            burn_s: None,
            tail_s: None,
            modulation: None,
            modulation_hz: None,
            drag_vertical_per_m: None,
            drag_horizontal_per_m: None,
            buoyancy_m_s2: None,
            tilt_deg: None,
            carrier_m_s: None,
            random_m_s2: None,
            random_low_hz: None,
            random_high_hz: None,
            surface_m_s2: None,
            surface_depth_m: None,
        }
    }
}

impl ClimbScenario {
    /// The constants, the profile's where the scenario gives none.
    #[must_use]
    pub fn constants(&self) -> ClimbConstants {
        let profile = self.profile.constants();
        ClimbConstants {
            thrust_m_s2: self.thrust_m_s2.unwrap_or(profile.thrust_m_s2),
            ramp_s: self.ramp_s.unwrap_or(profile.ramp_s),
            burn_s: self.burn_s.unwrap_or(profile.burn_s),
            tail_s: self.tail_s.unwrap_or(profile.tail_s),
            modulation: self.modulation.unwrap_or(profile.modulation),
            modulation_hz: self.modulation_hz.unwrap_or(profile.modulation_hz),
            drag_vertical_per_m: self.drag_vertical_per_m.unwrap_or(profile.drag_vertical_per_m),
            drag_horizontal_per_m: self.drag_horizontal_per_m.unwrap_or(profile.drag_horizontal_per_m),
            buoyancy_m_s2: self.buoyancy_m_s2.unwrap_or(profile.buoyancy_m_s2),
            tilt_deg: self.tilt_deg.unwrap_or(profile.tilt_deg),
            carrier_m_s: self.carrier_m_s.unwrap_or(profile.carrier_m_s),
            random_m_s2: self.random_m_s2.unwrap_or(profile.random_m_s2),
            random_low_hz: self.random_low_hz.unwrap_or(profile.random_low_hz),
            random_high_hz: self.random_high_hz.unwrap_or(profile.random_high_hz),
            surface_m_s2: self.surface_m_s2.unwrap_or(profile.surface_m_s2),
            surface_depth_m: self.surface_depth_m.unwrap_or(profile.surface_depth_m),
        }
    }

    /// The instants that part the climb.
    #[must_use]
    pub fn phases(&self) -> Phases {
        let frames = Frames {
            tether: self.tether_frames,
            overlap: self.overlap_frames,
            beacon: self.beacon_frames,
            unseen: self.unseen_frames,
        };
        Phases::new(&frames, self.frame_s.unwrap_or(self.profile.frame_s()), self.gap_s)
    }

    /// Where the climb begins.
    #[must_use]
    pub fn start(&self) -> Start {
        self.release_z_m.map_or(Start::ToReach { z_m: self.arrival_z_m }, |z_m| Start::At { z_m })
    }
}

/// One sensor's numbers; the defaults are the tether's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SensorScenario {
    /// Whether the log has it.
    pub enabled: bool,
    /// Samples a second.
    pub rate_hz: f64,
    /// When the first sample comes, a share of the period.
    pub phase: f64,
    /// Sigma of the instant of sampling, s.
    pub jitter_s: f64,
    /// Sigma of the position's noise per axis, m.
    pub position_sigma_m: f64,
    /// Sigma of the velocity's noise per axis, m/s.
    pub velocity_sigma_m_s: f64,
    /// Correlation of the noise from one sample to the next; 0 for white noise.
    pub noise_correlation: f64,
    /// The least time from sampling to reception, s.
    pub latency_s: f64,
    /// Sigma of the normal deviate whose size is added to the latency, s.
    pub latency_jitter_s: f64,
    /// The share of outliers.
    pub outlier_share: f64,
    /// The least error of an outlier: m of position, m/s of velocity.
    pub outlier_min_m: f64,
    /// The greatest error of an outlier: m of position, m/s of velocity.
    pub outlier_max_m: f64,
    /// The share of outliers whose velocity is wild too.
    pub outlier_velocity_share: f64,
    /// The share of samples lost.
    pub dropout_share: f64,
    /// The mean length of a burst of lost samples.
    pub dropout_burst: f64,
    /// When it begins to see, s after release; default by the phases.
    pub begin_s: Option<f64>,
    /// When it stops, s after release; default by the phases.
    pub end_s: Option<f64>,
    /// Systematic errors.
    pub errors: ErrorsScenario,
}

impl Default for SensorScenario {
    fn default() -> Self {
        Self {
            enabled: true,
            rate_hz: 100.0,
            phase: 0.0,
            jitter_s: 0.0,
            position_sigma_m: 0.10,
            velocity_sigma_m_s: 0.10,
            noise_correlation: 0.0,
            latency_s: 0.002,
            latency_jitter_s: 0.001,
            outlier_share: 0.0,
            outlier_min_m: 2.0,
            outlier_max_m: 20.0,
            outlier_velocity_share: 0.5,
            dropout_share: 0.0,
            dropout_burst: 5.0,
            begin_s: None,
            end_s: None,
            errors: ErrorsScenario::default(),
        }
    }
}

/// Systematic errors: fixed, or drawn for each run from N(0, sigma) per axis or U(-max, max).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ErrorsScenario {
    /// The bias, m; drawn if not given.
    pub bias_m: Option<[f64; 3]>,
    /// The velocity bias, m/s; drawn if not given.
    pub velocity_bias_m_s: Option<[f64; 3]>,
    /// The drift, m/s; drawn if not given.
    pub drift_m_s: Option<[f64; 3]>,
    /// The scale error, a share; drawn if not given.
    pub scale: Option<f64>,
    /// The clock offset, s, positive where the stamps are late; drawn if not given.
    pub clock_offset_s: Option<f64>,
    /// Sigma of the bias per axis, m.
    pub bias_sigma_m: f64,
    /// Sigma of the velocity bias per axis, m/s.
    pub velocity_bias_sigma_m_s: f64,
    /// Sigma of the drift per axis, m/s.
    pub drift_sigma_m_s: f64,
    /// Sigma of the scale error, a share.
    pub scale_sigma: f64,
    /// The greatest clock offset, s.
    pub clock_offset_max_s: f64,
}

impl ErrorsScenario {
    /// The spread of an acoustic beacon's errors.
    #[must_use]
    pub fn of_a_beacon() -> Self {
        Self {
            bias_sigma_m: 1.5,
            velocity_bias_sigma_m_s: 0.3,
            drift_sigma_m_s: 0.05,
            scale_sigma: 0.002,
            clock_offset_max_s: 0.060,
            ..Self::default()
        }
    }
}

/// What the log holds beside the sensors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RecordingScenario {
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
        // Strictly and from the text first, so that what is wrong is named with its line.
        toml::from_str::<Self>(text).map_err(Box::new)?;
        let mut keys = toml::Table::try_from(Self::default()).map_err(Box::new)?;
        overlay(&mut keys, toml::from_str(text).map_err(Box::new)?);
        let scenario: Self = keys.try_into().map_err(Box::new)?;
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

/// Puts the keys of `top` over those of `base`, table by table.
fn overlay(base: &mut toml::Table, top: toml::Table) {
    for (key, value) in top {
        match (base.get_mut(&key), value) {
            (Some(toml::Value::Table(base)), toml::Value::Table(top)) => overlay(base, top),
            (_, value) => {
                base.insert(key, value);
            }
        }
    }
}
