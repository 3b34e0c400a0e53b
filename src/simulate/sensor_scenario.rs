//! A sensor's numbers: sampling, noise, latency, outliers, dropouts, and systematic errors.

use serde::{Deserialize, Serialize};

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
