//! Errors of many points, added up by phase.

use trackfuse::track::State;

/// Nominal half-width of a 95 % band, sigmas.
const BAND_SIGMAS: f64 = 1.96;

/// Errors of one phase, of position and velocity.
#[derive(Clone, Copy, Default)]
pub(crate) struct Sum {
    squares: [f64; 2],
    inside: [usize; 2],
    points: usize,
}

impl Sum {
    pub(crate) fn add(&mut self, state: &State, position: [f64; 3], velocity: [f64; 3]) {
        for axis in 0..3 {
            let errors = [state.position[axis] - position[axis], state.velocity[axis] - velocity[axis]];
            let sigmas = [state.position_sigma[axis], state.velocity_sigma[axis]];
            for q in 0..2 {
                self.squares[q] += errors[q] * errors[q];
                self.inside[q] += usize::from(errors[q].abs() <= BAND_SIGMAS * sigmas[q]);
            }
        }
        self.points += 1;
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        for q in 0..2 {
            self.squares[q] += other.squares[q];
            self.inside[q] += other.inside[q];
        }
        self.points += other.points;
    }

    pub(crate) fn rmse(&self, q: usize) -> f64 {
        (self.squares[q] / self.points as f64).sqrt()
    }

    pub(crate) fn coverage(&self, q: usize) -> f64 {
        self.inside[q] as f64 / (3 * self.points) as f64
    }
}

/// Phase 1, overlap (or gap) and phase 2.
#[derive(Clone, Copy, Default)]
pub(crate) struct Tally(pub(crate) [Sum; 3]);

impl Tally {
    /// Adds a point at `t_s` where the overlap (or gap) stands between two instants.
    pub(crate) fn add(
        &mut self,
        (t_s, overlap): (f64, (f64, f64)),
        state: &State,
        position: [f64; 3],
        velocity: [f64; 3],
    ) {
        let (low, high) = (overlap.0.min(overlap.1), overlap.0.max(overlap.1));
        let phase = usize::from(t_s >= low) + usize::from(t_s > high);
        self.0[phase].add(state, position, velocity);
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        self.0.iter_mut().zip(&other.0).for_each(|(sum, other)| sum.merge(other));
    }

    /// All phases as one.
    pub(crate) fn pooled(&self) -> Sum {
        let mut all = Sum::default();
        self.0.iter().for_each(|sum| all.merge(sum));
        all
    }
}

pub(crate) fn print_head() {
    println!(
        "family        | position, m           | velocity, m/s      | inside, position   | inside, velocity   |"
    );
}

pub(crate) fn print_row(name: &str, Tally([a, b, c]): &Tally, rest: &str) {
    let numbers = |f: &dyn Fn(&Sum) -> String| [a, b, c].map(f).join(" ");
    println!(
        "{name:13} | {:21} | {:18} | {:18} | {:18} | {rest}",
        numbers(&|s| format!("{:.4}", s.rmse(0))),
        numbers(&|s| format!("{:.3}", s.rmse(1))),
        numbers(&|s| format!("{:.3}", s.coverage(0))),
        numbers(&|s| format!("{:.3}", s.coverage(1))),
    );
}

pub(crate) fn print_pooled(all: &Tally) {
    let pooled = all.pooled();
    println!(
        "pooled: {:.3} of positions inside, {:.3} of velocities",
        pooled.coverage(0),
        pooled.coverage(1)
    );
}
