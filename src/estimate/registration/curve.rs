//! The registered curve: the spline with the border's share in its bands.

use super::bordered::Posterior;
use super::knots::Knots;
use super::normal::motion;
use crate::math::gaussian_basis::Active;
use crate::math::simd::{Kernel, vectorised};
use crate::track::{Curve, State};

/// The datum's view of where the vehicle was.
#[derive(Clone, Debug)]
pub struct RegisteredCurve {
    pub(super) knots: Knots,
    pub(super) posterior: Posterior,
    pub(super) centre: [f64; 3],
    pub(super) pieces: Vec<(f64, f64)>,
}

impl RegisteredCurve {
    /// Lets it cover these pieces, from and to in s, in order: those of the samples at their true times.
    pub fn cover(&mut self, pieces: Vec<(f64, f64)>) {
        self.pieces = pieces;
    }

    /// The instant nearest to `time_s` that it covers, and how far that is away, s.
    #[must_use]
    pub fn nearest(&self, time_s: f64) -> (f64, f64) {
        let after = self.first_not_before(time_s);
        let about = self.pieces[after.saturating_sub(1)..].iter().take(2);
        let near = about.map(|p| time_s.clamp(p.0, p.1)).map(|t| (t, (time_s - t).abs()));
        near.reduce(|a, b| if b.1 < a.1 { b } else { a }).unwrap_or((time_s, 0.0))
    }

    /// Index of the first piece that doesn't end before `time_s`.
    fn first_not_before(&self, time_s: f64) -> usize {
        self.pieces.partition_point(|p| p.1 < time_s)
    }
}

impl Curve for RegisteredCurve {
    fn at(&self, time_s: f64) -> Option<State> {
        let inside = self.pieces.get(self.first_not_before(time_s)).is_some_and(|p| p.0 <= time_s);
        inside.then(|| vectorised(StateAt { curve: self, time_s }))
    }
}

struct StateAt<'a> {
    curve: &'a RegisteredCurve,
    time_s: f64,
}

impl Kernel for StateAt<'_> {
    type Output = State;

    #[inline(always)]
    fn run(self) -> State {
        let RegisteredCurve { knots, posterior, centre, .. } = self.curve;
        let mut active = Active::default();
        knots.evaluate(self.time_s, &mut active);
        let [position, velocity, acceleration] = motion(&posterior.coefficients, &active, *centre);
        let sigma = |b: &[f64]| {
            std::array::from_fn(|axis| posterior.variance(axis, active.first, b, 1.0, None).sqrt())
        };
        State {
            position,
            velocity,
            acceleration: Some(acceleration),
            position_sigma: sigma(active.value()),
            velocity_sigma: sigma(active.slope()),
        }
    }
}
