//! Whether what was thrown out is another track: another vehicle or transponder among the fixes, or a reflection.
//!
//! Wild fixes are off anywhere. Those of something else that moves are off like the one before them, by much more than
//! they differ.

use super::candidates::{AGREE, minus, square};
use super::verdict::Warning;
use super::warnings::Evidence;
use crate::math::robust;

/// So fast what is off may move against the track, over the vehicle's speed limit.
const DRIFT: f64 = 0.1;

/// A fix tells something that is off by more than so many times what it may differ by: of others one in fifty agrees by
/// chance.
const CLEAR: f64 = 2.0;

/// Fewest fixes that tell something, and the share of them that agree for a warning.
const FEWEST: usize = 10;
const MANY_ALIKE: f64 = 0.3;

/// A warning where the fixes that were thrown out agree with each other.
pub(super) fn track(evidence: &Evidence) -> Option<Warning> {
    let &Evidence { dive, switches, judging, fit_scale, speed_limit_m_s, .. } = evidence;
    let residual_m = |i: usize| judging.judged[judging.usable[i]].residual_m;
    let mut alike = 0;
    let mut told_m = Vec::new();
    let mut last: Option<(usize, usize)> = None;
    for (e, exchange) in dive.exchanges.iter().enumerate() {
        for i in exchange.fixes.clone().filter(|&i| !switches.used[i]) {
            let Some((last_e, j)) = last.replace((e, i)) else { continue };
            // what a whole exchange has in common says nothing of others
            if last_e == e && !switches.believed[e] {
                continue;
            }
            let (a, b) = (&dive.fixes[j], &dive.fixes[i]);
            let drift = (DRIFT * speed_limit_m_s * (b.time_s - a.time_s)).powi(2);
            let variance: [f64; 3] = std::array::from_fn(|axis| {
                fit_scale[axis / 2].powi(2) * (a.sigma[axis].powi(2) + b.sigma[axis].powi(2)) + drift
            });
            let off_m = square(residual_m(i)).sqrt();
            let reach_m = (AGREE * variance.iter().fold(0.0, |v: f64, w| v.max(*w))).sqrt();
            if off_m > CLEAR * reach_m {
                told_m.push(off_m);
                let apart = minus(residual_m(i), residual_m(j));
                let squares = (0..3).map(|axis| apart[axis] * apart[axis] / variance[axis]);
                alike += usize::from(squares.sum::<f64>() < AGREE);
            }
        }
    }
    let of = told_m.len();
    let off_m = robust::median(&mut told_m)?;
    (of >= FEWEST && alike as f64 > MANY_ALIKE * of as f64).then_some(Warning::AnotherTrack {
        alike,
        of,
        off_m,
    })
}
