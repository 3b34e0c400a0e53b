//! Where the vehicle is and will be, by the past alone.
//!
//! [`Paper`] is the method of Liu 2023 as it is printed, [`Improved`] the same with its gaps closed. Both take fixes as
//! they arrive and answer for any later instant; [`Predictor::advance`] tells them what time it is, so that an exchange
//! ends when nothing more comes of it.
//!
//! | step | [`Paper`] | [`Improved`] |
//! |---|---|---|
//! | wild fixes | rate from the last exchange above a limit | several histories, the likeliest speaks |
//! | one point an exchange | mean | mean of the fixes that agree |
//! | alignment | Lagrange to the cycle's time (eq. 1) | none: the recursion takes any time |
//! | RLS (eq. 3) | quadratics, all points alike, time from the first fix | lines, what is old is forgotten, time from the newest |
//! | start | the first three points | any of the first eight exchanges |
//! | sigma | none | the recursion's |
//!
//! [`PaperSettings::memory_s`] gives the paper's method a forgetting factor and time relative to the newest cycle, and
//! leaves the rest as it is.

mod improved;
mod lagrange;
mod paper;
mod rls;

pub use improved::{Improved, ImprovedSettings};
pub use lagrange::quadratic;
pub use paper::{Paper, PaperSettings};
pub use rls::Rls;

use super::cycles::MOST_FIXES;
use crate::sample::Sample;
use crate::track::State;

/// A causal method.
pub trait Predictor {
    /// Takes a fix in. Fixes come in order of time; one that is older than the newest is passed over.
    fn push(&mut self, fix: &Sample);

    /// It is `now_s`: an exchange from which nothing came for a while is over.
    fn advance(&mut self, now_s: f64);

    /// Where the vehicle is at `time_s`, now or later, or `None` before there is a track. A sigma that the method
    /// doesn't know is NaN.
    fn at(&self, time_s: f64) -> Option<State>;
}

/// An exchange ends when nothing comes for this share of the cycle.
const EXCHANGE_SHARE: f64 = 0.25;

/// The fixes of the exchange that is going on.
#[derive(Clone, Debug, Default)]
struct Open {
    fixes: Vec<Sample>,
    newest_s: Option<f64>,
}

impl Open {
    /// Takes a fix in that is not older than the newest.
    fn push(&mut self, fix: &Sample) {
        if self.newest_s.is_none_or(|newest| fix.time_s >= newest) {
            self.newest_s = Some(fix.time_s);
            self.fixes.push(*fix);
        }
    }

    /// The fixes of an exchange that is over at `now_s`, or has as many as one may have.
    fn over(&mut self, now_s: f64, cycle_s: f64) -> Option<Vec<Sample>> {
        let last = self.fixes.last()?;
        let is_over = now_s - last.time_s > EXCHANGE_SHARE * cycle_s || self.fixes.len() >= MOST_FIXES;
        is_over.then(|| std::mem::take(&mut self.fixes))
    }
}

fn mean(fixes: &[Sample]) -> (f64, [f64; 3]) {
    let n = fixes.len() as f64;
    let of = |f: fn(&Sample, usize) -> f64, axis| fixes.iter().map(|s| f(s, axis)).sum::<f64>() / n;
    (of(|s, _| s.time_s, 0), std::array::from_fn(|axis| of(|s, a| s.value[a], axis)))
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}
