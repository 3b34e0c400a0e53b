//! The track beyond the last sample: a law of motion fitted to the last stretch, carried on.
//!
//! Zhang 2025 fits an order-4 PCF to the last 46 samples and carries it 100 samples on. Plain least squares
//! does that for a moment only: the errors of its jerk and snap grow with t^3 and t^4. With a [`Prior`]
//! that lets the acceleration die away, as that of a body in water does, it holds several times longer. The other law
//! is that body's own: constant force and quadratic drag. Either goes on from where the track ends without a step;
//! the paper's plain polynomial doesn't, as in the paper.
//!
//! The band. What a law gets wrong is the future acceleration. Take that as white noise of density q
//! (m^2/s^3) from the last sample on: the velocity's variance grows by q h, the position's by q h^3 / 3 at a
//! lead h, beside the fit's own. q is found by maximum likelihood from *rolling origins*: the same
//! extrapolation from six earlier instants, held against the curve that the later samples gave. They also say which of
//! several laws does better on this log.

mod drag;
mod transition;

use transition::Transition;

use super::Coefficients;
use super::EstimateError;
use super::polynomial::{self, Prior};
use crate::math::{robust, scalar};
use crate::sample::Source;
use crate::track::{Curve, Method, State};

/// What may be chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The candidates.
    pub laws: Vec<Law>,
    /// Which of them is taken.
    pub choice: Choice,
    /// How far to go, s.
    pub horizon_s: f64,
}

/// Which of several laws is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// The first; the others are tried for comparison only.
    First,
    /// The one that does better from earlier instants.
    Best,
}

/// A law of motion, and the stretch that it is fitted to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law {
    /// Which.
    pub kind: LawKind,
    /// Length of the stretch, s.
    pub window_s: f64,
}

/// What moves the vehicle on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LawKind {
    /// A polynomial of this order (PCF); without a prior the paper's plain least squares.
    Polynomial {
        /// Its order.
        order: usize,
        /// The constraint on jerk and snap.
        prior: Option<Prior>,
    },
    /// Constant force and quadratic drag.
    Drag,
}

/// The polynomial's default prior: the acceleration dies away in 2 s, its derivatives within 0.25 m/s^3 and m/s^4.
///
/// The best of several on simulated climbs. A body slowed by the drag k v^2 has tau = 1 / 2 k v: 2 s at 12 m/s and
/// 0.02 /m.
pub const PRIOR: Prior = Prior { sigma: 0.25, decay_s: Some(2.0) };

impl Law {
    /// The default, fitted to the stretch that was the best of several on simulated climbs.
    pub const POLYNOMIAL: Self =
        Self { kind: LawKind::Polynomial { order: 4, prior: Some(PRIOR) }, window_s: 1.4 };
    /// The law of drag, fitted to the stretch that was the best.
    pub const DRAG: Self = Self { kind: LawKind::Drag, window_s: 0.9 };
}

impl LawKind {
    /// Its name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.method().name()
    }

    /// The method of the points that it makes.
    #[must_use]
    pub fn method(self) -> Method {
        match self {
            Self::Polynomial { .. } => Method::Polynomial,
            Self::Drag => Method::Drag,
        }
    }
}

/// Earlier instants that the same extrapolation is tried from.
const ORIGINS: usize = 6;

/// The farthest lead at which it is tried, s: farther back the vehicle may still be driven.
const TRIED_S: f64 = 1.4;

/// Leads at which each trial is held against the curve.
const LEADS: usize = 4;

/// A law carried on, with a band that grows.
pub struct Extrapolation {
    /// The law.
    pub law: Law,
    fitted: Box<dyn Curve>,
    transition: Option<Transition>,
    /// The last sample's time, s.
    pub from_s: f64,
    /// Density q of the acceleration's error by axis, m^2/s^3.
    pub acceleration_density: [f64; 3],
    /// How the trials from earlier instants did.
    pub holdout: Holdout,
}

/// How the trials from earlier instants did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Holdout {
    /// Root mean square 3-D position error at the farthest lead of each trial, m.
    pub position_m: f64,
    /// Root mean square 3-D velocity error there, m/s.
    pub velocity_m_s: f64,
    /// The mean of those leads, s.
    pub lead_s: f64,
    /// Number of trials.
    pub trials: usize,
    /// How well the curve that they are held against is known there: its root mean square 3-D sigma, m.
    pub known_m: f64,
}

/// A law is clearly better than another whose error is this many times its own.
const CLEARLY: f64 = 1.5;

impl Holdout {
    /// Whether these trials show a law clearly better than the other's: from the same instants, an error at least a
    /// third smaller, and by more than the curve is known to.
    #[must_use]
    pub fn clearly_better_than(&self, other: &Self) -> bool {
        self.trials == other.trials
            && CLEARLY * self.position_m <= other.position_m
            && other.position_m - self.position_m > self.known_m.max(other.known_m)
    }
}

/// A trial held against the curve at one lead.
struct Miss {
    lead_s: f64,
    origin: usize,
    made: State,
    truth: State,
}

/// Fits `law` to the last stretch before `to_s`, to be carried `horizon_s` on, and judges it on the stretch of
/// `curve` before that.
///
/// # Errors
/// Those of the law's fit; [`EstimateError::TooFewSamples`] where the curve, which begins at
/// `from_s`, is too short for a single trial, so that nobody could say how far off the result is.
pub fn extrapolate(
    sources: &[Source],
    curve: &dyn Curve,
    (from_s, to_s): (f64, f64),
    law: Law,
    horizon_s: f64,
) -> Result<Extrapolation, EstimateError> {
    let fit = |end_s: f64, reach_s: f64| -> Result<Box<dyn Curve>, EstimateError> {
        let start_s = end_s - law.window_s;
        Ok(match law.kind {
            LawKind::Polynomial { order, prior } => {
                Box::new(polynomial::fit(sources, start_s, end_s, order, Coefficients::Shared, prior)?)
            }
            LawKind::Drag => Box::new(drag::fit(sources, start_s, end_s, reach_s)?),
        })
    };
    let fitted = fit(to_s, horizon_s)?;
    let plain = matches!(law.kind, LawKind::Polynomial { prior: None, .. });
    // a curve without an acceleration of its own (GDF, the moving average) is no motion to go on from
    let last = curve.at(to_s).filter(|s| !plain && s.acceleration.is_some());
    let transition = last.zip(fitted.at(to_s)).map(|(last, law)| Transition::of(last, &law));
    let reach = horizon_s.min(TRIED_S).min(0.5 * (to_s - from_s));
    let mut misses = Vec::new();
    for origin in 1..=ORIGINS {
        let origin_s = to_s - reach * origin as f64 / ORIGINS as f64;
        if let Ok(trial) = fit(origin_s, to_s - origin_s) {
            for lead in 1..=LEADS {
                let lead_s = (to_s - origin_s) * lead as f64 / LEADS as f64;
                let time_s = (origin_s + lead_s).min(to_s);
                let pair = trial.at(time_s).zip(curve.at(time_s));
                let pair = pair.filter(|(made, truth)| made.is_finite() && truth.is_finite());
                misses.extend(pair.map(|(made, truth)| Miss { lead_s, origin, made, truth }));
            }
        }
    }
    if misses.is_empty() {
        return Err(EstimateError::TooFewSamples {
            what: "extrapolation's trials".into(),
            needed: 1,
            got: 0,
        });
    }
    let acceleration_density = std::array::from_fn(|axis| density(&misses, axis));
    let holdout = holdout(&misses);
    Ok(Extrapolation { law, fitted, transition, from_s: to_s, acceleration_density, holdout })
}

/// The best of several by the trials from earlier instants: the first of those that are equally far off.
#[must_use]
pub fn best<'a>(candidates: impl IntoIterator<Item = &'a Extrapolation>) -> Option<&'a Extrapolation> {
    let off = |e: &Extrapolation| e.holdout.position_m;
    candidates.into_iter().reduce(|best, next| if off(next) < off(best) { next } else { best })
}

/// The density q of greatest likelihood on one axis, m^2/s^3: the upper quartile over the origins, since a
/// trial or two that were surprised by the end of a thrust say nothing of what comes.
fn density(misses: &[Miss], axis: usize) -> f64 {
    let of_origin = |misses: &[Miss]| {
        let cost = |exponent: f64| {
            let q = 10.0_f64.powf(exponent);
            let term = |error: f64, variance: f64| variance.ln() + error * error / variance;
            misses
                .iter()
                .map(|m| {
                    let h = m.lead_s;
                    let variance = |a: f64, b: f64, growth: f64| (a * a + b * b + q * growth).max(1e-30);
                    let p =
                        variance(m.made.position_sigma[axis], m.truth.position_sigma[axis], h.powi(3) / 3.0);
                    let v = variance(m.made.velocity_sigma[axis], m.truth.velocity_sigma[axis], h);
                    term(m.made.position[axis] - m.truth.position[axis], p)
                        + term(m.made.velocity[axis] - m.truth.velocity[axis], v)
                })
                .sum()
        };
        10.0_f64.powf(scalar::minimise(-8.0, 6.0, 28, 0.01, cost).x)
    };
    let mut densities: Vec<f64> = misses.chunk_by(|a, b| a.origin == b.origin).map(of_origin).collect();
    robust::quantile(&mut densities, 0.75).unwrap_or(0.0)
}

fn holdout(misses: &[Miss]) -> Holdout {
    let farthest: Vec<&Miss> = misses.chunk_by(|a, b| a.origin == b.origin).filter_map(<[_]>::last).collect();
    let mean = |f: &dyn Fn(&Miss) -> f64| farthest.iter().map(|m| f(m)).sum::<f64>() / farthest.len() as f64;
    let square = |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>();
    Holdout {
        position_m: mean(&|m| square(m.made.position, m.truth.position)).sqrt(),
        velocity_m_s: mean(&|m| square(m.made.velocity, m.truth.velocity)).sqrt(),
        lead_s: mean(&|m| m.lead_s),
        trials: farthest.len(),
        known_m: mean(&|m| m.truth.position_sigma.iter().map(|s| s * s).sum()).sqrt(),
    }
}

impl Extrapolation {
    /// Whether it goes on from the track's last state, whose uncertainty it then holds.
    #[must_use]
    pub fn is_joined(&self) -> bool {
        self.transition.is_some()
    }
}

impl Curve for Extrapolation {
    fn at(&self, time_s: f64) -> Option<State> {
        let lead = time_s - self.from_s;
        let state = self.fitted.at(time_s).filter(|_| lead >= 0.0)?;
        let mut state = self.transition.map_or(state, |t| t.joined(state, lead));
        for (axis, q) in self.acceleration_density.into_iter().enumerate() {
            state.position_sigma[axis] = state.position_sigma[axis].hypot((q * lead.powi(3) / 3.0).sqrt());
            state.velocity_sigma[axis] = state.velocity_sigma[axis].hypot((q * lead).sqrt());
        }
        Some(state).filter(State::is_finite)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::weighted_mean::WeightedMean;
    use crate::sample::Sample;

    fn source(seconds: f64, z: impl Fn(f64) -> (f64, f64)) -> Source {
        let n = (seconds / 0.02).round() as i32;
        let series = |f: &dyn Fn(f64) -> f64| {
            (0..=n)
                .map(|i| 0.02 * f64::from(i))
                .map(|t| Sample { time_s: t, value: [f(t); 3], sigma: [0.01; 3] })
                .collect()
        };
        Source { name: "test".into(), positions: series(&|t| z(t).0), velocities: series(&|t| z(t).1) }
    }

    const PRIOR: Prior = Prior { sigma: 0.25, decay_s: None };
    const PCF: Law = Law { kind: LawKind::Polynomial { order: 4, prior: Some(PRIOR) }, window_s: 1.4 };
    const DRAG: Law = Law { kind: LawKind::Drag, window_s: 0.9 };

    fn run(source: Source, law: Law) -> Result<Extrapolation, EstimateError> {
        let end = source.span_s().map_or(0.0, |s| s.1);
        let sources = vec![source];
        let curve = WeightedMean::new(sources.clone());
        extrapolate(&sources, &curve, (0.0, end), law, 2.0)
    }

    #[test]
    fn uniform_acceleration_is_carried_on_with_a_narrow_band() {
        let found = run(source(4.0, |t| (0.5 * t * t, t)), PCF).expect("long enough");
        let state = found.at(6.0).expect("beyond the end");
        assert!((state.position[0] - 18.0).abs() < 1e-3 && (state.velocity[0] - 6.0).abs() < 1e-3);
        assert!(state.position_sigma[0] < 0.4, "{}", state.position_sigma[0]);
        assert!(found.at(3.9).is_none());
    }

    #[test]
    fn a_motion_that_polynomials_follow_badly_gets_a_band_that_says_so() {
        let wave = |t: f64| (2.0 * (3.0 * t).sin(), 6.0 * (3.0 * t).cos());
        let found = run(source(6.0, wave), PCF).expect("long enough");
        for lead in [0.3, 1.0, 2.0] {
            let state = found.at(6.0 + lead).expect("beyond the end");
            let error = (state.position[0] - wave(6.0 + lead).0).abs();
            assert!(error < 2.5 * state.position_sigma[0], "{lead}: {error} {}", state.position_sigma[0]);
        }
        assert_eq!(found.holdout.trials, ORIGINS);
        assert!(found.holdout.position_m > 0.05, "{:?}", found.holdout);
    }

    /// A smooth curve that ends beside what its samples say.
    struct Beside;

    impl Curve for Beside {
        fn at(&self, time_s: f64) -> Option<State> {
            Some(State {
                position: [0.5 * time_s * time_s + 0.07; 3],
                velocity: [time_s - 0.4; 3],
                acceleration: Some([30.0; 3]),
                position_sigma: [0.05; 3],
                velocity_sigma: [0.2; 3],
            })
        }
    }

    #[test]
    fn a_law_goes_on_from_the_curves_last_state_and_band_but_the_plain_polynomial_as_printed() {
        let sources = [source(4.0, |t| (0.5 * t * t, t))];
        let carry = |law| extrapolate(&sources, &Beside, (0.0, 4.0), law, 2.0).expect("long enough");
        let last = Beside.at(4.0).expect("everywhere");
        for law in [PCF, DRAG] {
            let first = carry(law).at(4.0).expect("its start");
            for axis in 0..3 {
                assert!((first.position[axis] - last.position[axis]).abs() < 1e-12);
                assert!((first.velocity[axis] - last.velocity[axis]).abs() < 1e-12);
            }
            assert_eq!((first.position_sigma, first.velocity_sigma), ([0.05; 3], [0.2; 3]));
        }
        let far = carry(PCF).at(6.0).expect("ahead");
        assert!((far.position[0] - 18.0).abs() < 0.01, "the law has its way: {}", far.position[0]);
        let printed = Law { kind: LawKind::Polynomial { order: 4, prior: None }, window_s: 1.4 };
        assert!((carry(printed).at(4.0).expect("its start").position[0] - 8.0).abs() < 1e-6);
    }

    #[test]
    fn clearly_better_is_a_third_less_off_from_the_same_instants_beyond_what_is_known() {
        let of = |position_m, trials| Holdout { position_m, trials, known_m: 0.05, ..Holdout::default() };
        assert!(of(0.6, 6).clearly_better_than(&of(1.0, 6)));
        assert!(!of(0.7, 6).clearly_better_than(&of(1.0, 6)), "not by a third");
        assert!(!of(0.6, 5).clearly_better_than(&of(1.0, 6)), "other instants");
        assert!(!of(0.01, 6).clearly_better_than(&of(0.05, 6)), "within the track's own sigma");
    }

    #[test]
    fn a_result_beyond_every_number_is_none() {
        let found = run(source(4.0, |t| (t.powi(4), 4.0 * t.powi(3))), PCF).expect("long enough");
        assert!(found.at(6.0).is_some() && found.at(1e200).is_none());
    }

    #[test]
    fn a_track_too_short_to_judge_is_not_extrapolated() {
        assert!(run(source(0.04, |t| (t, 1.0)), PCF).is_err());
    }

    #[test]
    fn the_law_that_did_better_on_this_log_is_taken() {
        // slowed by drag alone: v = 1 / (1/15 + k t), 20 m/s^2 at first
        let slowed = |t: f64| ((1.0 + 1.5 * t).ln() / 0.1, 1.0 / (1.0 / 15.0 + 0.1 * t));
        let vertical = |s: Source| Source {
            positions: s.positions.iter().map(|p| Sample { value: [0.0, 0.0, p.value[2]], ..*p }).collect(),
            velocities: s.velocities.iter().map(|p| Sample { value: [0.0, 0.0, p.value[2]], ..*p }).collect(),
            ..s
        };
        let both = [PCF, DRAG].map(|law| run(vertical(source(3.0, slowed)), law).expect("long enough"));
        assert_eq!(best(&both).map(|b| b.law.kind), Some(LawKind::Drag));
        let off = |e: &Extrapolation| (e.at(5.0).expect("ahead").position[2] - slowed(5.0).0).abs();
        assert!(
            off(&both[1]) < 0.05 && off(&both[0]) > 2.0 * off(&both[1]),
            "{} {}",
            off(&both[0]),
            off(&both[1])
        );
        let thrown = |t: f64| (15.0 * t - 4.9 * t * t, 15.0 - 9.8 * t);
        let fitted: Vec<_> =
            [DRAG, PCF].into_iter().filter_map(|law| run(source(3.0, thrown), law).ok()).collect();
        assert_eq!(best(&fitted).map(|b| b.law), Some(PCF));
    }
}
