//! The estimators: one file a method, beside its paper. Numbers in, curves out; no files, clocks or prints.

pub mod agreement;
pub mod characteristic_point;
pub mod coverage;
pub mod extrapolation;
pub mod moving_average;
pub mod noise;
pub mod polynomial;
pub mod registration;
pub mod spline;
pub mod usbl;
pub mod weighted_mean;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::sample::{Quantity, Sample, Source};
use crate::track::Method;

/// The estimators.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Estimator {
    /// General data fusion, the weighted mean.
    Gdf,
    /// Polynomial constraint fusion.
    Pcf,
    /// Spline function fusion.
    #[default]
    Sff,
    /// Moving average over the weighted mean.
    MovingAverage,
}

impl Estimator {
    /// The method of the points that it makes.
    #[must_use]
    pub fn method(self) -> Method {
        match self {
            Self::Gdf => Method::WeightedMean,
            Self::Pcf => Method::Polynomial,
            Self::Sff => Method::Spline,
            Self::MovingAverage => Method::MovingAverage,
        }
    }
}

/// Whether the velocity is the derivative of the position.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Coefficients {
    /// p = q: it is.
    #[default]
    Shared,
    /// Position and velocity are fitted apart, as eq. 8 says literally.
    Independent,
}

impl Coefficients {
    /// The reading's name in configs and reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Shared => "shared",
            Self::Independent => "independent",
        }
    }
}

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

/// Numbers beyond this overflow when they are squared a few times: no measurement is that large.
const LARGEST: f64 = 1e60;

/// Refuses samples that no estimator can use.
///
/// # Errors
/// [`EstimateError::BadNumber`] for the first value or time that is not finite, or sigma that is not positive,
/// or that is beyond 1e60.
pub fn check(sources: &[Source]) -> Result<(), EstimateError> {
    for source in sources {
        for quantity in Quantity::ALL {
            let good = |s: &Sample| {
                let usable = |v: &f64| v.abs() <= LARGEST;
                let sane = |v: &f64| (LARGEST.recip()..=LARGEST).contains(v);
                s.value.iter().all(usable) && s.sigma.iter().all(sane) && usable(&s.time_s)
            };
            if let Some(sample) = source.series(quantity).iter().find(|s| !good(s)) {
                return Err(bad_number(source, quantity, sample));
            }
        }
    }
    Ok(())
}

/// What is wrong with a sample that [`check()`] found.
fn bad_number(source: &Source, quantity: Quantity, sample: &Sample) -> EstimateError {
    let value = sample.value.iter().find(|v| !(-LARGEST..=LARGEST).contains(*v));
    let sigma = sample.sigma.iter().find(|v| !(LARGEST.recip()..=LARGEST).contains(v));
    let (value, expected) = match (value, sigma) {
        (Some(&v), _) => (v, "a finite number"),
        (None, Some(&v)) => (v, "a positive sigma"),
        (None, None) => (sample.time_s, "a finite time"),
    };
    let what = format!("{} of {}", quantity.name(), source.name);
    EstimateError::BadNumber { what, time_s: sample.time_s, value, expected }
}
