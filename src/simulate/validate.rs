//! Whether a scenario makes sense, and stays within what a machine can hold.

use super::climb_scenario::ClimbScenario;
use super::error::SimulateError;
use super::scenario::{RecordingScenario, Scenario};
use super::sensor_scenario::{ErrorsScenario, SensorScenario};

/// Most samples of one sensor, and messages of one other channel: three hours at 100 Hz.
pub(super) const MAX_SAMPLES: f64 = 1e6;
/// Most frames of a climb: 17 minutes of a steep one.
const MAX_FRAMES: f64 = 5e4;
/// Most bytes of sonar pings.
const MAX_SONAR_BYTES: f64 = 1e9;

/// One table's keys, with its name for the messages.
pub(super) struct Table<'a>(pub(super) &'a str);

impl Table<'_> {
    pub(super) fn within(&self, key: &str, value: f64, low: f64, high: f64) -> Result<(), SimulateError> {
        if (low..=high).contains(&value) {
            return Ok(());
        }
        let key = if self.0.is_empty() { key.to_owned() } else { format!("{}.{key}", self.0) };
        Err(SimulateError::OutOfRange { key, value, low, high })
    }

    pub(super) fn all_within(&self, ranges: &[(&str, f64, f64, f64)]) -> Result<(), SimulateError> {
        ranges.iter().try_for_each(|&(key, value, low, high)| self.within(key, value, low, high))
    }

    pub(super) fn ordered(
        &self,
        key: &str,
        low: f64,
        high_key: &str,
        high: f64,
    ) -> Result<(), SimulateError> {
        if low <= high {
            return Ok(());
        }
        let name = |key: &str| format!("{}.{key}", self.0);
        Err(SimulateError::Reversed { key: name(key), high_key: name(high_key), low, high })
    }

    /// Both ends of a range, and their order.
    pub(super) fn range(
        &self,
        key: &str,
        [from, to]: [f64; 2],
        low: f64,
        high: f64,
    ) -> Result<(), SimulateError> {
        let [first, second] = [0, 1].map(|i| format!("{key}[{i}]"));
        self.within(&first, from, low, high)?;
        self.within(&second, to, low, high)?;
        self.ordered(&first, from, &second, to)
    }

    pub(super) fn at_most(&self, what: &'static str, value: f64, limit: f64) -> Result<(), SimulateError> {
        if value <= limit {
            return Ok(());
        }
        Err(SimulateError::TooLarge { table: self.0.to_owned(), what, value, limit })
    }
}

impl Scenario {
    /// Checks that every number is in its range, and that together they don't ask for too much.
    ///
    /// # Errors
    ///
    /// [`SimulateError::OutOfRange`] with the key and its range, [`SimulateError::Reversed`] for a range
    /// whose ends are swapped, [`SimulateError::TooLarge`] for more samples than a log should hold.
    pub fn validate(&self) -> Result<(), SimulateError> {
        epoch(self.epoch_ns)?;
        climb(&Table("climb"), &self.climb)?;
        let t3_s = self.climb.phases().t3_s;
        for (name, scenario) in
            [("tether", &self.tether), ("beacon", &self.beacon), ("reference", &self.reference)]
        {
            sensor(name, scenario, t3_s)?;
        }
        recording(&Table("recording"), &self.recording, t3_s)
    }
}

/// The instant of release.
pub(super) fn epoch(epoch_ns: i64) -> Result<(), SimulateError> {
    Table("").within("epoch_ns", epoch_ns as f64, 1e15, 4e18)
}

fn climb(table: &Table, climb: &ClimbScenario) -> Result<(), SimulateError> {
    let frames = [climb.tether_frames, climb.overlap_frames, climb.beacon_frames, climb.unseen_frames];
    table.at_most("frames", frames.iter().map(|&n| f64::from(n)).sum(), MAX_FRAMES)?;
    let c = climb.constants();
    let phases = climb.phases();
    table.all_within(&[
        ("vary", climb.vary, 0.0, 5.0),
        ("frame_s", phases.frame_s, 1e-3, 0.1),
        ("overlap_frames", f64::from(climb.overlap_frames), 1.0, MAX_FRAMES),
        ("unseen_frames", f64::from(climb.unseen_frames), 1.0, MAX_FRAMES),
        ("gap_s", climb.gap_s, 0.0, 2.0 * phases.t1_s.min(phases.t2_s - phases.t1_s)),
        ("arrival_z_m", climb.arrival_z_m, -12_000.0, 0.0),
        ("release_z_m", climb.release_z_m.unwrap_or(-1.0), -12_000.0, 0.0),
        ("thrust_m_s2", c.thrust_m_s2, 0.0, 200.0),
        ("ramp_s", c.ramp_s, 1e-3, 100.0),
        ("burn_s", c.burn_s, 0.0, 1000.0),
        ("tail_s", c.tail_s, 1e-3, 100.0),
        ("modulation", c.modulation, 0.0, 1.0),
        ("modulation_hz", c.modulation_hz, 0.0, 10.0),
        ("drag_vertical_per_m", c.drag_vertical_per_m, 0.0, 1.0),
        ("drag_horizontal_per_m", c.drag_horizontal_per_m, 0.0, 1.0),
        ("buoyancy_m_s2", c.buoyancy_m_s2, -9.81, 50.0),
        ("tilt_deg", c.tilt_deg, 0.0, 90.0),
        ("carrier_m_s", c.carrier_m_s, 0.0, 30.0),
        ("random_m_s2", c.random_m_s2, 0.0, 20.0),
        ("random_low_hz", c.random_low_hz, 0.0, 20.0),
        ("random_high_hz", c.random_high_hz, 0.0, 20.0),
        ("surface_m_s2", c.surface_m_s2, 0.0, 20.0),
        ("surface_depth_m", c.surface_depth_m, 0.1, 1000.0),
    ])?;
    table.ordered("random_low_hz", c.random_low_hz, "random_high_hz", c.random_high_hz)
}

/// A sensor's keys, its errors' too; it sees the vehicle up to `t3_s`.
pub(super) fn sensor(name: &str, sensor: &SensorScenario, t3_s: f64) -> Result<(), SimulateError> {
    let table = &Table(name);
    let (begin_s, end_s) = (sensor.begin_s.unwrap_or(0.0), sensor.end_s.unwrap_or(t3_s));
    table.all_within(&[
        ("rate_hz", sensor.rate_hz, 0.01, 10_000.0),
        ("phase", sensor.phase, 0.0, 1.0),
        ("jitter_s", sensor.jitter_s, 0.0, 1.0),
        ("position_sigma_m", sensor.position_sigma_m, 0.0, 1000.0),
        ("velocity_sigma_m_s", sensor.velocity_sigma_m_s, 0.0, 1000.0),
        ("noise_correlation", sensor.noise_correlation, -0.999, 0.999),
        ("latency_s", sensor.latency_s, 0.0, 60.0),
        ("latency_jitter_s", sensor.latency_jitter_s, 0.0, 60.0),
        ("outlier_share", sensor.outlier_share, 0.0, 1.0),
        ("outlier_min_m", sensor.outlier_min_m, 0.0, 1e5),
        ("outlier_max_m", sensor.outlier_max_m, 0.0, 1e5),
        ("outlier_velocity_share", sensor.outlier_velocity_share, 0.0, 1.0),
        ("dropout_share", sensor.dropout_share, 0.0, 0.95),
        ("dropout_burst", sensor.dropout_burst, 1.0, 1e5),
        ("begin_s", begin_s, 0.0, t3_s),
        ("end_s", end_s, 0.0, t3_s),
    ])?;
    table.ordered("outlier_min_m", sensor.outlier_min_m, "outlier_max_m", sensor.outlier_max_m)?;
    table.ordered("begin_s", begin_s, "end_s", end_s)?;
    table.at_most("samples", (end_s - begin_s) * sensor.rate_hz, MAX_SAMPLES)?;
    errors(&Table(&format!("{name}.errors")), &sensor.errors)
}

fn errors(table: &Table, errors: &ErrorsScenario) -> Result<(), SimulateError> {
    let vectors = [
        ("bias_m", errors.bias_m, 1e5),
        ("velocity_bias_m_s", errors.velocity_bias_m_s, 1e3),
        ("drift_m_s", errors.drift_m_s, 1e3),
    ];
    for (key, vector, limit) in vectors {
        vector.iter().flatten().try_for_each(|&value| table.within(key, value, -limit, limit))?;
    }
    table.all_within(&[
        ("scale", errors.scale.unwrap_or(0.0), -0.9, 10.0),
        ("clock_offset_s", errors.clock_offset_s.unwrap_or(0.0), -1e5, 1e5),
        ("bias_sigma_m", errors.bias_sigma_m, 0.0, 1e4),
        ("velocity_bias_sigma_m_s", errors.velocity_bias_sigma_m_s, 0.0, 100.0),
        ("drift_sigma_m_s", errors.drift_sigma_m_s, 0.0, 100.0),
        ("scale_sigma", errors.scale_sigma, 0.0, 0.2),
        ("clock_offset_max_s", errors.clock_offset_max_s, 0.0, 1e5),
    ])
}

fn recording(table: &Table, recording: &RecordingScenario, t3_s: f64) -> Result<(), SimulateError> {
    table.all_within(&[
        ("lead_s", recording.lead_s, 0.0, 10_000.0),
        ("tail_s", recording.tail_s, 0.0, 10_000.0),
        ("sonar_rate_hz", recording.sonar_rate_hz, 0.01, 1000.0),
        ("sonar_bytes", f64::from(recording.sonar_bytes), 16.0, 1e7),
        ("chunk_bytes", f64::from(recording.chunk_bytes), 1024.0, 64e6),
    ])?;
    let pings = (recording.lead_s + t3_s + recording.tail_s) * recording.sonar_rate_hz;
    table.at_most("sonar pings", pings, MAX_SAMPLES)?;
    table.at_most("bytes of sonar pings", pings * f64::from(recording.sonar_bytes), MAX_SONAR_BYTES)
}
