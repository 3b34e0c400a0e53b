//! A true track, known at every instant.
//!
//! Between two steps of the integration holds the quintic through position, velocity and acceleration at both
//! ends, so that everywhere the velocity is the derivative of the position and the acceleration that of the
//! velocity.

use nalgebra::Vector3;

/// Where the vehicle is and how it moves, ENU.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Position x, y, z, m.
    pub position: Vector3<f64>,
    /// Velocity, m/s.
    pub velocity: Vector3<f64>,
    /// Acceleration, m/s2.
    pub acceleration: Vector3<f64>,
}

/// A climb's true track, known at every instant.
#[derive(Clone, Debug)]
pub struct Trajectory {
    pub(super) step_s: f64,
    /// The state at `i * step_s`; at least two.
    pub(super) knots: Vec<State>,
}

impl Trajectory {
    /// The state at `t_s` seconds after release.
    ///
    /// Before release, and beyond the last phase and its margin, the vehicle goes straight on at the speed it
    /// has there.
    #[must_use]
    pub fn at(&self, t_s: f64) -> State {
        let last = self.knots.len() - 1;
        if t_s < 0.0 {
            return straight_on(&self.knots[0], t_s);
        }
        if t_s >= self.end_s() {
            return straight_on(&self.knots[last], t_s - self.end_s());
        }
        let i = ((t_s / self.step_s) as usize).min(last - 1);
        quintic(&self.knots[i], &self.knots[i + 1], self.step_s, t_s / self.step_s - i as f64)
    }

    /// The last instant of the integration, s after release.
    #[must_use]
    pub fn end_s(&self) -> f64 {
        (self.knots.len() - 1) as f64 * self.step_s
    }

    /// The first instant, s after release, at which the state isn't finite.
    #[must_use]
    pub fn diverged_s(&self) -> Option<f64> {
        let finite = |s: &State| (s.position + s.velocity + s.acceleration).iter().all(|x| x.is_finite());
        self.knots.iter().position(|knot| !finite(knot)).map(|i| i as f64 * self.step_s)
    }
}

fn straight_on(state: &State, dt_s: f64) -> State {
    State { position: state.position + state.velocity * dt_s, acceleration: Vector3::zeros(), ..*state }
}

/// The quintic through two states `h` seconds apart, at the share `s` of the way.
fn quintic(a: &State, b: &State, h: f64, s: f64) -> State {
    // p(s) = c0 + c1 s + c2 s^2 + c3 s^3 + c4 s^4 + c5 s^5, where c0..c2 are the first state's,
    // and the rest closes the gaps that these leave at s = 1.
    let (c0, c1, c2) = (a.position, a.velocity * h, a.acceleration * (0.5 * h * h));
    let gap = b.position - (c0 + c1 + c2);
    let slope = b.velocity * h - (c1 + c2 * 2.0);
    let bend = b.acceleration * (h * h) - c2 * 2.0;
    let c3 = gap * 10.0 - slope * 4.0 + bend * 0.5;
    let c4 = gap * -15.0 + slope * 7.0 - bend;
    let c5 = gap * 6.0 - slope * 3.0 + bend * 0.5;
    State {
        position: c0 + (c1 + (c2 + (c3 + (c4 + c5 * s) * s) * s) * s) * s,
        velocity: (c1 + (c2 * 2.0 + (c3 * 3.0 + (c4 * 4.0 + c5 * (5.0 * s)) * s) * s) * s) / h,
        acceleration: (c2 * 2.0 + (c3 * 6.0 + (c4 * 12.0 + c5 * (20.0 * s)) * s) * s) / (h * h),
    }
}
