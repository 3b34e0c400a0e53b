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
    #[error("{what} at {time_s} s is {value:?}, expected {expected}")]
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
    /// USBL fixes that a depth sensor speaks against, so that none or too few are left.
    #[error("{off} of {of} fixes are not at the depth sensor's depth (median: {})", usbl::beside(*median_m))]
    OffDepth {
        /// How many are elsewhere.
        off: usize,
        /// Of how many that have a depth beside them.
        of: usize,
        /// How far those are above the depth sensor's depth in the median, m.
        median_m: f64,
    },
    /// USBL fixes that all say one of a few positions again.
    #[error("{held} of {of} fixes only repeat the position before them: too few are left")]
    Held {
        /// How many.
        held: usize,
        /// Of how many.
        of: usize,
    },
}

impl EstimateError {
    /// What to do about it.
    #[must_use]
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::OffDepth { .. } => Some("check sign, unit and zero of `usbl.depth`".into()),
            Self::Held { .. } => {
                Some("a system may say its last fix again while it hears nothing: look for a channel without these".into())
            }
            Self::TooFewSamples { what, .. } if what == "usbl" => Some(
                "a track needs four fixes in three acoustic exchanges; `fix` in `[usbl]` names another topic".into(),
            ),
            _ => None,
        }
    }
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
            source.series(quantity).iter().try_for_each(|s| check_sample(&source.name, quantity, s))?;
        }
    }
    Ok(())
}

/// Refuses a sample: see [`check()`].
fn check_sample(source: &str, quantity: Quantity, sample: &Sample) -> Result<(), EstimateError> {
    let usable = |v: &f64| v.abs() <= LARGEST;
    let sane = |v: &f64| (LARGEST.recip()..=LARGEST).contains(v);
    let good = sample.value.iter().all(usable) && sample.sigma.iter().all(sane) && usable(&sample.time_s);
    if good { Ok(()) } else { Err(bad_number(source, quantity, sample)) }
}

/// What is wrong with a sample that [`check()`] found.
fn bad_number(source: &str, quantity: Quantity, sample: &Sample) -> EstimateError {
    let value = sample.value.iter().find(|v| !(-LARGEST..=LARGEST).contains(*v));
    let sigma = sample.sigma.iter().find(|v| !(LARGEST.recip()..=LARGEST).contains(v));
    let (value, expected) = match (value, sigma) {
        (Some(&v), _) => (v, "a finite number"),
        (None, Some(&v)) => (v, "a positive sigma"),
        (None, None) => (sample.time_s, "a finite time"),
    };
    let what = format!("{} of {source}", quantity.name());
    EstimateError::BadNumber { what, time_s: sample.time_s, value, expected }
}
