//! What the fixes of one exchange have in common: errors of the ship's position and attitude and of the speed of sound,
//! which a mean over the exchange doesn't lessen.
//!
//! ```text
//! z_i = p + dt_i v + b + n_i,    b ~ N(0, c^2),    n_i ~ N(0, s_i^2)                                   (1)
//! ```
//!
//! b is integrated out of the exchange's normal equations. With w_i = s_i^-2, u = sum w_i (1, dt_i) and
//! S = sum w_i + c^-2 they lose u u'/S and u sum(w_i z_i)/S, and given the state x = (p, v)
//!
//! ```text
//! b = (sum w_i z_i - u'x) / S, of variance 1/S                                                         (2)
//! ```
//!
//! c^2 is found with the rest by restricted likelihood: sum b^2 / sum (1 - var b / c^2), the fixed point of MacKay 1992.

use super::dive::Dive;
use super::switches::{Noise, Switches};
use super::wiener::{Knowledge, Wiener};

/// Fewest exchanges with several fixes that tell what they have in common.
const FEWEST: usize = 20;

/// What all fixes of an exchange are off by, as far as (2) tells.
#[derive(Clone, Copy, Debug)]
pub(super) struct Common {
    /// u / S.
    gain: [f64; 2],
    /// c^-2 / S, which is 1 less the first of these.
    left: f64,
    /// sum(w z) / S.
    mean: f64,
    /// 1 / S.
    variance: f64,
}

impl Common {
    /// That of fixes with these normal equations; `common_m2` is c^2.
    pub(super) fn of(own: &Knowledge, common_m2: f64) -> Self {
        if common_m2 <= 0.0 || own.gram[0] <= 0.0 {
            return Self { gain: [0.0; 2], left: 1.0, mean: 0.0, variance: 0.0 };
        }
        let s = own.gram[0] + common_m2.recip();
        let gain = [own.gram[0] / s, own.gram[1] / s];
        Self { gain, left: common_m2.recip() / s, mean: own.right[0] / s, variance: s.recip() }
    }

    /// The normal equations without it.
    pub(super) fn taken_from(&self, own: Knowledge) -> Knowledge {
        let [_, b] = self.gain;
        let [w, wt, wtt] = own.gram;
        let [wz, wtz] = own.right;
        let left = self.left;
        Knowledge { gram: [left * w, left * wt, wtt - b * wt], right: [left * wz, wtz - b * wz] }
    }

    /// b and its variance, given the state and its covariance.
    fn at(&self, [p, v]: [f64; 2], [pp, pv, vv]: [f64; 3]) -> (f64, f64) {
        let [a, b] = self.gain;
        (self.mean - a * p - b * v, self.variance + a * a * pp + 2.0 * a * b * pv + b * b * vv)
    }

    /// Where a fix `dt_s` after the node is to be expected but for its own noise, p + dt v + b, and the variance.
    pub(super) fn expected(&self, dt_s: f64, state: [f64; 2], covariance: [f64; 3]) -> (f64, f64) {
        let ([p, v], [pp, pv, vv]) = (state, covariance);
        let (g, h) = (self.left, dt_s - self.gain[1]);
        let variance = self.variance + g * g * pp + 2.0 * g * h * pv + h * h * vv;
        (p + dt_s * v + self.at(state, covariance).0, variance)
    }
}

/// The next c^2, horizontal and vertical; `usual_m2` is the variance of a fix.
pub(super) fn next(
    dive: &Dive,
    switches: &Switches,
    track: &Wiener,
    noise: Noise,
    usual_m2: [f64; 2],
) -> [f64; 2] {
    let several = |e: &usize| dive.exchanges[*e].fixes.clone().filter(|&i| switches.used[i]).count() > 1;
    let several: Vec<usize> = (0..dive.exchanges.len()).filter(several).collect();
    if several.len() < FEWEST {
        return [0.0; 2];
    }
    [0..2, 2..3].map(|axes| {
        let which = axes.start / 2;
        let (now, usual) = (noise.common_m2[which], usual_m2[which]);
        // nothing in common is the likeliest before anything is known
        let (mut squares, mut determined) = (0.01 * usual, 1.0);
        for axis in axes {
            for &e in &several {
                let (_, common) = switches.told(dive, e, axis, noise);
                let (state, covariance) = track.node(axis, dive.node_of[e]);
                let (b, variance) = common.at(state, covariance);
                squares += b * b;
                determined += (1.0 - variance / now).clamp(0.0, 1.0);
            }
        }
        let factor = squares / determined / now;
        // downwards squared: where little is in common, the plain step takes long to say so; upwards held, so that the
        // motion has its chance to explain what it can
        let factor = if factor < 1.0 { (factor * factor).max(0.05) } else { factor.min(3.0) };
        (now * factor).clamp(1e-6 * usual, 1e6 * usual)
    })
}
