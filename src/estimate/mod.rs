//! The estimators: one file a method, beside its paper. Numbers in, curves out; no files, clocks or prints.

pub mod agreement;
pub mod characteristic_point;
pub mod coverage;
pub mod extrapolation;
pub mod moving_average;
pub mod noise;
pub mod polynomial;
pub mod spline;
pub mod weighted_mean;

/// Why an estimator has no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EstimateError {
    /// Fewer data than unknowns.
    #[error("{what}: need at least {needed} samples, got {got}")]
    TooFewSamples {
        /// The fit.
        what: String,
        /// How many it needs.
        needed: usize,
        /// How many there are.
        got: usize,
    },
    /// A number that no estimator can use.
    #[error("{what} at {time_s} s is {value}, expected {expected}")]
    BadNumber {
        /// The number's name, with its source.
        what: String,
        /// When, s since the track's origin.
        time_s: f64,
        /// Its value.
        value: f64,
        /// What it should have been.
        expected: &'static str,
    },
    /// The data don't determine the curve.
    #[error("{what}: the samples don't determine the curve ({why})")]
    Undetermined {
        /// The fit.
        what: String,
        /// What is missing.
        why: &'static str,
    },
}
