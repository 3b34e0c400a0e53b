//! The paper's method with its gaps closed: recursive least squares that forgets, starts again, and knows its sigma.
//!
//! The recursion (Liu 2023, eq. 3) runs on lines instead of quadratics, time counting from the newest exchange; what is
//! old is forgotten by the covariance that white acceleration adds, which makes it a Kalman filter. Several histories of
//! what was wild are followed at once (`search`), so that a wild start, or a wild exchange that looks like a turn, is
//! forgiven as soon as later exchanges tell. Filters with different densities of acceleration run side by side, and the
//! one whose predictions were likeliest lately speaks.

use super::{Open, Predictor};
use crate::estimate::usbl::candidates::{WildShares, exchanges};
use crate::estimate::usbl::search::{Beam, Motion};
use crate::sample::Sample;
use crate::track::State;

/// What may be chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImprovedSettings {
    /// Usual time from one acoustic exchange to the next, s.
    pub cycle_s: f64,
    /// The vehicle is rarely faster, m/s.
    pub speed_limit_m_s: f64,
    /// Standard deviation of what the fixes of one exchange have in common beside their own noise, m: horizontal, vertical.
    pub common_m: [f64; 2],
}

impl Default for ImprovedSettings {
    fn default() -> Self {
        Self { cycle_s: 20.0, speed_limit_m_s: 2.5, common_m: [0.0; 2] }
    }
}

/// Densities of the acceleration that are tried, over the square of the speed limit, 1/s. None is lower: on a long leg a calm
/// filter looks best, and then loses the vehicle in the turn.
const DENSITIES: [f64; 3] = [2e-4, 6e-4, 2e-3];

/// How likely predictions were is forgotten by this factor an exchange: about a quarter of an hour.
const KEEP: f64 = 0.98;

/// How often fixes and exchanges are wild, before and after: there is no hurry to learn it.
const WILD: WildShares = WildShares { fix: 0.1, cycle: 0.1 };

/// So many exchanges make a track, as with the paper.
const FEWEST: usize = 3;

/// Most fixes of an exchange that are looked at.
const MOST: usize = crate::estimate::usbl::cycles::MOST_FIXES;

/// The improved causal method.
#[derive(Clone, Debug)]
pub struct Improved {
    settings: ImprovedSettings,
    open: Open,
    /// Filters, and how likely their predictions were lately, as a logarithm.
    beams: Vec<(Beam, f64)>,
    exchanges: usize,
}

impl Improved {
    /// Before the first fix.
    #[must_use]
    pub fn new(settings: ImprovedSettings) -> Self {
        let limit = settings.speed_limit_m_s;
        let beam = |density: f64| {
            let motion = Motion { density: [density * limit * limit; 3], speed_limit_m_s: limit };
            (Beam::new(WILD, motion), 0.0)
        };
        Self {
            settings,
            open: Open::default(),
            beams: DENSITIES.into_iter().map(beam).collect(),
            exchanges: 0,
        }
    }

    fn close(&mut self, fixes: &[Sample]) {
        let fixes = &fixes[..fixes.len().min(MOST)];
        let common_m2 = self.settings.common_m.map(|c| c * c);
        let groups = std::iter::once(0..fixes.len()).collect::<Vec<_>>();
        let (found, candidates) =
            exchanges(fixes, &groups, WILD, 0.3 * self.settings.speed_limit_m_s, common_m2);
        self.exchanges += 1;
        for (beam, lately) in &mut self.beams {
            found.iter().for_each(|exchange| beam.step(exchange, &candidates));
            *lately = KEEP * *lately + beam.forget();
        }
    }
}

impl Predictor for Improved {
    fn push(&mut self, fix: &Sample) {
        self.advance(fix.time_s);
        self.open.push(fix);
    }

    fn advance(&mut self, now_s: f64) {
        if let Some(fixes) = self.open.over(now_s, self.settings.cycle_s) {
            self.close(&fixes);
        }
    }

    fn at(&self, time_s: f64) -> Option<State> {
        if self.exchanges < FEWEST {
            return None;
        }
        let (best, _) = self.beams.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let axes = best.at(time_s)?;
        Some(State {
            position: axes.map(|a| a[0][0]),
            velocity: axes.map(|a| a[1][0]),
            acceleration: None,
            position_sigma: axes.map(|a| a[0][1].max(0.0).sqrt()),
            velocity_sigma: axes.map(|a| a[1][1].max(0.0).sqrt()),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fix(time_s: f64, value: [f64; 3]) -> Sample {
        Sample { time_s, value, sigma: [3.0; 3] }
    }

    #[test]
    fn a_wild_first_exchange_is_forgiven() {
        let mut method = Improved::new(ImprovedSettings::default());
        for i in 0..12 {
            let t = 20.0 * f64::from(i);
            let off = if i == 0 { 250.0 } else { 0.0 };
            (0..4).for_each(|k| {
                let t = t + 0.5 * f64::from(k);
                method.push(&fix(t, [0.5 * t + off, 1.0, -0.7 * t]));
            });
        }
        method.advance(260.0);
        let state = method.at(280.0).expect("a track");
        assert!((state.position[0] - 140.0).abs() < 2.0, "{state:?}");
        assert!((state.velocity[2] + 0.7).abs() < 0.1, "{state:?}");
    }

    #[test]
    fn the_sigma_grows_through_silence() {
        let mut method = Improved::new(ImprovedSettings::default());
        (0..30).for_each(|i| method.push(&fix(20.0 * f64::from(i), [0.0; 3])));
        method.advance(600.0);
        let sigma = |t: f64| method.at(t).expect("a track").position_sigma[0];
        assert!(sigma(600.0) < sigma(660.0) && sigma(660.0) < sigma(820.0));
    }

    #[test]
    fn a_fix_that_comes_late_is_passed_over() {
        let mut method = Improved::new(ImprovedSettings::default());
        (0..10).for_each(|i| method.push(&fix(20.0 * f64::from(i), [0.0; 3])));
        let before = method.clone().at(300.0);
        method.push(&fix(35.0, [500.0, 0.0, 0.0]));
        assert_eq!(method.at(300.0), before);
    }
}
