//! Nine families of runs, each with one trouble of its own; a study runs many seeds of each.

use super::climb_scenario::Profile;
use super::error::SimulateError;
use super::scenario::Scenario;
use super::sensor_scenario::ErrorsScenario;

/// The families' names.
pub const FAMILIES: [&str; 9] =
    ["nominal", "async", "outliers", "dropout", "gap", "bigtau", "drift", "single", "no_error"];

impl Scenario {
    /// The scenario of a family, with seed 1.
    ///
    /// Rates, phases and jitters are those of logs that another simulator made of the same families. The
    /// drift of `drift`, 0.18 m/s, is the rms over four of those.
    ///
    /// # Errors
    ///
    /// [`SimulateError::UnknownFamily`] for a name that isn't in [`FAMILIES`].
    pub fn family(name: &str) -> Result<Self, SimulateError> {
        // The tether at 100 Hz and the beacon at 30 Hz, not in step: common to most.
        let mut scenario = Self { name: name.to_owned(), ..Self::default() };
        scenario.sample_beacon(30.0, 0.37, 0.002);
        let description = match name {
            "nominal" => {
                scenario.tether.rate_hz = 50.0;
                scenario.sample_beacon(50.0, 0.0, 0.0);
                "both sensors at 50 Hz, at the same instants"
            }
            "async" => {
                scenario.sample_beacon(17.3, 0.41, 0.003);
                "tether at 100 Hz, beacon at 17.3 Hz with 3 ms of jitter"
            }
            "outliers" => {
                scenario.tether.outlier_share = 0.05;
                scenario.beacon.outlier_share = 0.05;
                "5 % gross outliers in both sensors, half of them in the velocity too"
            }
            "dropout" => {
                scenario.tether.dropout_share = 0.3;
                scenario.beacon.dropout_share = 0.3;
                "30 % of both sensors' samples lost, in bursts of five"
            }
            "gap" => {
                scenario.climb.gap_s = 0.3;
                "no overlap: 0.3 s between the tether's end and the beacon's begin"
            }
            "bigtau" => {
                scenario.beacon.errors.clock_offset_s = Some(0.080);
                "the beacon's clock is 80 ms late"
            }
            "drift" => {
                scenario.climb.profile = Profile::Oblique;
                scenario.tether.rate_hz = 40.0;
                scenario.sample_beacon(12.0, 0.37, 0.004);
                scenario.beacon.errors.drift_sigma_m_s = 0.18;
                "an oblique climb of 14 s, with a beacon that drifts"
            }
            "single" => {
                scenario.tether.enabled = false;
                scenario.beacon.begin_s = Some(0.0);
                scenario.beacon.errors = ErrorsScenario::default();
                "the beacon alone, from release on, without systematic errors"
            }
            "no_error" => {
                scenario.sample_beacon(17.3, 0.41, 0.003);
                scenario.beacon.errors = ErrorsScenario::default();
                "no systematic errors at all"
            }
            _ => return Err(SimulateError::UnknownFamily { name: name.to_owned() }),
        };
        Ok(Self { description: description.to_owned(), ..scenario })
    }

    fn sample_beacon(&mut self, rate_hz: f64, phase: f64, jitter_s: f64) {
        self.beacon.rate_hz = rate_hz;
        self.beacon.phase = phase;
        self.beacon.jitter_s = jitter_s;
    }
}
