//! USBL cleaning and prediction: a deep vehicle's fixes come in bursts, some of them wild, with long silences between.
//!
//! Liu et al. 2023, Ship Science and Technology 45(16). Two methods live here:
//!
//! | method | where | knows |
//! |---|---|---|
//! | the paper's: rate gate, clusters, Lagrange alignment, RLS on quadratics | [`causal`] | the past |
//! | the same with its gaps closed: forgetting, relative time, wild first fixes, sigma | [`causal`] | the past |
//! | a robust smoother: a search over which exchanges to believe, then a Wiener spline | [`clean()`] | the whole dive |
//!
//! [`geometry`] makes positions of range, bearing and depression; [`crate::math::geodesy`] those of latitude and
//! longitude. A fix is a [`Sample`]: time, s; position, m, x east, y north, z up; standard deviation an axis, m. A
//! velocity is not measured.
//!
//! # The smoother
//!
//! ```text
//! p_k ~ N(position of the exchange's believed fixes, R_k)      where c_k = 1: the exchange is believed       (1)
//! p_k is off by any vector, rather a short one than a long one where c_k = 0                                  (2)
//! p'' = w(t), white of density q s(t)                                                                         (3)
//! ```
//!
//! | symbol | meaning | shape | unit |
//! |---|---|---|---|
//! | c_k | switch of exchange k; inside of it every fix has one of its own | 1 | - |
//! | q | density of the acceleration, horizontal and vertical | 2 | m^2/s^3 |
//! | s(t) | how lively the vehicle is about t: more in turns, less on legs | intervals | - |
//!
//! 1. *Exchanges* ([`cycles`]): fixes are parted at the valley between the gaps within an exchange and those between
//!    two; in each the sets of fixes that agree with each other are listed (`candidates`).
//! 2. *Switches* (`search`): a beam of Kalman filters, each with its own history of switches, that keeps the likeliest
//!    (multiple hypotheses; Reid 1979). No switch depends on a first guess, and a wild start is one history of many.
//!    A speed limit ends histories that would need more.
//! 3. *Smoother* (`wiener`): given the switches, (1) and (3) are one banded system (a cubic smoothing spline whose
//!    knots are the exchanges; Wahba 1978; Barfoot, Tong, Sarkka 2014), solved by the house's Cholesky factor; the
//!    selected inverse gives the bands, through silence too.
//! 4. *Switches again*, each against the track without its exchange, until none changes; then q, s and the noise by
//!    restricted likelihood, and a verdict for every fix.
//!
//! Where the data can't carry the track, [`Cleaned::warnings`] says so.
//!
//! # Use
//!
//! ```
//! use trackfuse::estimate::usbl::{Settings, Verdict, clean};
//! use trackfuse::sample::Sample;
//! use trackfuse::track::Curve;
//!
//! let fix = |i: u32| Sample {
//!     time_s: 20.0 * f64::from(i),
//!     value: [if i == 7 { 90.0 } else { 0.0 }, 0.0, -10.0 * f64::from(i)],
//!     sigma: [3.0; 3],
//! };
//! let fixes: Vec<Sample> = (0..30).map(fix).collect();
//! let cleaned = clean(&fixes, &[], &Settings::default())?;
//! assert_eq!(cleaned.judged[7].verdict, Verdict::Wild);
//! assert!(cleaned.at(130.0).is_some_and(|state| state.position[0].abs() < 5.0));
//! # Ok::<(), trackfuse::estimate::EstimateError>(())
//! ```

pub mod causal;
pub mod cycles;
pub mod geometry;
pub mod ship;

mod another;
mod candidates;
mod clean;
mod common;
mod dive;
mod judging;
mod liveliness;
mod search;
mod switches;
mod verdict;
mod warnings;
mod wiener;

pub use clean::{Cleaned, Settings, clean};
pub(crate) use verdict::beside;
pub use verdict::{Judged, Reason, Verdict, Warning};

use crate::sample::Sample;

/// A height from a depth sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Height {
    /// Seconds since the track's origin.
    pub time_s: f64,
    /// Height, m: minus the depth.
    pub z_m: f64,
    /// Standard deviation of its noise, m.
    pub sigma_m: f64,
}

/// Between heights farther apart than this nothing is known of the height, s: the vehicle sinks evenly for so long.
pub const CLOSE_S: f64 = 10.0;

/// Height at an instant and its standard deviation, m, of `heights` in order of time; `None` where no two close ones
/// lie about it.
#[must_use]
pub fn height_at(heights: &[Height], time_s: f64) -> Option<(f64, f64)> {
    dive::height_at(heights, time_s)
}

/// A fix whose noise is that of a system with this standard deviation an axis close by and this share of the slant
/// range far away: `sqrt(near^2 + (share * range)^2)`, m.
#[must_use]
pub fn sigma_at_range(near_m: f64, share: f64, range_m: f64) -> f64 {
    near_m.hypot(share * range_m)
}

/// The indices of `fixes` in order of time; those of equal times in the order in which they came.
fn in_order(fixes: &[Sample]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..fixes.len()).collect();
    order.sort_by(|&a, &b| fixes[a].time_s.total_cmp(&fixes[b].time_s));
    order
}

#[cfg(test)]
mod tests;
