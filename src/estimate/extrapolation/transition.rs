//! From where the track ends over to what a law says.
//!
//! Track and law see the same samples, but a law that is fitted to a second or more knows the last velocity better than
//! a smooth curve does at its very end: carrying that end's error on for 2 s makes the extrapolation a tenth to a
//! quarter worse. So what they differ by at the end is taken for a passing error d with a Matern 3/2 covariance, of
//! which position and velocity are known once and nothing after:
//!
//! ```text
//! d(h) = (d0 + (d0' + d0 / T) h) exp(-h / T)
//! ```
//!
//! (Rasmussen & Williams 2006, eq. 4.17). Position and velocity go on without a step, and the law has its way after
//! a few T.

use crate::track::State;

/// T, s: on simulated climbs every choice up to 0.4 leaves the errors 2 s ahead as they are without a transition.
const PASSING_S: f64 = 0.3;

/// What the track's last state and the law's differ by.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transition {
    start: State,
    position_m: [f64; 3],
    velocity_m_s: [f64; 3],
}

impl Transition {
    /// From the track's last state, with the law's at the same instant.
    pub(super) fn of(start: State, law: &State) -> Self {
        let less = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|axis| a[axis] - b[axis]);
        Self {
            start,
            position_m: less(start.position, law.position),
            velocity_m_s: less(start.velocity, law.velocity),
        }
    }

    /// The law's state `lead_s` after the start, with what has not passed yet. The start's uncertainty, which holds what
    /// the registration leaves open, is carried on whole; the law's own comes in as the difference passes.
    pub(super) fn joined(&self, mut state: State, lead_s: f64) -> State {
        let decay = (-lead_s / PASSING_S).exp();
        let passed = 1.0 - (1.0 + lead_s / PASSING_S) * decay;
        for axis in 0..3 {
            let constant = self.position_m[axis];
            let slope = self.velocity_m_s[axis] + constant / PASSING_S;
            let now = constant + slope * lead_s;
            state.position[axis] += now * decay;
            state.velocity[axis] += (slope - now / PASSING_S) * decay;
            if let Some(acceleration) = &mut state.acceleration {
                acceleration[axis] += (now / PASSING_S - 2.0 * slope) / PASSING_S * decay;
            }
            let (p, v) = (self.start.position_sigma[axis], self.start.velocity_sigma[axis]);
            state.position_sigma[axis] = (passed * state.position_sigma[axis]).hypot(p + v * lead_s);
            state.velocity_sigma[axis] = (passed * state.velocity_sigma[axis]).hypot(v);
        }
        state
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_difference_begins_whole_is_its_own_derivative_and_passes() {
        let start = State {
            position: [1.0, -2.0, 0.5],
            velocity: [0.3, 0.0, -4.0],
            position_sigma: [0.1; 3],
            velocity_sigma: [0.2; 3],
            ..State::default()
        };
        let law = State {
            acceleration: Some([0.0; 3]),
            position_sigma: [0.5; 3],
            velocity_sigma: [0.6; 3],
            ..State::default()
        };
        let at = |lead_s| Transition::of(start, &law).joined(law, lead_s);
        for axis in 0..3 {
            assert!((at(0.0).position[axis] - start.position[axis]).abs() < 1e-12);
            assert!((at(0.0).velocity[axis] - start.velocity[axis]).abs() < 1e-12);
        }
        assert_eq!((at(0.0).position_sigma, at(0.0).velocity_sigma), ([0.1; 3], [0.2; 3]));
        for h in [0.0, 0.1, 0.7] {
            let slope = |f: fn(&State) -> [f64; 3], axis: usize| {
                (f(&at(h + 1e-6))[axis] - f(&at(h - 1e-6))[axis]) / 2e-6
            };
            for axis in 0..3 {
                assert!((slope(|s| s.position, axis) - at(h).velocity[axis]).abs() < 1e-6);
                let acceleration = at(h).acceleration.expect("the law has one");
                assert!((slope(|s| s.velocity, axis) - acceleration[axis]).abs() < 1e-5);
            }
        }
        let late = at(4.0);
        assert!(late.position.iter().chain(&late.velocity).all(|d| d.abs() < 1e-3), "{late:?}");
        assert!(late.position_sigma[0] > 0.9, "the start's uncertainty stays: {late:?}");
    }
}
