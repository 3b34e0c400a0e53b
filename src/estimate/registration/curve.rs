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

impl Curve for RegisteredCurve {
    fn at(&self, time_s: f64) -> Option<State> {
        let inside = self.pieces.iter().any(|p| (p.0..=p.1).contains(&time_s));
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
